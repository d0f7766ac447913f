"""Which coefficients a log determines: rank, condition, inflation, groups and a grade each."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError, did_you_mean
from hydrodamp.identification.regression.attenuation import NOISY_TERMS, attenuation
from hydrodamp.identification.regression.covariance import rows_covariance
from hydrodamp.identification.regression.influence import least_squares_influence
from hydrodamp.identification.trust.collinearity import collinearity
from hydrodamp.identification.trust.excitation import SPAN, Excitation, excitation
from hydrodamp.identification.trust.grades import Evidence, Grade
from hydrodamp.identification.uncertainty.intervals import Uncertainty
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True)
class AxisIdentifiability:
    """What a log determines on one axis."""

    axis: str
    labels: tuple[str, ...]
    grades: tuple[Grade, ...]
    inflation: tuple[float, ...]
    rank: int
    condition: float
    share: float
    excited: bool
    groups: tuple[tuple[str, ...], ...]

    def count(self, grade: Grade) -> int:
        """Return how many coefficients have a grade."""
        return self.grades.count(grade)

    def __str__(self) -> str:
        """Return a line for the table."""
        counts = "".join(f"{self.count(grade):>8}" for grade in Grade)
        note = "" if self.excited else " *"
        return (
            f"{self.axis:<5}{self.rank:>4} of {len(self.labels):<4}{self.condition:>10.3g}"
            f"{100.0 * self.share:>10.0f} %{counts}{note}"
        )


@dataclass(frozen=True)
class Identifiability:
    """Which coefficients of a model a log determines.

    Attributes
    ----------
    model : DampingModel
        Restricted to the free axes.
    axes : tuple of AxisIdentifiability
        Those on which the model has terms.
    """

    model: DampingModel
    axes: tuple[AxisIdentifiability, ...]

    @property
    def grades(self) -> dict[str, Grade]:
        """The grade of every coefficient, by label."""
        return {k: v for one in self.axes for k, v in zip(one.labels, one.grades, strict=True)}

    @property
    def inflation(self) -> dict[str, float]:
        """The variance inflation factor of every coefficient, by label."""
        return {k: v for one in self.axes for k, v in zip(one.labels, one.inflation, strict=True)}

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Labels that the data cannot tell apart, exactly or nearly, group by group."""
        return tuple(group for one in self.axes for group in one.groups)

    def grade(self, label: str) -> Grade:
        """Return the grade of one coefficient.

        Parameters
        ----------
        label : str
            Such as ``Y_v|v|``.

        Returns
        -------
        grade : Grade
            Determined, weak or not determined.

        Raises
        ------
        MethodError
            If the model has no such coefficient.
        """
        if label not in self.grades:
            raise MethodError(
                f"model '{self.model.key}' has no coefficient {label} on a free axis."
                f"{did_you_mean(label, self.grades)}"
            )
        return self.grades[label]

    def labelled(self, grade: Grade) -> tuple[str, ...]:
        """Return the labels of a grade, in the model's order."""
        return tuple(label for label, given in self.grades.items() if given is grade)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as numbers, words and lists; None where infinite.

        Returns
        -------
        content : dict
            Ready for strict JSON.
        """
        return {
            "model": self.model.key,
            "axes": {one.axis: _summary(one) for one in self.axes},
            "coefficients": {
                label: {"grade": grade.word, "vif": _finite(self.inflation[label])}
                for label, grade in self.grades.items()
            },
        }

    @property
    def summary(self) -> str:
        """A table of the axes, then the groups."""
        counts = Counter(self.grades.values())
        total = ", ".join(f"{counts[grade]} {grade.word}" for grade in Grade)
        head = f"{'axis':<5}{'rank':>4}{'':<8}{'condition':>10}{'predicted':>12}"
        head += "".join(f"{word:>8}" for word in ("det.", "weak", "not"))
        lines = [f"{self.model.key}: {total}", head, *map(str, self.axes)]
        lines += [f"not told apart: {' '.join(group)}" for group in self.groups[:_MOST_GROUPS]]
        if (more := len(self.groups) - _MOST_GROUPS) > 0:
            lines.append(f"and {more} more groups")
        if any(not one.excited for one in self.axes):
            lines.append(_STAR)
        return "\n".join(lines)

    def __str__(self) -> str:
        """Return the summary, then the labels by grade."""
        there = [grade for grade in Grade if grade in self.grades.values()]
        return "\n".join([self.summary, *(_listed(self, grade) for grade in there)])


_STAR = "* the response is not predicted, for want of motion or of the right terms"

#: Groups printed, for one screen.
_MOST_GROUPS = 4

#: Labels of a grade printed.
_MOST_LABELS = 36


def identifiability(
    problem: Problem,
    model: DampingModel,
    covariance: FloatArray | Uncertainty | None = None,
    coefficients: FloatArray | None = None,
    *,
    span: float = SPAN,
) -> Identifiability:
    """Grade how well a log determines each coefficient of a model.

    A coefficient is *not determined* where it is aliased, where its axis is not excited
    (:mod:`hydrodamp.identification.trust.excitation`), where its column lives on velocities
    that are not, or where its interval tells nothing. It is *determined* where the
    interval is narrow against the coefficient or against what matters on the axis, and
    *weak* between the two. The constants and their reasons stand in
    :mod:`hydrodamp.identification.trust.grades`.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        Which terms.
    covariance : ndarray, shape (n_coefficients, n_coefficients), or Uncertainty, optional
        Of the estimator in use, in the order of the labels of the model on the free
        axes; an array is taken as exact. By default that of the weak form, from the noise
        that the model and the terms of Gertler and Hagen together leave over.
    coefficients : ndarray, shape (n_coefficients,), optional
        Of the estimator in use, against which the intervals are narrow or not. By default
        those of the weak form.
    span : float
        Length of the test functions of the weak form [s]: some time constants of the
        vehicle.

    Returns
    -------
    identifiability : Identifiability
        Axis by axis.

    Raises
    ------
    MethodError
        If covariance or coefficients have another shape, or the log is too short.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign, fossen = reenact(duration=60.0), catalog["fossen"]
    >>> found = identifiability(prepare(campaign.vehicle, campaign.train, fossen), fossen)
    >>> len(found.grades), found.axes[0].rank
    (12, 2)
    """
    free = model.restricted_to(problem.vehicle.axes)
    known = _known(covariance)
    _check(known, coefficients, free)
    seen = excitation(problem, free, span)
    half = _half_widths(seen, known)
    ends = np.cumsum([0, *map(len, free.terms)]).tolist()
    return Identifiability(
        free,
        tuple(
            _axis(
                seen,
                axis,
                free.labels[start:stop],
                half[start:stop],
                None if coefficients is None else coefficients[start:stop],
            )
            for axis, (start, stop) in enumerate(itertools.pairwise(ends))
            if stop > start
        ),
    )


def _known(covariance: FloatArray | Uncertainty | None) -> Uncertainty | None:
    if covariance is None or isinstance(covariance, Uncertainty):
        return covariance
    return Uncertainty(covariance, np.inf, "the covariance given")


def _check(known: Uncertainty | None, coefficients: FloatArray | None, model: DampingModel) -> None:
    n = model.n_coefficients
    covariance = None if known is None else known.covariance
    for name, value, shape in (
        ("covariance", covariance, (n, n)),
        ("coefficients", coefficients, (n,)),
    ):
        if value is not None and np.shape(value) != shape:
            raise MethodError(
                f"`{name}` must have shape {shape}, in the order of the coefficients of "
                f"'{model.key}' on the free axes; got {np.shape(value)}"
            )


def _half_widths(seen: Excitation, known: Uncertainty | None) -> FloatArray:
    """Return half the width of the 95 % interval of each coefficient, from noise alone."""
    if known is not None:
        return known.reach() * known.standard_errors
    influence = least_squares_influence(seen.rows, seen.model)
    known = rows_covariance(seen.rows, influence, seen.model, seen.reference)
    known = known.widened(attenuation(seen.rows, seen.model), NOISY_TERMS)
    return known.reach() * known.of_noise.standard_errors


def _axis(
    seen: Excitation,
    axis: int,
    labels: tuple[str, ...],
    half: FloatArray,
    coefficients: FloatArray | None,
) -> AxisIdentifiability:
    rows = seen.rows
    columns = [rows.basis.index(term) for term in seen.model.terms[axis]]
    design = rows.design[:, columns]
    alike = collinearity(design, labels)
    weights = alike.span.coefficients @ alike.span.directions.T
    evidence = Evidence(
        coefficient=weights @ rows.target[:, axis] if coefficients is None else coefficients,
        half=half,
        size=np.sqrt(np.mean(design**2, axis=0)),
        sound=np.einsum("mn,nm->m", weights, seen.quiet[:, columns]),
        aliased=alike.aliased,
        response=float(seen.response[axis]),
        excited=bool(seen.excited[axis]),
    )
    return AxisIdentifiability(
        axis=AXES[axis],
        labels=labels,
        grades=evidence.grades(),
        inflation=tuple(alike.inflation.tolist()),
        rank=alike.span.rank,
        condition=alike.condition,
        share=float(seen.share[axis]),
        excited=evidence.excited,
        groups=alike.groups,
    )


def _summary(one: AxisIdentifiability) -> dict[str, Any]:
    return {
        "rank": one.rank,
        "condition": _finite(one.condition),
        "predicted_share": one.share,
        "excited": one.excited,
        "grades": {grade.word: one.count(grade) for grade in Grade},
        "groups": [list(group) for group in one.groups],
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _listed(found: Identifiability, grade: Grade) -> str:
    labels = found.labelled(grade)
    more = f" and {len(labels) - _MOST_LABELS} more" if len(labels) > _MOST_LABELS else ""
    return f"{grade.word}: {' '.join(labels[:_MOST_LABELS])}{more}"
