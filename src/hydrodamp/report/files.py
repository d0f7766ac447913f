"""Result folder of a comparison with its diagnostics and pictures, written and read."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import FileError
from hydrodamp.faults import validate
from hydrodamp.files import as_json, load_json
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.fit_files import fit_document, names_of, read_fit
from hydrodamp.identification.identifiability import AxisIdentifiability, Identifiability
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.report.comparison_tables import detail_tables, score_table, summary_tables
from hydrodamp.report.documents import ComparisonDocument, comparison_document
from hydrodamp.report.table import to_csv, to_latex, to_markdown
from hydrodamp.report.verdict_tables import verdict_table
from hydrodamp.results import complete_exchange, save_results
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.compare import Comparison, replayed_row
from hydrodamp.validation.diagnostics import find_selected_row
from hydrodamp.validation.workflow import RESUMED, UNFINISHED

COMPARISON, REPLAYS, REPORT = "comparison.json", "replays.npz", "report.html"
#: A cross-validation.
VALIDATION = "validation.json"
#: The selected fit.
DAMPING = "damping.json"
TABLES = tuple(f"table.{suffix}" for suffix in ("md", "tex", "csv"))
#: Grades, and the band of a replay.
GRADES, BAND = "identifiability.json", "band.npz"
#: Folder of pictures, and the file of their captions.
FIGURES, INDEX = "figures", "index.json"

#: File patterns of pictures in their folder.
PICTURES = ("*.svg", INDEX)
_FITS, _PICTURES = "fits/*.json", tuple(f"{FIGURES}/{name}" for name in PICTURES)
#: File patterns of all results of a comparison or a cross-validation, relative to its folder.
RESULTS = (
    COMPARISON,
    VALIDATION,
    DAMPING,
    REPLAYS,
    REPORT,
    GRADES,
    BAND,
    *TABLES,
    _FITS,
    *_PICTURES,
)

_SIMULATED = "simulated."
#: Channels of a replayed log that the page shows.
_CHANNELS = ("commands", "wrench", "propulsion_ratio", "position")


@dataclass(frozen=True)
class Picture:
    """A picture file with its caption and size [px]."""

    name: Annotated[str, Field(pattern="^[a-z0-9-]+$")]
    caption: str
    width: int
    height: int
    svg: Annotated[bytes, Field(exclude=True)] = b""


@dataclass(frozen=True)
class ReportContent:
    """Diagnostics of the selected row, and pictures; `not_shown` has reasons for missing ones."""

    identifiability: Identifiability | None = None
    band: PredictionBand | None = None
    pictures: tuple[Picture, ...] = ()
    not_shown: tuple[str, ...] = ()
    residual_tests: tuple[str, ...] = ()


class _Grades(BaseModel):
    """Content of the file of grades."""

    model_config = ConfigDict(ser_json_inf_nan="strings")

    model: str
    axes: tuple[AxisIdentifiability, ...]


class _Index(BaseModel):
    """Content of the file of captions."""

    pictures: tuple[Picture, ...]
    not_shown: tuple[str, ...] = ()


def write_comparison(comparison: Comparison, folder: str | os.PathLike[str]) -> None:
    """Write a comparison to a folder, which is created if necessary.

    Parameters
    ----------
    comparison : Comparison
        What to write.
    folder : str or path
        All files are written, or none. Report, grades and pictures of an earlier comparison in
        the folder are removed, and its other fits too where this one is whole and was made in
        one go; files that hydrodamp did not write, or that were changed since, stay.

    Raises
    ------
    FileError
        If the folder cannot be made or written, or a file would replace one that hydrodamp did
        not write.
    """
    save_comparison(comparison, Path(folder))


def save_comparison(
    comparison: Comparison,
    home: Path,
    content: ReportContent | None = None,
    page: str | None = None,
) -> None:
    """Write a comparison with its diagnostics and report in one exchange of all files."""
    contents = comparison_files(comparison, home)
    if content is not None:
        contents |= content_files(content, home)
    if page is not None:
        contents[home / REPORT] = page.encode("utf-8")
    keeps_fits = not comparison.provenance.keys().isdisjoint((RESUMED, UNFINISHED))
    save_results(contents, home, [each for each in RESULTS if each != _FITS or not keeps_fits])


def comparison_files(comparison: Comparison, home: Path) -> dict[Path, bytes]:
    """Return the files of a comparison without diagnostics."""
    tables = (*summary_tables(comparison), *detail_tables(comparison))
    fits = {home / "fits" / f"{name}.json": fit for name, fit in _named_fits(comparison).items()}
    if any(row.blocks is not None for row in comparison.rows):
        tables = (verdict_table(comparison.verdict()), *tables)
    texts = {
        **{path: as_json(fit_document(fit)) for path, fit in fits.items()},
        home / "table.md": "\n\n".join(map(to_markdown, tables)) + "\n",
        home / "table.tex": "\n\n".join(map(to_latex, summary_tables(comparison))) + "\n",
        home / "table.csv": to_csv(score_table(comparison, comparison.rows)),
    }
    if (selected := find_selected_row(comparison)) is not None:
        texts[home / DAMPING] = as_json(fit_document(selected.fit))
    texts[home / COMPARISON] = as_json(comparison_document(comparison))
    contents = {path: text.encode("utf-8") for path, text in texts.items()}
    return {home / REPLAYS: _replays(comparison), **contents}


def save_validation(document: Mapping[str, Any], folder: Path) -> None:
    """Write a cross-validation into a folder in place of earlier results."""
    save_results({folder / VALIDATION: as_json(document).encode("utf-8")}, folder, RESULTS)


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
    complete_exchange(home)
    path = home / COMPARISON
    document = validate(ComparisonDocument, load_json(path), str(path))
    settings, texts = document.provenance, dict(document.provenance.model_extra or {})
    log, velocities = _read_replays(home / REPLAYS, texts.get("test", ""))
    rows = []
    for entry in document.rows:
        fit, run = read_fit(home / "fits" / f"{entry.fit}.json"), None
        score = entry.score(settings.rate_unit)
        if log is not None and entry.fit in velocities:
            axes = tuple(axis for axis in AXES if VELOCITY_OF[axis] in score.rms_by_axis)
            velocity = velocities[entry.fit]
            run = Trajectory(log, velocity, score.diverged, settings.attitude, axes)
        windows = entry.windows.score(settings.rate_unit) if entry.windows else None
        rows.append(replayed_row(fit, score, run, windows))
    return Comparison(tuple(rows), settings.rate_unit, settings.attitude, texts)


def listed_fits(folder: Path) -> set[str] | None:
    """Return the names of the fits of a finished comparison in a folder, or None."""
    complete_exchange(folder)
    path = folder / COMPARISON
    if not path.is_file():
        return None
    document = validate(ComparisonDocument, load_json(path), str(path))
    is_unfinished = UNFINISHED in (document.provenance.model_extra or {})
    return None if is_unfinished else {entry.fit for entry in document.rows}


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
        channels = {field: getattr(log, field) for field in _CHANNELS}
        arrays |= {field: values for field, values in channels.items() if values is not None}
        arrays["command_names"] = np.array(log.command_names, dtype=str)
    return _npz(arrays)


def _read_replays(path: Path, source: str) -> tuple[Log | None, dict[str, np.ndarray]]:
    """Return the log that was replayed, and the simulated velocities by name."""
    arrays = _read_npz(path)
    if "time" not in arrays:
        return None, {}
    bounds_by_name = zip(arrays["segment_names"], arrays["segment_bounds"].tolist(), strict=True)
    segments = tuple(Segment(str(name), *bounds) for name, bounds in bounds_by_name)
    channels: dict[str, Any] = {name: arrays[name] for name in _CHANNELS if name in arrays}
    names = tuple(map(str, arrays.get("command_names", ())))
    log = Log(
        arrays["time"],
        arrays["measured"],
        segments=segments,
        source=source,
        command_names=names,
        **channels,
    )
    return log, {
        name.removeprefix(_SIMULATED): values
        for name, values in arrays.items()
        if name.startswith(_SIMULATED)
    }


def content_files(content: ReportContent, home: Path) -> dict[Path, bytes]:
    """Return the files of grades, band and pictures in the folder of a comparison."""
    contents = picture_files(content, home / FIGURES)
    if (identifiability := content.identifiability) is not None:
        grades = _Grades(model=identifiability.model.key, axes=identifiability.axes)
        contents[home / GRADES] = grades.model_dump_json(indent=2).encode("utf-8")
    if (band := content.band) is not None:
        ends = {"lower": band.lower, "upper": band.upper, "level": np.array(band.level)}
        contents[home / BAND] = _npz(ends)
    return contents


def picture_files(content: ReportContent, folder: Path) -> dict[Path, bytes]:
    """Return the files of pictures and captions in a folder."""
    index = _Index(pictures=content.pictures, not_shown=content.not_shown)
    contents = {folder / f"{picture.name}.svg": picture.svg for picture in content.pictures}
    return {folder / INDEX: index.model_dump_json(indent=2).encode("utf-8"), **contents}


def read_content(home: Path, comparison: Comparison) -> ReportContent:
    """Read what :func:`content_files` returned; report deleted pictures as missing."""
    row, grades, band = find_selected_row(comparison), None, None
    pictures: list[Picture] = []
    not_shown: list[str] = []
    if (path := home / FIGURES / INDEX).is_file():
        index = validate(_Index, load_json(path), str(path))
        not_shown += index.not_shown
        for picture in index.pictures:
            path = home / FIGURES / f"{picture.name}.svg"
            if path.is_file():
                pictures.append(replace(picture, svg=path.read_bytes()))
            else:
                not_shown.append(f"{path.name} was deleted.")
    if row is not None and (home / GRADES).is_file():
        graded = validate(_Grades, load_json(home / GRADES), str(home / GRADES))
        grades = Identifiability(row.fit.model, graded.axes)
    if row is not None and row.trajectory is not None and (home / BAND).is_file():
        run, ends = row.trajectory, _read_npz(home / BAND)
        level = float(ends["level"])
        band = PredictionBand(run.log, run.velocity, ends["lower"], ends["upper"], level)
    return ReportContent(grades, band, tuple(pictures), tuple(not_shown))


def _npz(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return arrays as the bytes of an npz file."""
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _read_npz(path: Path) -> dict[str, np.ndarray]:
    try:
        # From memory: a damaged archive opened by name is not closed.
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except (OSError, EOFError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: cannot be read: {error}.") from error
