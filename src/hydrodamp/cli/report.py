"""``hydrodamp report``: write the HTML report of existing results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli.output import check_out_file, collected_warnings, emit, note

if TYPE_CHECKING:
    from hydrodamp.report.files import ReportContent


def report(folder: Path, out: Path | None = None, force: bool = False, json: bool = False) -> None:
    """Write the HTML report of a folder of results without fitting again."""
    from hydrodamp.report.documents import selection_document
    from hydrodamp.report.files import REPORT, read_comparison, read_content
    from hydrodamp.report.page import CARD, PAGE, write_fidelity_page

    document = {"format": "hydrodamp-report", "version": 1}
    if (folder / CARD).is_file():
        check_out_file(out or folder / PAGE, (str(folder / CARD),), force)
        page = write_fidelity_page(folder, out)
        note(f"written to {page}")
        if json:
            emit(document | {"verdict": None, "paths": {"report": str(page)}})
        return
    if not (folder / "comparison.json").is_file():
        problem = "has no comparison.json" if folder.is_dir() else "does not exist"
        raise hd.FileError(
            f"{folder}: the folder {problem}; give one that `compare`, `demo` or `export` wrote."
        )
    default_path = folder / REPORT
    inputs = (str(path) for path in folder.rglob("*") if path != default_path)
    check_out_file(out or default_path, inputs, force)
    comparison = read_comparison(folder)
    page = hd.write_report(comparison, out or default_path, read_content(folder, comparison))
    note(f"written to {page}")
    verdict = selection_document(comparison)
    if json:
        emit(document | {"verdict": verdict, "paths": {"report": str(page)}})


def write_report_or_explain(
    results: hd.Comparison, path: Path, content: ReportContent | None = None
) -> None:
    """Write a report, or name the package that it lacks."""
    try:
        note(f"written to {hd.write_report(results, path, content)}")
    except hd.MethodError as error:
        note(f"{path} is not written: {error}.")


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
    origin = {**comparison.provenance, **provenance}
    comparison = replace(comparison, provenance=origin)
    content = draw_diagnostics(comparison, vehicle, log)
    if content.pictures:
        write_pictures(content, figures, figures)
        note(f"written to {figures}")
    comparison = replace(comparison, provenance=origin | collected_warnings())
    write_report_or_explain(comparison, page, content)
