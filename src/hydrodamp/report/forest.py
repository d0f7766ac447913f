"""Forest plot: values and 95 % intervals of coefficients that fits share, on scales with zero."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.fit_tables import half_widths
from hydrodamp.report.table import coefficient

WIDTH = 320  # px of a scale
MAX_HALF_WIDTH = (
    2.0  # half-width of an interval over the range of the values, beyond which it is cut
)


@dataclass(frozen=True)
class Mark:
    """A value and its interval, in px of the scale; ``is_cut`` at the left and the right end."""

    model: str
    text: str
    value: float
    interval: tuple[float, float] | None
    is_cut: tuple[bool, bool]


@dataclass(frozen=True)
class ForestRow:
    """A coefficient: label, unit, position of zero and a mark for each fit."""

    label: str
    unit: str
    zero: float
    marks: tuple[Mark, ...]


def forest_rows(fits: Sequence[Fit]) -> tuple[ForestRow, ...]:
    """Return the coefficients of the first fit that others share, the determined ones first.

    Of a single fit, all of them are returned.
    """
    values = [fit.damping.as_dict() for fit in fits]
    halves = [dict(zip(fit.model.labels, half_widths(fit).tolist(), strict=True)) for fit in fits]
    grades = fits[0].grades
    labels = [
        label
        for label in fits[0].model.labels
        if len(fits) == 1 or any(label in each for each in values[1:])
    ]
    labels.sort(key=lambda label: [*Grade].index(grades.get(label, Grade.NOT_DETERMINED)))
    return tuple(
        _row(
            label,
            [
                (fit.model.key, each[label], half[label])
                for fit, each, half in zip(fits, values, halves, strict=True)
                if label in each
            ],
        )
        for label in labels
    )


def _row(label: str, estimates: Iterable[tuple[str, float, float]]) -> ForestRow:
    listed = list(estimates)
    numbers = np.array([value for _, value, _ in listed] + [0.0])
    span = float(np.ptp(numbers)) or 1.0
    finite = [half for _, _, half in listed if np.isfinite(half)]
    margin = min(max(finite, default=0.0), MAX_HALF_WIDTH * span) + 0.05 * span
    low, high = float(numbers.min()) - margin, float(numbers.max()) + margin
    unit = coefficient_unit(*read_label(label))

    def position(value: float) -> float:
        return round(WIDTH * (value - low) / (high - low), 1)

    marks = []
    for model, value, half in listed:
        ends = (value - half, value + half)
        is_cut = ends[0] < low, ends[1] > high
        drawn = (position(max(ends[0], low)), position(min(ends[1], high)))
        known = bool(np.isfinite(half))
        margin_text = f" ± {coefficient(half)}" if known else ""
        text = f"{model}: {coefficient(value)}{margin_text}"
        interval = drawn if known else None
        marks.append(Mark(model, text, position(value), interval, is_cut))
    return ForestRow(label, unit, position(0.0), tuple(marks))
