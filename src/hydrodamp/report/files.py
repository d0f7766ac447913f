"""The folder of a comparison, both ways."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np

from hydrodamp.files import as_json, save_all
from hydrodamp.identification.fit import Fit
from hydrodamp.report.comparison_grids import comparison_grids, row_grid, summary_grids
from hydrodamp.report.document import comparison_document, fit_document
from hydrodamp.report.fit_names import fit_names, fit_path
from hydrodamp.report.gallery.findings import FIGURES
from hydrodamp.report.gallery.folder import BAND, GRADES, earlier_findings
from hydrodamp.report.reading import read_fit, read_rows
from hydrodamp.report.remarks import UNFINISHED
from hydrodamp.report.renderings import to_csv, to_latex, to_markdown, to_text
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


def write_comparison(comparison: Comparison, folder: str | os.PathLike[str]) -> None:
    """Write a comparison to a folder, which is made if it is not there.

    Parameters
    ----------
    comparison : Comparison
        What to write.
    folder : str or path
        Each file is written whole or not at all, ``comparison.json`` last. Report, grades,
        pictures and other fits of an earlier comparison in the folder are removed.

    Raises
    ------
    FileError
        If the folder cannot be made or written.
    """
    home = Path(folder)
    fits = {fit_path(home, name): fit for name, fit in _named_fits(comparison).items()}
    there = () if UNFINISHED in comparison.provenance else (home / "fits").glob("*.json")
    earlier = (path for path in there if path not in fits)
    for path in (home / "comparison.json", home / "report.html", *earlier_findings(home), *earlier):
        if path.is_file():
            path.unlink()
    texts = {
        **{path: as_json(fit_document(fit)) for path, fit in fits.items()},
        **{home / f"table.{suffix}": text for suffix, text in _tables(comparison).items()},
        home / "comparison.json": as_json(comparison_document(comparison)),
    }
    contents = {home / "replays.npz": _replays(comparison)}
    save_all(contents | {path: text.encode("utf-8") for path, text in texts.items()})


def write_fit(fit: Fit, folder: Path) -> None:
    """Write one fit into a folder of results, as soon as it is finished."""
    (name,) = fit_names((fit,))
    save_all({fit_path(folder, name): as_json(fit_document(fit)).encode("utf-8")})


def kept_fits(folder: Path) -> dict[str, Fit]:
    """Return the fits that lie in a folder of results, by their digests."""
    found = map(read_fit, sorted((folder / "fits").glob("*.json")))
    return {fit.provenance["digest"]: fit for fit in found if "digest" in fit.provenance}


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


def _named_fits(comparison: Comparison) -> dict[str, Fit]:
    fits = [row.fit for row in comparison.rows]
    return dict(zip(fit_names(fits), fits, strict=True))


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
    for name, row in zip(_named_fits(comparison), comparison.rows, strict=True):
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
