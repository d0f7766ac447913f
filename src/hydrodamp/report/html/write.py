"""The report of a comparison, from its value or from the folder it was written to."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from hydrodamp.files import load_json, save_text
from hydrodamp.report.document import comparison_document
from hydrodamp.report.files import read_comparison
from hydrodamp.report.gallery.findings import Findings
from hydrodamp.report.gallery.folder import read_findings
from hydrodamp.report.html.page import page
from hydrodamp.validation.comparison import Comparison

REPORT = "report.html"
"""The file in a folder of results."""


def write_report(
    results: Comparison | str | os.PathLike[str],
    path: str | os.PathLike[str],
    findings: Findings | None = None,
) -> Path:
    """Write one HTML file that shows a comparison, without any network.

    Parameters
    ----------
    results : Comparison or path
        A comparison, or the folder it was written to. Nothing is fitted again.
    path : str or path
        The file; written whole or not at all.
    findings : Findings, optional
        Grades, band and pictures of the chosen row; by default those in the folder, if any.

    Returns
    -------
    path : Path
        The file.

    Raises
    ------
    FileError
        If the folder is none of a comparison, or the file cannot be written.
    MethodError
        If jinja2 is not installed.
    """
    if isinstance(results, Comparison):
        comparison, provenance = results, _provenance(comparison_document(results))
        found = findings or Findings()
    else:
        comparison = read_comparison(results)
        found = findings or read_findings(Path(results), comparison)
        provenance = _provenance(
            cast("dict[str, Any]", load_json(Path(results) / "comparison.json"))
        )
    save_text(page(comparison, provenance, found), path)
    return Path(path)


def _provenance(document: Mapping[str, Any]) -> dict[str, object]:
    return dict(document["provenance"])
