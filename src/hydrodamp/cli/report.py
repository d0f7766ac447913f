"""``hydrodamp report``: the report of a folder of results, without fitting again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli.output import note

if TYPE_CHECKING:
    import os

    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.validation.comparison import Comparison
    from hydrodamp.vehicle.vehicle import Vehicle


def report(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A folder that compare or demo wrote with --out.")
    ],
    out: Annotated[
        str | None,
        typer.Option("--out", metavar="FILE", help="The file to write. [default: DIR/report.html]"),
    ] = None,
) -> None:
    """Make the report of a folder of results again, without fitting again."""
    from hydrodamp.cli.targets import check_out_file
    from hydrodamp.report.html.write import REPORT

    home = Path(folder)
    target = home / REPORT if out is None else Path(out)
    inputs = (path for path in home.rglob("*") if path != home / REPORT)
    check_out_file(str(target), map(str, inputs))
    if offer(folder, target):
        note(f"written to {target}")


def offer(results: Comparison | str, path: str | os.PathLike[str]) -> bool:
    """Write a report, or say how to get it where what it needs is not installed.

    Parameters
    ----------
    results : Comparison or str
        A comparison, or the folder it was written to.
    path : str or path
        The file.

    Returns
    -------
    written : bool
        Whether it was.
    """
    from hydrodamp.report.html.page import MISSING, installed
    from hydrodamp.report.html.write import write_report

    if not installed():
        note(MISSING)
        return False
    write_report(results, path)
    return True


def offer_of_fit(fit: Fit, vehicle: Vehicle, log: Log, words: tuple[str, ...], out: str) -> None:
    """Write the report of one fit beside its damping file, replayed on what it was fitted to.

    Parameters
    ----------
    fit : Fit
        With numbers.
    vehicle : Vehicle
        Everything known.
    log : Log
        What it was identified from.
    words : tuple of str
        What else was found of it.
    out : str
        The damping file.
    """
    from dataclasses import replace

    from hydrodamp.validation.compare import compare

    told = replace(fit, remarks=(*fit.remarks, *words))
    alone = compare((told,), vehicle, log)
    said = {**alone.provenance, "overlap": f"all {log.n} samples"}
    target = Path(out).with_suffix(".report.html")
    if offer(replace(alone, provenance=said), target):
        note(f"written to {target}")
