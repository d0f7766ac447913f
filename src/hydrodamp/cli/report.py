"""``hydrodamp report``: the report of a folder of results, without fitting again."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hydrodamp.cli.output import note

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from hydrodamp.cli.beside import Beside
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
    from hydrodamp.errors import FileError
    from hydrodamp.report.html.write import REPORT

    home = Path(folder)
    if not (home / "comparison.json").is_file():
        raise FileError(
            f"{folder}: is no folder of results, for there is no comparison.json in it; name one "
            "that `compare` or `demo` wrote with `--out`."
        )
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
    """Write a report, or say how to get it where what it needs is not installed."""
    from hydrodamp.report.html.page import MISSING, installed
    from hydrodamp.report.html.write import write_report

    if not installed():
        note(f"{MISSING}, then {then}.")
        return False
    write_report(results, path, findings)
    return True


def illustrate(comparison: Comparison, vehicle: Vehicle, train: Log, home: Path) -> tuple[str, ...]:
    """Write grades, pictures and the report of a comparison into its folder."""
    from hydrodamp.report.gallery.band_file import BAND
    from hydrodamp.report.gallery.findings import FIGURES
    from hydrodamp.report.gallery.folder import GRADES, write_findings
    from hydrodamp.report.html.write import REPORT

    findings = look_closer(comparison, vehicle, train)
    write_findings(findings, home)
    again = f"`{shlex.join(('hydrodamp', 'report', str(home)))}` makes it"
    there = {
        GRADES: findings.identifiability is not None or bool(findings.not_graded),
        BAND: findings.band is not None,
        FIGURES: bool(findings.gallery.pictures),
        REPORT: offer(comparison, home / REPORT, findings, again),
    }
    return tuple(name for name, written in there.items() if written)


def look_closer(comparison: Comparison, vehicle: Vehicle, train: Log) -> Findings:
    """Grade and draw the chosen row, with a bar; say how to get pictures where there are none."""
    from hydrodamp.cli.progress import stages
    from hydrodamp.report.gallery.examine import MISSING, drawable, examine

    if not drawable():
        note(MISSING)
    with stages("drawing") as reach:
        return examine(comparison, vehicle, train, reach)


def offer_of_fit(
    fit: Fit, vehicle: Vehicle, log: Log, said: Mapping[str, str], beside: Beside
) -> None:
    """Write report and pictures of one fit beside its damping file."""
    from dataclasses import replace

    from hydrodamp.cli.guard import warned
    from hydrodamp.report.gallery.folder import write_gallery
    from hydrodamp.validation.compare import compare

    alone = compare((fit,), vehicle, log)
    words = {**alone.provenance, "overlap": f"all {log.n} samples", **said}
    one = replace(alone, provenance=words)
    findings = replace(look_closer(one, vehicle, log), folder=beside.figures.name)
    if lines := warned():
        one = replace(one, provenance={**words, "warnings": "\n".join(lines)})
    if findings.gallery.pictures:
        write_gallery(findings.gallery, beside.figures)
        note(f"written to {beside.figures}")
    if offer(one, beside.report, findings):
        note(f"written to {beside.report}")
