"""Forest plot: values and 95 % intervals of coefficients, each on a scale of its own with zero."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.fit_tables import half_widths
from hydrodamp.report.table import coefficient, format_interval

MAX_HALF_WIDTH = 2.0  # half-width of a drawn interval over the range of the values
MAX_VALUE = 3.0  # drawn value over the median, the first value and the true one, whichever is most
N_TICKS = 5  # intervals between ticks of a scale, about


@dataclass(frozen=True)
class Mark:
    """A value, if within the scale, and its interval, in % of the scale.

    ``is_cut`` at the left and the right end.
    """

    model: str
    text: str
    value: float | None
    interval: tuple[float, float] | None
    is_cut: tuple[bool, bool]


@dataclass(frozen=True)
class ForestRow:
    """A coefficient: label, unit, grade, ticks, positions of zero and the truth, marks of fits."""

    label: str
    unit: str
    grade: str
    ticks: tuple[tuple[float, str], ...]
    zero: float
    truth: float | None
    truth_text: str
    marks: tuple[Mark, ...]

    @property
    def description(self) -> str:
        """The row in words."""
        texts = (f"{mark.model}: {mark.text}" for mark in self.marks)
        return "; ".join(filter(None, [*texts, self.truth_text]))


def forest_rows(
    fits: Sequence[Fit], truth: Mapping[str, float] | None = None
) -> tuple[ForestRow, ...]:
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
            grades.get(label, Grade.NOT_DETERMINED),
            (truth or {}).get(label),
            [
                (fit.model.key, each[label], half[label])
                for fit, each, half in zip(fits, values, halves, strict=True)
                if label in each
            ],
        )
        for label in labels
    )


def _row(
    label: str, grade: Grade, truth: float | None, estimates: Iterable[tuple[str, float, float]]
) -> ForestRow:
    listed = list(estimates)
    numbers = np.array([value for _, value, _ in listed])
    known = [0.0] if truth is None else [0.0, truth]
    limit = MAX_VALUE * float(np.max(np.abs([np.median(np.abs(numbers)), numbers[0], *known])))
    drawn_numbers = np.append(numbers[np.abs(numbers) <= limit], known)
    span = float(np.ptp(drawn_numbers)) or 1.0
    finite = [half for _, value, half in listed if np.isfinite(half) and abs(value) <= limit]
    margin = min(max(finite, default=0.0), MAX_HALF_WIDTH * span) + 0.05 * span
    low, high = float(drawn_numbers.min()) - margin, float(drawn_numbers.max()) + margin

    def position(value: float) -> float:
        return round(100.0 * (min(max(value, low), high) - low) / (high - low), 2)

    marks = []
    for model, value, half in listed:
        is_known = bool(np.isfinite(half))
        ends = (value - half, value + half) if is_known else (value, value)
        text = format_interval(value, half) if is_known else coefficient(value)
        drawn = position(ends[0]), position(ends[1])
        is_drawn = low <= value <= high
        interval = drawn if is_known or not is_drawn else None
        cut = ends[0] < low, ends[1] > high
        marks.append(Mark(model, text, position(value) if is_drawn else None, interval, cut))
    ticks = tuple((position(value), f"{value:.6g}") for value in tick_values(low, high))
    unit = coefficient_unit(*read_label(label))
    true_position = None if truth is None else position(truth)
    text = "" if truth is None else f"true value: {coefficient(truth)}"
    return ForestRow(
        label, unit, grade.word, ticks, position(0.0), true_position, text, tuple(marks)
    )


def tick_values(low: float, high: float) -> list[float]:
    """Return the multiples of 1, 2 or 5 times a power of ten within an interval with zero."""
    size = (high - low) / N_TICKS
    power = 10.0 ** np.floor(np.log10(size))
    step = power * next((each for each in (1.0, 2.0, 5.0) if each * power >= size), 10.0)
    return [float(step * k) for k in range(int(np.ceil(low / step)), int(high / step) + 1)]
