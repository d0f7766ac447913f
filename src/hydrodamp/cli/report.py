"""``hydrodamp report``: the report of a folder of results, without fitting again."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli.output import note

if TYPE_CHECKING:
    import os

    from hydrodamp.data.log import Log
    from hydrodamp.identification.fit import Fit
    from hydrodamp.report.gallery.findings import Findings
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


def offer(
    results: Comparison | str,
    path: str | os.PathLike[str],
    findings: Findings | None = None,
    then: str = "run the command again",
) -> bool:
    """Write a report, or say how to get it where what it needs is not installed.

    Parameters
    ----------
    results : Comparison or str
        A comparison, or the folder it was written to.
    path : str or path
        The file.
    findings : Findings, optional
        Grades and pictures; by default those in the folder.
    then : str, optional
        What to do once it is installed.

    Returns
    -------
    written : bool
        Whether it was.
    """
    from hydrodamp.report.html.page import MISSING, installed
    from hydrodamp.report.html.write import write_report

    if not installed():
        note(f"{MISSING}, then {then}.")
        return False
    write_report(results, path, findings)
    return True


def illustrate(comparison: Comparison, vehicle: Vehicle, train: Log, home: Path) -> tuple[str, ...]:
    """Write grades, pictures and the report of a comparison into its folder.

    Parameters
    ----------
    comparison : Comparison
        Written there already.
    vehicle : Vehicle
        Everything known.
    train : Log
        What was identified from.
    home : path
        The folder.

    Returns
    -------
    written : tuple of str
        What was, by name; of what lacks a package it is said how to get it.
    """
    from hydrodamp.report.gallery.folder import FIGURES, GRADES, write_findings
    from hydrodamp.report.html.write import REPORT

    findings = look_closer(comparison, vehicle, train)
    write_findings(findings, home)
    again = f"`{shlex.join(('hydrodamp', 'report', str(home)))}` makes it"
    there = {
        GRADES: findings.identifiability is not None,
        FIGURES: bool(findings.gallery.pictures),
        REPORT: offer(comparison, home / REPORT, findings, again),
    }
    return tuple(name for name, written in there.items() if written)


def look_closer(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade and draw the chosen row, with a bar; say how to get pictures where there are none.

    Parameters
    ----------
    comparison : Comparison
        With the whole logs of its replays.
    vehicle : Vehicle
        Everything known.
    train : Log
        What was identified from.

    Returns
    -------
    findings : Findings
        Grades, and pictures where matplotlib is installed.
    """
    from hydrodamp.cli.progress import stages
    from hydrodamp.report.gallery.examine import MISSING, drawable, examine

    if not drawable():
        note(MISSING)
    with stages("drawing") as reach:
        return examine(comparison, vehicle, train, reach)


def offer_of_fit(fit: Fit, vehicle: Vehicle, log: Log, words: tuple[str, ...], out: str) -> None:
    """Write report and pictures of one fit beside its damping file.

    It is replayed on what it was fitted to.

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

    from hydrodamp.report.gallery.folder import write_gallery
    from hydrodamp.validation.compare import compare

    told = replace(fit, remarks=(*fit.remarks, *words))
    alone = compare((told,), vehicle, log)
    said = {**alone.provenance, "overlap": f"all {log.n} samples"}
    one = replace(alone, provenance=said)
    findings = look_closer(one, vehicle, log)
    figures, target = (Path(out).with_suffix(end) for end in (".figures", ".report.html"))
    if findings.gallery.pictures or figures.is_dir():  # those of an earlier fit go
        write_gallery(findings.gallery, figures)
    if findings.gallery.pictures:
        note(f"written to {figures}")
    if offer(one, target, findings):
        note(f"written to {target}")
