"""``hydrodamp report``: write the HTML report of existing results."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli.output import collected_warnings, emit, note
from hydrodamp.errors import FileError, MethodError
from hydrodamp.files import protected_inputs
from hydrodamp.results import (
    MANIFEST,
    check_new_file,
    check_results,
    complete_exchange,
    save_results,
)

if TYPE_CHECKING:
    from hydrodamp.report.files import ReportContent
    from hydrodamp.validation.workflow import Assessment


def report(folder: Path, out: Path | None = None, force: bool = False, json: bool = False) -> None:
    """Write the HTML report of a folder of results without fitting again."""
    from hydrodamp.report.documents import selection_document
    from hydrodamp.report.fidelity_report import CARD, PAGE, write_fidelity_page
    from hydrodamp.report.files import COMPARISON, REPORT, read_comparison, read_content

    document = {"format": "hydrodamp-report", "version": 1}
    complete_exchange(folder)
    is_export = (folder / CARD).is_file()
    if not is_export and not (folder / COMPARISON).is_file():
        problem = f"has no {COMPARISON}" if folder.is_dir() else "does not exist"
        raise FileError(
            f"{folder}: the folder {problem}; give one that `compare`, but with `--folds`, `demo` "
            "or `export` wrote."
        )
    default_path = folder / (PAGE if is_export else REPORT)
    replaceable = default_path, folder / MANIFEST
    with protected_inputs(path for path in folder.rglob("*") if path not in replaceable):
        page, verdict = out or default_path, None
        if out is None:
            check_results(folder, (page.name,), force=True)
        check_new_file(page, force)
        if is_export:
            write_fidelity_page(folder, page)
        else:
            comparison = read_comparison(folder)
            hd.write_report(comparison, page, read_content(folder, comparison))
            verdict = selection_document(comparison)
    note(f"written to {page}")
    if json:
        emit(document | {"verdict": verdict, "paths": {"report": str(page)}})


def render_report(comparison: hd.Comparison, path: Path, content: ReportContent) -> str | None:
    """Return the page of a comparison, or name the package that it lacks."""
    from hydrodamp.report.page import comparison_page

    try:
        return comparison_page(comparison, content)
    except MethodError as error:
        note(f"{path} is not written: {error}.")
        return None


def write_results(assessment: Assessment, problem: hd.Problem, home: Path) -> None:
    """Write a comparison with grades, pictures and report into its folder.

    An interrupt of the drawing writes the others, unless a finished comparison is in the folder.
    """
    from hydrodamp.report.files import REPORT, listed_fits, save_comparison

    comparison = assessment.comparison
    try:
        content = draw_diagnostics(assessment, problem)
        page = render_report(comparison, home / REPORT, content)
    except KeyboardInterrupt:
        if listed_fits(home) is None:
            save_comparison(comparison, home)
        raise
    save_comparison(comparison, home, content, page)
    note(f"written to {home}")
    if page is not None:
        note(f"written to {home / REPORT}")


def draw_diagnostics(assessment: Assessment, problem: hd.Problem) -> ReportContent:
    """Grade and draw the selected row; print the reason for each missing picture."""
    from hydrodamp.report.pictures import illustrate

    content = illustrate(assessment.comparison, problem, assessment.graded)
    for reason in content.not_shown:
        note(reason)
    return content


def report_paths(damping: Path) -> tuple[Path, Path]:
    """Return the folder of pictures and the report that belong to a damping file."""
    stem = str(damping).removesuffix(".json")
    return Path(f"{stem}.figures"), Path(f"{stem}.report.html")


def write_fit(
    assessment: Assessment, problem: hd.Problem, damping: Path, text: str, remarks: Iterable[str]
) -> None:
    """Write the damping file of a fit, and its report with remarks and pictures next to it."""
    from hydrodamp.report.files import PICTURES, picture_files

    figures, page = report_paths(damping)
    content = draw_diagnostics(assessment, problem)
    pictures = picture_files(content, figures) if content.pictures else {}
    comparison = assessment.comparison
    (row,) = comparison.rows
    tests = ["\n".join(content.residual_tests)] if content.residual_tests else []
    fit = replace(row.fit, remarks=(*row.fit.remarks, *remarks, *tests))
    words = comparison.provenance | collected_warnings()
    comparison = replace(comparison, rows=(replace(row, fit=fit),), provenance=words)
    report = render_report(comparison, page, content)
    named = {damping: text.encode("utf-8")}
    if report is not None:
        named[page] = report.encode("utf-8")
    elif page.exists():
        note(f"{page} stays as it is: it does not describe the new {damping}.")
    save_results(pictures, figures, PICTURES, named)
    for path in (damping, *((figures,) if pictures else ()), *list(named)[1:]):
        note(f"written to {path}")
