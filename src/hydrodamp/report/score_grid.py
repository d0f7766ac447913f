"""One score as a table: error and fit of each velocity."""

from __future__ import annotations

from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import error_size, percent
from hydrodamp.simulation.score import Score


def score_grid(title: str, score: Score) -> Grid:
    """Return a score as a table."""
    unit = score.rate_unit
    rows = [
        (
            name,
            error_size(rmse),
            "m/s" if name in "uvw" else f"{unit}/s",
            percent(score.fit_by_axis.get(name)),
        )
        for name, rmse in score.rms_by_axis.items()
    ]
    rows.append(("all", error_size(score.rms), f"m/s, {unit}/s", ""))
    return Grid(
        title=title,
        header=("velocity", "RMS error", "unit", "fit %"),
        rows=tuple(rows),
        align="lrlr",
        notes=(score.status.value,) if score.diverged else (),
    )
