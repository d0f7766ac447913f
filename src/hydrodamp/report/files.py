"""The folder of a comparison, both ways."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path
from typing import cast

import numpy as np

from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import FileError
from hydrodamp.files import as_json, load_json, save_all
from hydrodamp.identification.fit import Fit
from hydrodamp.report.comparison_tables import comparison_grids, score_grid, summary_grids
from hydrodamp.report.documents import (
    ComparisonDocument,
    comparison_document,
    fit_document,
    names_of,
    read_fit,
    validated,
)
from hydrodamp.report.findings import BAND, FIGURES, GRADES, earlier_findings
from hydrodamp.report.grid import to_csv, to_latex, to_markdown, to_text
from hydrodamp.report.words import UNFINISHED
from hydrodamp.simulation.replay import AttitudeSource, Trajectory
from hydrodamp.simulation.score import RateUnit, Score
from hydrodamp.validation.compare import Comparison, Row

COMPARISON, REPLAYS, REPORT = "comparison.json", "replays.npz", "report.html"
TABLES = tuple(f"table.{suffix}" for suffix in ("txt", "md", "tex", "csv"))

#: What :func:`write_comparison` writes, in words.
WRITTEN = "comparison.json, table.txt .md .tex .csv, fits, replays.npz"

_SIMULATED = "simulated."


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
    home, grids = Path(folder), comparison_grids(comparison)
    fits = {_fit_path(home, name): fit for name, fit in _named_fits(comparison).items()}
    there = () if UNFINISHED in comparison.provenance else (home / "fits").glob("*.json")
    earlier = (path for path in there if path not in fits)
    for path in (home / COMPARISON, home / REPORT, *earlier_findings(home), *earlier):
        if path.is_file():
            path.unlink()
    texts = {
        **{path: as_json(fit_document(fit)) for path, fit in fits.items()},
        home / "table.txt": "\n\n".join(map(to_text, grids)) + "\n",
        home / "table.md": "\n\n".join(map(to_markdown, grids)) + "\n",
        home / "table.tex": "\n\n".join(map(to_latex, summary_grids(comparison))) + "\n",
        home / "table.csv": to_csv(score_grid(comparison, comparison.rows)),
        home / COMPARISON: as_json(comparison_document(comparison)),
    }
    contents = {home / REPLAYS: _replays(comparison)}
    save_all(contents | {path: text.encode("utf-8") for path, text in texts.items()})


def write_fit(fit: Fit, folder: Path) -> None:
    """Write one fit into a folder of results, as soon as it is finished."""
    (name,) = names_of((fit,))
    save_all({_fit_path(folder, name): as_json(fit_document(fit)).encode("utf-8")})


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
    home = Path(folder)
    path = home / COMPARISON
    document = validated(ComparisonDocument, load_json(path), str(path))
    words = dict(document.provenance)
    unit = cast("RateUnit", words.pop("rate_unit"))
    attitude = cast("AttitudeSource", words.pop("attitude"))
    log, velocities = _read_replays(home / REPLAYS, words.get("test", ""))
    rows = []
    for entry in document.rows:
        fit, run = read_fit(_fit_path(home, entry.fit)), None
        diverged = tuple((place.segment, place.time) for place in entry.diverged_at or ())
        score = Score(entry.rms, entry.rms_by_axis, entry.fit_by_axis, unit, diverged)
        if log is not None and entry.fit in velocities:
            axes = tuple(axis for axis in AXES if VELOCITY_OF[axis] in score.rms_by_axis)
            run = Trajectory(log, velocities[entry.fit], diverged, attitude, axes)
        rows.append(Row(fit, score, run))
    return Comparison(tuple(rows), unit, attitude, words)


def _fit_path(home: Path, name: str) -> Path:
    if Path(name).name != name or set(name) & {"\\", "\0"}:  # whatever the system
        raise FileError(
            f"{home / COMPARISON}: each fit must be named by a plain file name, got '{name}': "
            "make the folder again by the command that wrote it."
        )
    return home / "fits" / f"{name}.json"


def is_result(path: Path, folder: Path) -> bool:
    """Tell whether a comparison written to a folder may replace a file."""
    if path.parent == folder / "fits":
        return path.suffix == ".json"
    if path.parent == folder / FIGURES:
        return path.suffix in (".json", ".svg")
    names = (COMPARISON, REPLAYS, REPORT, GRADES, BAND, *TABLES)
    return path.parent == folder and path.name in names


def _named_fits(comparison: Comparison) -> dict[str, Fit]:
    fits = [row.fit for row in comparison.rows]
    return dict(zip(names_of(fits), fits, strict=True))


def _replays(comparison: Comparison) -> bytes:
    """Return measured and simulated velocities as the bytes of an npz file."""
    arrays: dict[str, np.ndarray] = {}
    for name, row in zip(_named_fits(comparison), comparison.rows, strict=True):
        if row.trajectory is None:
            continue
        log = row.trajectory.log
        arrays |= {
            "time": log.time,
            "measured": log.velocity,
            "segment_names": np.array([segment.name for segment in log.segments]),
            "segment_bounds": log.bounds,
            f"{_SIMULATED}{name}": row.trajectory.velocity,
        }
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _read_replays(path: Path, source: str) -> tuple[Log | None, dict[str, np.ndarray]]:
    """Return the log that was replayed, and the simulated velocities by name."""
    try:
        # From memory: a damaged archive that is opened by its name stays open.
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in arrays.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: cannot be read: {error}.") from error
    if "time" not in found:
        return None, {}
    segments = tuple(
        Segment(str(name), int(start), int(stop))
        for name, (start, stop) in zip(found["segment_names"], found["segment_bounds"], strict=True)
    )
    log = Log(found["time"], found["measured"], segments=segments, source=source)
    return log, {
        name.removeprefix(_SIMULATED): values
        for name, values in found.items()
        if name.startswith(_SIMULATED)
    }
