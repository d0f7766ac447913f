"""Verdict on a comparison or a cross-validation: which model to use, on which axes, and why.

The fit of a velocity over the held-out data, with its standard error, gives the light of its axis:
green from :data:`MIN_FIT` on, red where it is not above zero, the mean of the data.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.identification.grades import Grade, count_determined
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.simulation.replay import RateUnit
from hydrodamp.status import TextEnum
from hydrodamp.validation.selection import Candidate, Selection, margin, row_text

#: Least fit [%] of a green light: half of the error of predicting the mean of the data.
MIN_FIT = 50.0


class Light(TextEnum):
    """Whether to use the predictions of an axis.

    Examples
    --------
    >>> Light.GREEN.word
    'use'
    """

    GREEN = f"use: the fit is at least {MIN_FIT:.0f} % and its terms are identifiable."
    AMBER = "use with care: the fit or the identifiability is low."
    RED = "do not use: no better than the mean of the data."


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
        Whether it predicts a velocity of the held-out data better than its mean.
    n_coefficients : int
        Number of coefficients.
    n_determined : int or None
        How many the training data determine; None where not graded.
    rms : float
        Equation 24, with diverged replays as the mean of the data.
    standard_error : float or None
        Its standard error over blocks of the held-out data; None for a single block.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in the error.
    axes : tuple of AxisVerdict
        Light, fit and reason of each velocity.
    equivalent : tuple of str
        Rows that the held-out data do not distinguish from the selected one.
    reasons : tuple of str
        Why it was selected, and what limits the verdict.
    """

    model: str
    method: str
    recommended: bool
    n_coefficients: int
    n_determined: int | None
    rms: float
    standard_error: float | None
    rate_unit: RateUnit
    axes: tuple[AxisVerdict, ...]
    equivalent: tuple[str, ...]
    reasons: tuple[str, ...]

    @property
    def headline(self) -> str:
        """The model and its accuracy in one sentence."""
        row = f"{self.model} by {self.method}: {self.n_coefficients} coefficients"
        if self.n_determined is not None:
            row += f", {self.n_determined} determined"
        if self.recommended:
            error = f"{self.rms:.3g}{margin(self.standard_error)}"
            return f"Use {row}; RMS error {error} (m/s and {self.rate_unit}/s mixed)."
        return (
            f"Use none of these models: no velocity is predicted better than its mean. Best: {row}."
        )

    @property
    def remedy(self) -> str:
        """What to do where no model is recommended; else empty."""
        if self.recommended:
            return ""
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
) -> Verdict:
    """Return the verdict on a selected row.

    ``remarks`` limit the verdict; ``doubts`` are reasons not to trust the fit of a velocity.
    """
    row, errors = selection.row, selection.errors
    n_determined = count_determined(row.grades)
    why = selection.caveat if selection.runner_up is None else f"Why: {selection}"
    reasons = [*filter(None, [why]), *remarks]
    if n_determined is not None and 2 * n_determined < row.n_coefficients:
        reasons.append(
            f"The training data determine {n_determined} of {row.n_coefficients} coefficients: use "
            "them together, in motions like those of the log."
        )
    if errors.standard_error is None:
        reasons.append("The held-out data are too short for a standard error.")
    diverged = dict.fromkeys(errors.names if row.divergences else (), "a replay diverged")
    axes = tuple(judge_axes(errors, row.grades, diverged | dict(doubts or {})))
    return Verdict(
        row.model,
        row.method,
        any(axis.light is not Light.RED for axis in axes),
        row.n_coefficients,
        n_determined,
        errors.rms,
        errors.standard_error,
        rate_unit,
        axes,
        tuple(map(row_text, selection.equivalent)),
        tuple(reasons),
    )


def describe_lights(axes: Sequence[AxisVerdict]) -> Iterator[str]:
    """Yield the velocities of each light."""
    for light in Light:
        if names := [str(axis) for axis in axes if axis.light is light]:
            yield f"{light.word.capitalize()}: {', '.join(names)}."


def judge_axes(
    errors: BlockErrors, grades: Mapping[str, Grade], doubts: Mapping[str, str]
) -> Iterator[AxisVerdict]:
    """Yield the light of each velocity."""
    deviations = errors.standard_error_by_axis
    for name, fit in errors.fit_by_axis.items():
        deviation, light, reason = deviations[name], Light.GREEN, doubts.get(name, "")
        if not reason and not _is_identifiable(name, grades):
            reason = "no coefficient determined"
        if fit is None or fit <= 0.0:
            light, reason = Light.RED, reason or "no better than the mean"
        elif reason or fit < max(MIN_FIT, deviation or 0.0):
            light = Light.AMBER
        yield AxisVerdict(name, light, fit, deviation, reason)


def _is_identifiable(name: str, grades: Mapping[str, Grade]) -> bool:
    """Whether a coefficient of the axis is better than not determined; also where unknown."""
    axis = next(axis for axis in AXES if VELOCITY_OF[axis] == name)
    of_axis = [grade for label, grade in grades.items() if label.partition("_")[0] == axis]
    return not of_axis or any(grade is not Grade.NOT_DETERMINED for grade in of_axis)
