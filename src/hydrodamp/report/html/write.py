"""The report of a comparison, from its value or from the folder it was written to."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from hydrodamp.loading import load_json
from hydrodamp.report.document import comparison_document
from hydrodamp.report.files import read_comparison
from hydrodamp.report.html.page import page
from hydrodamp.saving import save_text
from hydrodamp.validation.comparison import Comparison

REPORT = "report.html"
"""The file in a folder of results."""


def write_report(
    results: Comparison | str | os.PathLike[str], path: str | os.PathLike[str]
) -> Path:
    """Write one HTML file that shows a comparison, without any network.

    Parameters
    ----------
    results : Comparison or path
        A comparison, or the folder it was written to. Nothing is fitted again.
    path : str or path
        The file; written whole or not at all.

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
    else:
        comparison = read_comparison(results)
        provenance = _provenance(
            cast("dict[str, Any]", load_json(Path(results) / "comparison.json"))
        )
    save_text(page(comparison, provenance), path)
    return Path(path)


def _provenance(document: Mapping[str, Any]) -> dict[str, object]:
    return dict(document["provenance"])
