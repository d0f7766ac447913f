"""Roles in a table without names: position, velocity, heading and yaw rate of a level vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.units import factor
from hydrodamp.ingest.probing.motion import changes, straightened
from hydrodamp.ingest.probing.series import Series, together

Told = dict[str, tuple[str, int, str | None, str]]
"""For every column its role, confidence [%], unit and evidence."""

_PAIR = 0.97  # correlation, above which one is the integral of the other
_MOST = 40  # columns
_ONE = (0.8, 1.25)  # a ratio that is one, but for noise
_FOLLOWS = 0.8  # correlation of course and heading
_SLOWEST = 0.05  # of the usual speed; slower, the course is noise


def planar(series: Sequence[Series]) -> Told:
    """Return the roles of columns that names say nothing about."""
    moving = [one for one in series if one.varies][:_MOST]
    if len(moving) < 2:
        return {}
    joined = together(moving)
    values = np.column_stack([straightened(column) for column in joined.values.T])
    pairs = _pairs(joined.elapsed, values)
    told = _ship(moving, values, pairs)
    return told or {
        moving[rate].column: ("", 40, None, f"the rate of `{moving[value].column}`")
        for value, rate, _ in pairs
    }


def _pairs(elapsed: FloatArray, values: FloatArray) -> list[tuple[int, int, float]]:
    """Return (value, rate, ratio) for columns that are integrals of others."""
    known = np.isfinite(values).mean(axis=0) > 0.5
    added, moved = changes(elapsed, np.where(known, values, 0.0), np.where(known, values, 0.0))
    if len(added) < 2:
        return []
    sizes = np.linalg.norm(added, axis=0), np.linalg.norm(moved, axis=0)
    likeness = (moved.T @ added) / np.maximum(np.outer(sizes[1], sizes[0]), 1e-30)
    np.fill_diagonal(likeness, 0.0)
    found = []
    for value in range(values.shape[1]):
        rate = int(np.argmax(np.abs(likeness[value])))
        ratio = float(np.sign(likeness[value, rate]) * sizes[1][value] / sizes[0][rate])
        if abs(likeness[value, rate]) > _PAIR and _likely(ratio):
            found.append((value, rate, ratio))
    return found


def _likely(ratio: float) -> bool:
    """Tell a ratio of units of angle from one of chance."""
    return any(_ONE[0] < ratio / unit < _ONE[1] for unit in (1.0, factor("deg"), 1 / factor("deg")))


def _ship(
    series: Sequence[Series], values: FloatArray, pairs: list[tuple[int, int, float]]
) -> Told:
    """Return the three pairs of which the course of two follows the third, if there are such."""
    best: tuple[float, Told] = (_FOLLOWS, {})
    for north, east, turn in permutations(pairs, 3):
        columns = {column for pair in (north, east, turn) for column in pair[:2]}
        if len(columns) < 6 or not all(_ONE[0] < pair[2] < _ONE[1] for pair in (north, east)):
            continue
        likeness, unit = _followed(values[:, north[1]], values[:, east[1]], values[:, turn[0]])
        if unit and likeness > best[0]:
            best = likeness, dict(_spelt(series, (north, east, turn), unit, likeness))
    return best[1]


def _followed(north: FloatArray, east: FloatArray, heading: FloatArray) -> tuple[float, str]:
    """Return how closely the course follows a heading, and the unit of the heading."""
    speed = np.hypot(north, east)
    fine = np.isfinite(speed) & np.isfinite(heading)
    fine &= speed > _SLOWEST * float(np.median(speed[fine])) if fine.any() else fine
    if np.count_nonzero(fine) < 3 or float(np.std(heading[fine])) == 0.0:
        return 0.0, ""
    course = np.unwrap(np.arctan2(east[fine], north[fine]))
    turned = heading[fine] - heading[fine].mean()
    swing = course - course.mean()
    size = float(np.linalg.norm(turned) * np.linalg.norm(swing))
    likeness = float(turned @ swing) / size if size > 0.0 else 0.0
    slope = float(np.std(swing) / np.std(turned))
    degrees = abs(np.log(slope / factor("deg"))) < abs(np.log(slope))
    off = float(np.angle(np.mean(np.exp(1j * (course - heading[fine] * _rad(degrees))))))
    return (likeness, "deg" if degrees else "rad") if abs(off) < np.pi / 4 else (0.0, "")


def _rad(degrees: bool) -> float:
    return factor("deg") if degrees else 1.0


def _spelt(
    series: Sequence[Series],
    pairs: tuple[tuple[int, int, float], ...],
    unit: str,
    likeness: float,
) -> Iterator[tuple[str, tuple[str, int, str | None, str]]]:
    sure = round(100 * likeness)
    for (value, rate, _), name in zip(pairs[:2], ("north", "east"), strict=True):
        made = f"its integral is `{series[value].column}`"
        yield series[value].column, (f"position.{name}", sure, None, "the way of a velocity")
        yield series[rate].column, (f"velocity.{name}", sure, None, f"{made}: earth-fixed")
    value, rate, ratio = pairs[2]
    follows = f"the course follows it (correlation {likeness:.2f}), in {unit}"
    yield series[value].column, ("attitude.heading", sure, unit, follows)
    other = {"deg": "rad", "rad": "deg"}[unit]
    turning = unit if _ONE[0] < ratio < _ONE[1] else other
    made = f"its integral is `{series[value].column}`, in {turning}/s"
    yield series[rate].column, ("velocity.r", sure, f"{turning}/s", made)
