"""``hydrodamp report``: the report of a folder of results, without fitting again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import collected_warnings, note

if TYPE_CHECKING:
    from hydrodamp.report.files import Findings


def report(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A folder that compare, demo or export wrote."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file to write. [default: DIR/report.html]"),
    ] = None,
    force: options.Force = False,
) -> None:
    """Make the report of a folder of results again, without fitting again."""
    from hydrodamp.cli.provenance import check_out_file
    from hydrodamp.report.fidelity_page import CARD, PAGE, write_fidelity_page
    from hydrodamp.report.files import REPORT

    if (folder / CARD).is_file():
        check_out_file(out or folder / PAGE, (str(folder / CARD),), force)
        note(f"written to {write_fidelity_page(folder, out)}")
        return
    if not (folder / "comparison.json").is_file():
        lacks = (
            "there is no comparison.json in it" if folder.is_dir() else "there is no such folder"
        )
        raise hd.FileError(
            f"{folder}: {lacks}; name one that `compare`, `demo` or `export` wrote with `--out`."
        )
    default_path = folder / REPORT
    inputs = (str(path) for path in folder.rglob("*") if path != default_path)
    check_out_file(out or default_path, inputs, force)
    write_report_or_explain(folder, out or default_path)


def write_report_or_explain(
    results: hd.Comparison | Path, path: Path, findings: Findings | None = None
) -> None:
    """Write a report, or say how to get it where what it needs is not installed."""
    from hydrodamp.report.page import MISSING, installed

    if installed():
        hd.write_report(results, path, findings)
        note(f"written to {path}")
    else:
        note(f"{MISSING}, then run the command again; for a folder, `hydrodamp report DIR`.")


def write_diagnostics(
    comparison: hd.Comparison, vehicle: hd.Vehicle, train: hd.Log, home: Path
) -> None:
    """Write grades, pictures and the report of a comparison into its folder."""
    from hydrodamp.report.files import REPORT, write_findings

    findings = examine_chosen(comparison, vehicle, train)
    write_findings(findings, home)
    note(f"written to {home}")
    write_report_or_explain(comparison, home / REPORT, findings)


def examine_chosen(comparison: hd.Comparison, vehicle: hd.Vehicle, train: hd.Log) -> Findings:
    """Grade and draw the chosen row, and say which pictures there are not."""
    from hydrodamp.report.examine import examine

    findings = examine(comparison, vehicle, train)
    for sentence in findings.not_shown:
        note(sentence)
    return findings


def report_paths(damping: Path) -> tuple[Path, Path]:
    """Return the folder of pictures and the report that lie beside a damping file."""
    stem = str(damping).removesuffix(".json")
    return Path(f"{stem}.figures"), Path(f"{stem}.report.html")


def write_fit_report(
    fit: hd.Fit, vehicle: hd.Vehicle, log: hd.Log, said: Mapping[str, str], damping: Path
) -> None:
    """Write report and pictures of a fit beside its damping file."""
    from hydrodamp.report.files import write_pictures

    figures, page = report_paths(damping)
    alone = hd.compare((fit,), vehicle, log)
    origin = {**alone.provenance, "overlap": f"all {log.n} samples", **said}
    alone = replace(alone, provenance=origin)
    findings = examine_chosen(alone, vehicle, log)
    if findings.pictures:
        write_pictures(findings, figures, figures)
        note(f"written to {figures}")
    write_report_or_explain(
        replace(alone, provenance=origin | collected_warnings()), page, findings
    )
