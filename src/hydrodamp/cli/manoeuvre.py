"""``hydrodamp manoeuvre``: standard manoeuvres of a ship, compared with limits of the IMO."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

from hydrodamp.cli.inputs import read_damping_and_vehicle
from hydrodamp.cli.output import note, print_output
from hydrodamp.files import load_json
from hydrodamp.results import check_results


def manoeuvre(
    damping: str,
    out: Path,
    vehicle: str = "",
    speed: float | None = None,
    length: float | None = None,
    rudder: str = "",
    propeller: str = "",
    rudder_rate: float | None = None,
    force: bool = False,
    json: bool = False,
) -> None:
    """Simulate turning circle, zigzags, spiral and stopping, and compare with limits of the IMO."""
    from hydrodamp.experiment_design.ship_manoeuvres import evaluate_ship
    from hydrodamp.export.export import list_reservations
    from hydrodamp.report import manoeuvre_report as report

    check_results(out, report.RESULTS, force)
    numbers, fit, craft = read_damping_and_vehicle(damping, vehicle)
    rate = None if rudder_rate is None else radians(rudder_rate)
    commands = {"rudder": rudder, "propeller": propeller}
    result = evaluate_ship(
        craft, numbers, speed, fit=fit, length=length, rudder_rate=rate, **commands
    )
    if fit is not None:
        reservations = (*_read_verdict(Path(damping)), *list_reservations(fit))
        result = replace(result, reservations=reservations)
    missing = report.write_manoeuvres(result, out)
    document = report.manoeuvre_document(result)
    verdict = f"Verdict: {document['verdict']}"
    print_output(json, document, verdict, report.manoeuvre_table(result))
    for message in missing:
        note(message)
    note(f"written to {out}: pictures and manoeuvres.json.")


def _read_verdict(damping: Path) -> list[str]:
    """Return the first line of the verdict that `hydrodamp identify` writes with its fit."""
    with suppress(KeyError, TypeError):
        document: Any = load_json(damping)
        return str(document["verdict"]["text"]).splitlines()[:1]
    return []
