"""``hydrodamp probe``: what is in a log, and is it fit for the job."""

from __future__ import annotations

from typing import Annotated

import typer

from hydrodamp.cli import options
from hydrodamp.cli.output import emit, results


def probe(
    logs: options.SomeLogs,
    vehicle: Annotated[
        str | None,
        typer.Option(
            "--vehicle",
            metavar="V",
            help=f"Judge the log for this vehicle: one of {options.FLEET}, or a YAML file.",
        ),
    ] = None,
    mapping: options.MappingFile = None,
    json: options.Json = False,
) -> None:
    """Look through a log: what is in it, what is missing, is it fit for the job."""
    from hydrodamp.cli.select import read
    from hydrodamp.report.screen import show
    from hydrodamp.report.survey import survey
    from hydrodamp.report.survey_grids import survey_document, survey_grids
    from hydrodamp.report.verdict import verdict
    from hydrodamp.vehicle.fleet import find_vehicle

    craft = None if vehicle is None else find_vehicle(vehicle)
    log = read(logs, mapping)
    found = survey(log)
    judged = verdict(found, log, craft)
    if json:
        emit(survey_document(found, judged))
    else:
        show(results(), *survey_grids(found, judged))
