"""The folder of a comparison, both ways."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hydrodamp.errors import FileError
from hydrodamp.files import as_json, load_text, save_all
from hydrodamp.identification.fit import Fit
from hydrodamp.report.comparison_grids import comparison_grids, row_grid, summary_grids
from hydrodamp.report.document import comparison_document, fit_document
from hydrodamp.report.fit_names import fit_names, fit_path
from hydrodamp.report.gallery.band_file import BAND
from hydrodamp.report.gallery.findings import FIGURES
from hydrodamp.report.gallery.folder import GRADES, earlier_findings
from hydrodamp.report.reading import read_rows
from hydrodamp.report.renderings import to_csv, to_latex, to_markdown, to_text
from hydrodamp.report.unfinished import read_earlier, with_waiting
from hydrodamp.validation.comparison import Comparison

RESULTS = (
    "comparison.json",
    "replays.npz",
    "report.html",
    GRADES,
    BAND,
    *(f"table.{kind}" for kind in ("txt", "md", "tex", "csv")),
)
"""Files of a comparison's folder, besides those of ``fits`` and ``figures``."""

WRITTEN = "comparison.json, table.txt .md .tex .csv, fits, replays.npz"
"""What :func:`write_comparison` writes, in words."""


def write_comparison(
    comparison: Comparison, folder: str | os.PathLike[str], waiting: Iterable[Fit] = ()
) -> None:
    """Write a comparison to a folder, which is made if it is not there.

    Parameters
    ----------
    comparison : Comparison
        What to write.
    folder : str or path
        All files are written or none, whatever interrupts. Fits, grades, pictures and
        report of an earlier comparison in the same folder are removed.
    waiting : iterable of Fit, optional
        Fits of an unfinished run that were not replayed. They lie beside the others, and
        ``not_replayed`` in the provenance names them.

    Raises
    ------
    FileError
        If the folder cannot be made or written.
    """
    home, (told, beside) = Path(folder), _with_waiting(comparison, waiting)
    fits = dict(zip(row_names(told), (row.fit for row in told.rows), strict=True)) | beside
    texts = {
        **{f"fits/{name}.json": as_json(fit_document(fit)) for name, fit in fits.items()},
        **{f"table.{suffix}": text for suffix, text in _tables(told).items()},
        "comparison.json": as_json(comparison_document(told)),
    }
    contents = {home / "replays.npz": _replays(told)}
    contents |= {home / name: text.encode("utf-8") for name, text in texts.items()}
    for path in (home / "comparison.json", *_earlier(home)):
        if path.is_file():
            path.unlink()
    save_all(contents)


def is_written(
    comparison: Comparison, folder: str | os.PathLike[str], waiting: Iterable[Fit] = ()
) -> bool:
    """Tell whether a folder holds this very comparison."""
    told, _ = _with_waiting(comparison, waiting)
    try:
        text = load_text(Path(folder) / "comparison.json")
    except FileError:
        return False
    return text == as_json(comparison_document(told))


def _with_waiting(
    comparison: Comparison, waiting: Iterable[Fit]
) -> tuple[Comparison, dict[str, Fit]]:
    """Return a comparison that names the fits without a row, and those by name."""
    fits = tuple(waiting)
    names = fit_names((fit.model.key, fit.method) for fit in fits)
    return with_waiting(comparison, names), dict(zip(names, fits, strict=True))


def read_comparison(folder: str | os.PathLike[str]) -> Comparison:
    """Read a comparison that :func:`write_comparison` wrote.

    Parameters
    ----------
    folder : str or path
        With ``comparison.json``, ``fits`` and ``replays.npz``.

    Returns
    -------
    comparison : Comparison
        The same numbers; of the test log its clock, segments and velocities.

    Raises
    ------
    FileError
        If a file is missing or is not what it should be.
    ModelError
        If a file of ``fits`` has faults.
    """
    return read_rows(Path(folder))


def is_result(path: Path, folder: Path) -> bool:
    """Tell whether a comparison written to a folder may replace a file."""
    if path.parent == folder / "fits":
        return path.suffix == ".json"
    if path.parent == folder / FIGURES:
        return path.suffix in (".json", ".svg")
    return path.parent == folder and path.name in RESULTS


def row_names(comparison: Comparison) -> tuple[str, ...]:
    """Return the name that each row has in files, all different."""
    return fit_names((row.model, row.method) for row in comparison.rows)


def _earlier(home: Path) -> list[Path]:
    """Return report, grades and pictures of an earlier comparison, and the fits it names."""
    try:
        fits = [fit_path(home, name) for name in read_earlier(home).names]
    except FileError:
        return earlier_findings(home)
    return [*fits, home / "report.html", *earlier_findings(home)]


def _tables(comparison: Comparison) -> dict[str, str]:
    grids = comparison_grids(comparison)
    return {
        "txt": "\n\n".join(map(to_text, grids)) + "\n",
        "md": "\n\n".join(map(to_markdown, grids)) + "\n",
        "tex": "\n\n".join(map(to_latex, summary_grids(comparison))) + "\n",
        "csv": to_csv(row_grid(comparison)),
    }


def _replays(comparison: Comparison) -> bytes:
    """Return measured and simulated velocities as the bytes of an npz file."""
    arrays: dict[str, np.ndarray] = {}
    for name, row in zip(row_names(comparison), comparison.rows, strict=True):
        if row.trajectory is None:
            continue
        log = row.trajectory.log
        if not arrays:
            arrays = {
                "time": log.time,
                "measured": log.velocity,
                "segment_names": np.array([segment.name for segment in log.segments]),
                "segment_bounds": log.bounds,
            }
        arrays[f"simulated.{name}"] = row.trajectory.velocity
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()
