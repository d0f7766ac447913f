"""Verdict on a comparison or a cross-validation: which model to use, on which axes, and why.

The fit of a velocity over the held-out data, with its standard error, gives the light of its axis:
green from :data:`MIN_FIT` on, red where it is not significantly above zero, the mean of the data,
and amber between. Significant means above zero with a one-sided confidence of :data:`CONFIDENCE`.
Where the test data are training data, wholly or in part, it is grey: no fit to training data is a
prediction.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.intervals import ALL_TEST_DATA
from hydrodamp.identification.grades import Grade, count_determined, critical_value
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.simulation.replay import RateUnit
from hydrodamp.status import TextEnum
from hydrodamp.validation.excitation import describe_overlap
from hydrodamp.validation.selection import (
    Candidate,
    Ranked,
    Selection,
    margin,
    row_name,
    row_text,
)

#: Least fit [%] of a green light: half of the error of predicting the mean of the data.
MIN_FIT = 50.0

#: One-sided confidence that the fit is above zero, by Student's t over the blocks.
CONFIDENCE = 0.95


class Light(TextEnum):
    """Whether to use the predictions of an axis.

    Examples
    --------
    >>> Light.GREEN.word
    'use'
    """

    GREEN = f"use: the fit is at least {MIN_FIT:.0f} % and its terms are identifiable."
    AMBER = "use with care: the fit or the identifiability is low."
    RED = "do not use: not significantly better than the mean of the data."
    GREY = "not tested: the data are, wholly or in part, those of the training."


@dataclass(frozen=True)
class AxisVerdict:
    """Light of one velocity, its fit [%] with standard error, and the reason."""

    velocity: str
    light: Light
    fit: float | None
    standard_error: float | None
    reason: str = ""

    @property
    def fit_text(self) -> str:
        """The fit with its standard error; empty where the data do not vary."""
        error = "" if self.standard_error is None else f" ± {self.standard_error:.0f}"
        return "" if self.fit is None else f"{self.fit:.0f}{error} %"

    def __str__(self) -> str:
        """Return velocity, fit with its standard error, and reason."""
        reason = f"({self.reason})" if self.reason else ""
        return " ".join(filter(None, (self.velocity, self.fit_text, reason)))


@dataclass(frozen=True)
class Verdict:
    """Which model to use, how well it predicts each velocity, and why.

    Attributes
    ----------
    model, method : str
        Keys of the selected row.
    recommended : bool
        Whether it predicts a velocity of the held-out data significantly better than its mean.
    n_coefficients : int
        Number of coefficients.
    n_determined : int or None
        How many the training data determine; None where not graded.
    rms : float or None
        Equation 24; None where a replay diverged.
    standard_error : float or None
        Its standard error over blocks of the held-out data; None for a single block.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in the error.
    axes : tuple of AxisVerdict
        Light, fit and reason of each velocity.
    alternatives : dict of str to str
        Row that predicts a velocity with a better light, by velocity.
    equivalent : tuple of str
        Rows that the held-out data do not distinguish from the selected one.
    reasons : tuple of str
        Why it was selected, and what limits the verdict.
    overlap : str
        Test data that are also training data; empty for none.
    """

    model: str
    method: str
    recommended: bool
    n_coefficients: int
    n_determined: int | None
    rms: float | None
    standard_error: float | None
    rate_unit: RateUnit
    axes: tuple[AxisVerdict, ...]
    alternatives: Mapping[str, str]
    equivalent: tuple[str, ...]
    reasons: tuple[str, ...]
    overlap: str = ""

    @property
    def headline(self) -> str:
        """For which velocities to use the model, its accuracy, and models for the others."""
        size = f"{self.n_coefficients} coefficients"
        if self.n_determined is not None:
            size += f", {self.n_determined} determined"
        if self.rms is not None:
            error = f"{self.rms:.3g}{margin(self.standard_error)}"
            size += f"; RMS error {error} (m/s and {self.rate_unit}/s mixed)"
        return " ".join((f"{self._advice}: {size}.", *self._describe_alternatives()))

    @property
    def _advice(self) -> str:
        """For which velocities to use the model, by their lights."""
        row, names = f"{self.model} by {self.method}", self._by_light()
        if not names.keys() - {Light.RED}:
            if self.alternatives:
                return f"Do not use {row} for {names[Light.RED]}"
            return f"No model of this set is fit for use. Best: {row}"
        if self.overlap == ALL_TEST_DATA:
            return f"{row} is not tested, its errors are those of training data"
        if self.overlap:
            return f"{row} is tested partly on training data, its errors are optimistic"
        uses = {Light.GREEN: "for {}", Light.AMBER: "with care for {}", Light.RED: "not for {}"}
        clauses = ", ".join(uses[light].format(text) for light, text in names.items())
        if Light.GREEN not in names:
            return f"{row} is usable {clauses}"
        return f"Use {row}" + (f" {clauses}" if len(names) > 1 else "")

    def _by_light(self) -> dict[Light, str]:
        """Return the velocities of each light that there is."""
        names = {
            light: " ".join(axis.velocity for axis in self.axes if axis.light is light)
            for light in Light
        }
        return {light: text for light, text in names.items() if text}

    def _describe_alternatives(self) -> Iterator[str]:
        """Yield which other models to take for which velocities, and for which there is none."""
        velocities: dict[str, list[str]] = {}
        for name, row in self.alternatives.items():
            velocities.setdefault(row, []).append(name)
        texts = [f"for {' '.join(names)} take {row}" for row, names in velocities.items()]
        if texts:
            text = "; ".join(texts)
            yield f"{text[:1].upper()}{text[1:]}."
            red = self._by_light().get(Light.RED, "").split()
            if none := " ".join(name for name in red if name not in self.alternatives):
                yield f"No model of this set predicts {none}."

    @property
    def remedy(self) -> str:
        """What to do where no model is recommended; else empty."""
        if self.recommended:
            return ""
        if Light.GREY in self._by_light():
            return "test on data that the training did not use, or run `hydrodamp validate`."
        return (
            "check units, axes and signs with `hydrodamp probe LOG --vehicle FILE`; `hydrodamp "
            "plan` designs a dive with more excitation."
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """Headline, velocities by light, and reasons."""
        return (self.headline, *describe_lights(self.axes), *self.reasons)

    def __str__(self) -> str:
        """Return the lines."""
        return "\n".join(self.lines)

    __repr__ = __str__


def judge_selection(
    selection: Selection[Candidate],
    rate_unit: RateUnit,
    remarks: Iterable[str] = (),
    doubts: Mapping[str, str] | None = None,
    overlap: str = "",
) -> Verdict:
    """Return the verdict on a selected row.

    ``remarks`` limit the verdict; ``doubts`` are reasons not to trust the fit of a velocity;
    ``overlap`` names test data that are training data.
    """
    row, errors = selection.row, selection.errors
    n_determined = count_determined(row.grades)
    why = selection.caveat if selection.runner_up is None else f"Why: {selection}"
    shared = [describe_overlap(overlap)] if overlap else []
    reasons = [*filter(None, [why]), *shared, *remarks]
    if n_determined is not None and 2 * n_determined < row.n_coefficients:
        reasons.append(
            f"The training data determine {n_determined} of {row.n_coefficients} coefficients: use "
            "them together, in motions like those of the log."
        )
    if errors.standard_error is None:
        reasons.append("The held-out data are too short for a standard error.")

    def judge_row(each: Ranked) -> tuple[AxisVerdict, ...]:
        blocks = errors if each.blocks is None else each.blocks
        return tuple(judge_axes(blocks, each.grades, doubts or {}, not overlap))

    axes = judge_row(row)
    judged = {row_name(each): judge_row(each) for each in selection.ranked if each is not row}
    return Verdict(
        row.model,
        row.method,
        not {axis.light for axis in axes} <= {Light.RED, Light.GREY},
        row.n_coefficients,
        n_determined,
        None if row.divergences else errors.rms,
        None if row.divergences else errors.standard_error,
        rate_unit,
        axes,
        dict(_find_alternatives(axes, judged)),
        tuple(map(row_text, selection.equivalent)),
        tuple(reasons),
        overlap,
    )


def _find_alternatives(
    axes: Sequence[AxisVerdict], judged: Mapping[str, Sequence[AxisVerdict]]
) -> Iterator[tuple[str, str]]:
    """Yield each velocity of which another row has a better light, and the best of these rows."""
    order = [*Light]
    for number, axis in enumerate(axes):
        of_axis = {name: row[number] for name, row in judged.items()}
        better = [
            (order.index(candidate.light), -(candidate.fit or 0.0), name)
            for name, candidate in of_axis.items()
            if order.index(candidate.light) < order.index(axis.light)
        ]
        if better:
            yield axis.velocity, min(better)[-1]


def describe_lights(axes: Sequence[AxisVerdict]) -> Iterator[str]:
    """Yield the velocities of each light."""
    for light in Light:
        if names := [str(axis) for axis in axes if axis.light is light]:
            yield f"{light.word.capitalize()}: {', '.join(names)}."


def judge_axes(
    errors: BlockErrors,
    grades: Mapping[str, Grade],
    doubts: Mapping[str, str],
    is_tested: bool = True,
) -> Iterator[AxisVerdict]:
    """Yield the light of each velocity; after a divergence red, without a fit."""
    deviations = errors.standard_error_by_axis
    critical = critical_value(2.0 * CONFIDENCE - 1.0, max(errors.n - 1, 1))
    for name, fit in errors.fit_by_axis.items():
        deviation, light, reason = deviations[name], Light.GREEN, doubts.get(name, "")
        if errors.diverged.any():
            yield AxisVerdict(name, Light.RED, None, None, "a replay diverged")
            continue
        if not reason and not _is_identifiable(name, grades):
            reason = "no coefficient determined"
        if not is_tested:
            light = Light.GREY
        elif fit is None or fit <= critical * (deviation or 0.0):
            is_worse = fit is not None and fit < -critical * (deviation or 0.0)
            word = "worse" if is_worse else "not significantly better"
            light, reason = Light.RED, reason or f"{word} than the mean"
        elif reason or fit < MIN_FIT:
            light = Light.AMBER
        yield AxisVerdict(name, light, fit, deviation, reason)


def _is_identifiable(name: str, grades: Mapping[str, Grade]) -> bool:
    """Whether a coefficient of the axis is better than not determined; also where unknown."""
    axis = next(axis for axis in AXES if VELOCITY_OF[axis] == name)
    of_axis = [grade for label, grade in grades.items() if label.partition("_")[0] == axis]
    return not of_axis or any(grade is not Grade.NOT_DETERMINED for grade in of_axis)
