"""Measured and replayed velocities as the plots of a page take them: thinned and packed."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.report.captions import said_of_band
from hydrodamp.report.figures.axes import Bins
from hydrodamp.report.figures.look import colour_of, looks_of
from hydrodamp.report.findings import chosen_row, models_of
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.compare import Comparison, Row

_MOST = 32  # replays drawn; those with the lowest errors where there are more
_BYTES = 2_000_000  # that all series may take
_PACKED = 8 / 3  # characters of a value: two bytes in base 64
_FEWEST, _FINEST = 1000, 20_000  # points of a series
_STEPS, _NOTHING = 65_000, 65_535  # of a packed value
_WIDTH = 1.5  # of a line [px]
_ROOM = 0.01  # between segments, as a share of the recorded time


@dataclass(frozen=True)
class Line:
    """A replay, or the band around one, as it is drawn."""

    name: str
    method: str
    colour: str
    dashes: tuple[float, ...] = ()


@dataclass(frozen=True)
class Series:
    """The data of the plots and the words around them."""

    document: dict[str, object]
    lines: tuple[Line, ...]
    band: Line | None
    said_of_band: str
    left_out: int
    is_thinned: bool


def series(
    comparison: Comparison, rows: Sequence[Row], band: PredictionBand | None = None
) -> Series | None:
    """Return the time series of a comparison, its rows in order of preference."""
    runs = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not runs:
        return None
    shown, log, chosen = runs[:_MOST], runs[0][1].log, chosen_row(comparison)
    known = {name for row, _ in shown for name in row.score.rms_by_axis}
    names = tuple(name for name in VELOCITIES if name in known)
    turn = np.degrees(1.0) if comparison.rate_unit == "deg" else 1.0
    n_series = len(names) * (1 + len(shown) + 2 * (band is not None))
    points = min(max(int(_BYTES / _PACKED / n_series), _FEWEST), _FINEST)
    bins = Bins.over(log.bounds, points)
    places = [VELOCITIES.index(name) for name in names]
    scale = np.array([1.0] * 3 + [turn] * 3)[places]

    def packed(velocity: FloatArray) -> list[dict[str, object]]:
        return [_pack(bins.values(column)) for column in (velocity[:, places] * scale).T]

    time, lines = _staged_time(log), _lines(comparison, [row for row, _ in shown])
    around, said, edges = None, "", []
    if band is not None and chosen is not None:
        name = f"{100.0 * band.level:.0f} % band of {chosen.model} by {chosen.method}"
        around = Line(name, chosen.method, colour_of(chosen.method))
        said = said_of_band(f"{chosen.model} by {chosen.method}")
        edges = [packed(band.lower), packed(band.upper)]
    unit = f"{comparison.rate_unit}/s"
    document: dict[str, object] = {
        "velocities": [{"name": k, "unit": "m/s" if k in VELOCITIES[:3] else unit} for k in names],
        "segments": [
            {"name": part.name, "start": time[part.start], "stop": time[part.stop - 1]}
            for part in log.segments
        ],
        "replays": [asdict(line) for line in lines],
        "band": None if around is None else asdict(around),
        "time": _base64(bins.times(time).astype("<f8")),
        "series": [packed(log.velocity), *(packed(run.velocity) for _, run in shown)],
        "edges": edges,
    }
    return Series(document, lines, around, said, len(runs) - len(shown), not bins.is_exact)


def _lines(comparison: Comparison, rows: Sequence[Row]) -> tuple[Line, ...]:
    """Return how replays are drawn, in the looks that the pictures of the run have too."""
    models = models_of(comparison, chosen_row(comparison))
    looks = looks_of([(row.model, row.method) for row in rows], models)
    return tuple(
        Line(
            f"{row.model} by {row.method}",
            row.method,
            look.colour,
            tuple(round(_WIDTH * length, 1) for length in look.dashes),
        )
        for row, look in zip(rows, looks, strict=True)
    )


def _staged_time(log: Log) -> FloatArray:
    """Return a time at which segments stand one after another, since a clock may restart."""
    spans = np.array([log.time[s.stop - 1] - log.time[s.start] for s in log.segments])
    origins = np.cumsum(spans + max(_ROOM * spans.sum(), 1e-3)) - spans
    time = np.empty(log.n)
    for part, origin in zip(log.segments, origins - origins[0], strict=True):
        rows = slice(part.start, part.stop)
        time[rows] = origin + log.time[rows] - log.time[part.start]
    return time


def _pack(values: FloatArray) -> dict[str, object]:
    """Return a series as integers in steps of its own range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / _STEPS or 1.0
    counts = np.where(np.isfinite(values), np.rint((values - low) / step), _NOTHING)
    return {"low": low, "step": step, "steps": _base64(counts.astype("<u2"))}


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
