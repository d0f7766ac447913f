"""``hydrodamp report``: write the HTML report of existing results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import hydrodamp as hd
from hydrodamp.cli import options
from hydrodamp.cli.output import collected_warnings, note

if TYPE_CHECKING:
    from hydrodamp.report.files import ReportContent


def report(
    folder: Annotated[Path, options.argument("report-folder")],
    out: Annotated[Path | None, options.option("report-out")] = None,
    force: options.Force = False,
) -> None:
    """Write the HTML report of a folder of results without fitting again."""
    from hydrodamp.cli.provenance import check_out_file
    from hydrodamp.report.files import REPORT
    from hydrodamp.report.page import CARD, PAGE, write_fidelity_page

    if (folder / CARD).is_file():
        check_out_file(out or folder / PAGE, (str(folder / CARD),), force)
        note(f"written to {write_fidelity_page(folder, out)}")
        return
    if not (folder / "comparison.json").is_file():
        problem = "has no comparison.json" if folder.is_dir() else "does not exist"
        raise hd.FileError(
            f"{folder}: the folder {problem}; give one that `compare`, `demo` or `export` wrote."
        )
    default_path = folder / REPORT
    inputs = (str(path) for path in folder.rglob("*") if path != default_path)
    check_out_file(out or default_path, inputs, force)
    note(f"written to {hd.write_report(folder, out or default_path)}")


def write_report_or_explain(
    results: hd.Comparison, path: Path, content: ReportContent | None = None
) -> None:
    """Write a report, or name the package that it lacks."""
    from hydrodamp.report.page import NEEDS_JINJA, installed

    if installed():
        hd.write_report(results, path, content)
        note(f"written to {path}")
    else:
        note(f"{path} is not written: {NEEDS_JINJA}.")


def write_diagnostics(
    comparison: hd.Comparison, vehicle: hd.Vehicle, train: hd.Log, home: Path
) -> None:
    """Write grades, pictures and the report of a comparison into its folder."""
    from hydrodamp.report.files import REPORT, write_content

    content = draw_diagnostics(comparison, vehicle, train)
    write_content(content, home)
    note(f"written to {home}")
    write_report_or_explain(comparison, home / REPORT, content)


def draw_diagnostics(
    comparison: hd.Comparison, vehicle: hd.Vehicle, train: hd.Log
) -> ReportContent:
    """Grade and draw the selected row; print the reason for each missing picture."""
    from hydrodamp.report.pictures import illustrate

    content = illustrate(comparison, vehicle, train)
    for reason in content.not_shown:
        note(reason)
    return content


def report_paths(damping: Path) -> tuple[Path, Path]:
    """Return the folder of pictures and the report that belong to a damping file."""
    stem = str(damping).removesuffix(".json")
    return Path(f"{stem}.figures"), Path(f"{stem}.report.html")


def write_fit_report(
    fit: hd.Fit, vehicle: hd.Vehicle, log: hd.Log, provenance: Mapping[str, str], damping: Path
) -> None:
    """Write the report and the pictures of a fit next to its damping file."""
    from hydrodamp.report.files import write_pictures

    figures, page = report_paths(damping)
    comparison = hd.compare((fit,), vehicle, log)
    origin = {**comparison.provenance, "overlap": f"all {log.n} samples", **provenance}
    comparison = replace(comparison, provenance=origin)
    content = draw_diagnostics(comparison, vehicle, log)
    if content.pictures:
        write_pictures(content, figures, figures)
        note(f"written to {figures}")
    comparison = replace(comparison, provenance=origin | collected_warnings())
    write_report_or_explain(comparison, page, content)
