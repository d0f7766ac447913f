"""Measured and replayed velocities as the plots of a page take them: thinned and packed."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.report.examine import said_of_band
from hydrodamp.report.figures.axes import Bins, clock, shown, velocity_unit
from hydrodamp.report.figures.look import colour_of, looks_of
from hydrodamp.report.files import chosen_row
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.compare import Comparison, Row

_MOST = 32  # replays drawn; those with the lowest errors where there are more
_VALUES, _FINEST = 750_000, 20_000  # of all series together (2 MB as text), and points of one
_STEPS, _NOTHING = 65_000, 65_535  # of a packed value
_WIDTH = 1.5  # of a line [px]


def series(
    comparison: Comparison, rows: Sequence[Row], band: PredictionBand | None = None
) -> dict[str, Any] | None:
    """Return the data of the plots and what is said of them, rows in order of preference."""
    runs = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not runs:
        return None
    drawn, log, chosen = runs[:_MOST], runs[0][1].log, chosen_row(comparison)
    names, unit = tuple(runs[0][0].score.rms_by_axis), comparison.rate_unit
    n_series = len(names) * (1 + len(drawn) + 2 * (band is not None))
    bins, time = Bins.over(log.bounds, min(_VALUES // n_series, _FINEST)), clock(log)

    def packed(velocity: FloatArray) -> list[dict[str, object]]:
        return [_pack(bins.values(shown(velocity, name, unit))) for name in names]

    looks = looks_of([(row.model, row.method) for row, _ in drawn])
    around, said, edges = None, "", []
    if band is not None and chosen is not None:
        around = {
            "name": f"{100.0 * band.level:.0f} % band of {chosen.model} by {chosen.method}",
            "method": chosen.method,
            "colour": colour_of(chosen.method),
        }
        said = said_of_band(chosen)
        edges = [packed(band.lower), packed(band.upper)]
    document = {
        "velocities": [{"name": name, "unit": velocity_unit(name, unit)} for name in names],
        "segments": [
            {"name": part.name, "start": time[part.start], "stop": time[part.stop - 1]}
            for part in log.segments
        ],
        "replays": [
            {
                "name": f"{row.model} by {row.method}",
                "method": row.method,
                "colour": look.colour,
                "dashes": [round(_WIDTH * length, 1) for length in look.dashes],
            }
            for (row, _), look in zip(drawn, looks, strict=True)
        ],
        "band": around,
        "time": _base64(bins.times(time).astype("<f8")),
        "series": [packed(log.velocity), *(packed(run.velocity) for _, run in drawn)],
        "edges": edges,
    }
    return {
        "document": document,
        "said_of_band": said,
        "left_out": len(runs) - len(drawn),
        "is_thinned": not bins.is_exact,
    }


def _pack(values: FloatArray) -> dict[str, object]:
    """Return a series as integers in steps of its own range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / _STEPS or 1.0
    counts = np.where(np.isfinite(values), np.rint((values - low) / step), _NOTHING)
    return {"low": low, "step": step, "steps": _base64(counts.astype("<u2"))}


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
