"""Where things stand that would hide each other: names pushed apart, models side by side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from hydrodamp.validation.comparison import Row

_ASIDE = 0.022
"""Least distance of two models on the axis of sizes, as a share of it."""

_MARGINS = 1.35, 1.25
"""How far the axis reaches below the smallest model and above the greatest, as factors."""

Columns = dict[tuple[int, str], float]
"""Where a model stands on the axis of sizes, by its number of coefficients and its key."""


def pushed_apart(
    places: Sequence[float], least: float, ends: tuple[float, float] = (-math.inf, math.inf)
) -> list[float]:
    """Return places at least so far apart, as near as can be to where they were."""
    shift = np.arange(len(places)) * least
    wanted = np.asarray(places) - shift
    # Pool adjacent violators: means of blocks, until they rise.
    blocks: list[list[float]] = []
    for value in wanted.tolist():
        blocks.append([value])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    level = np.concatenate([np.full(len(block), np.mean(block)) for block in blocks])
    room = max(ends[1] - float(shift[-1]), ends[0])
    moved: list[float] = (np.clip(level, ends[0], room) + shift).tolist()
    return moved


def columns_of(rows: Iterable[Row]) -> Columns:
    """Return where models stand on a logarithmic axis of numbers of coefficients."""
    models = sorted(dict.fromkeys((row.n_coefficients, row.model) for row in rows), key=_size)
    low, high = limits_of(size for size, _ in models)
    moved = pushed_apart([math.log(size) for size, _ in models], _ASIDE * math.log(high / low))
    return {model: math.exp(place) for model, place in zip(models, moved, strict=True)}


def _size(model: tuple[int, str]) -> int:
    """Return what models are sorted by; those alike stay as they came."""
    return model[0]


def limits_of(sizes: Iterable[float]) -> tuple[float, float]:
    """Return the ends of an axis of numbers of coefficients."""
    found = list(sizes)
    return min(found) / _MARGINS[0], max(found) * _MARGINS[1]
