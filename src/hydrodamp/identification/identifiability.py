"""Practical identifiability: excitation of each axis, rank and condition, grade per coefficient.

An axis is excited where the R² on held-out data is at least 0.25: that of its velocity in replays
for a method that replays, that of its wrench in the weak form for others. Where score tests find
the form adequate every axis is: intervals hold all there is to know, and pushes make replays poor.
A coefficient is graded by the half-width of its 95 % confidence interval, and in the weak form by
its reliability ratio: the share of its regressor that excited velocities produce.
"""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.term import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.adequacy import Form
from hydrodamp.identification.differentiation import velocity_correlation_time
from hydrodamp.identification.estimated_vehicle import with_estimated_vehicle
from hydrodamp.identification.fit import Fit, Uncertainty
from hydrodamp.identification.grades import MIN_R_SQUARED, Cause, Grade, grade_coefficients
from hydrodamp.identification.har_covariance import HarCovariance, reference_model
from hydrodamp.identification.regression import Rows, Split, column_span, folds, solve_axis
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Length of the test functions over the time scale of the motion: they average the noise of the
#: velocities, which dominates accelerations from sample to sample.
RELATIVE_SUPPORT = 3.0

#: Test functions; length of the shortest fold.
_MIN_FOLD_LENGTH = 5.0

#: Test functions that overlap at an instant.
_OVERLAP = 4

#: Folds of a long log.
_MAX_FOLDS = 10


@dataclass(frozen=True, eq=False)
class Excitation:
    """Excitation of each axis.

    ``excited_design`` is the regressor with unexcited velocities held at their mean; ``r_squared``
    and ``response`` (RMS of the predicted wrench [N, N m]) have shape (6,). The R² decides unless
    the form ``is_adequate``.
    """

    model: DampingModel
    axes: tuple[str, ...]
    rows: Rows
    excited_design: FloatArray
    r_squared: FloatArray
    response: FloatArray
    is_adequate: bool = False

    @property
    def excited(self) -> BoolArray:
        """Whether each axis is excited; shape (6,)."""
        return self.is_adequate | (self.r_squared >= MIN_R_SQUARED)


def analyse_excitation(problem: Problem, model: DampingModel) -> Excitation:
    """Cross-validate the wrench of each axis by the model and by the reference model."""
    free = model.restricted_to(problem.vehicle.axes)
    further = zip(AXES, reference_model(problem.vehicle.axes).terms, strict=True)
    both = free.with_terms({axis: " ".join(map(str, terms)) for axis, terms in further if terms})
    extended = problem.extend_to(both)
    length, equations = _weak_equations(extended)
    rows = equations.rows(extended)
    response = equations.rows(_without_momentum(extended)).target
    variance = response.var(axis=0)
    r_squared = _r_squared(rows, (free, both), variance, length)
    excited_design = equations.rows(_hold_at_mean(extended, r_squared < MIN_R_SQUARED)).design
    response_rms, axes = frozen(np.sqrt(r_squared * variance)), problem.vehicle.axes
    return Excitation(free, axes, rows, excited_design, frozen(r_squared), response_rms)


def _weak_equations(problem: Problem) -> tuple[float, WeakRegression]:
    """Return the length of test functions [s] that average the noise, and their equations."""
    length = RELATIVE_SUPPORT * velocity_correlation_time(problem)
    support = min(length, float(problem.durations.max()))
    return length, WeakRegression(support, _OVERLAP, windows=())


def _without_momentum(problem: Problem) -> Problem:
    """Cancel the Coriolis term by a wrench, so that targets are responses to the motion."""
    inputs = problem.inputs
    momentum = core.coriolis(problem.vehicle.mass_matrix, inputs.velocity)
    wrench = (inputs.wrench - momentum) * problem.vehicle.free
    return replace(problem, inputs=replace(inputs, wrench=wrench))


def _hold_at_mean(problem: Problem, unexcited: BoolArray) -> Problem:
    """Replace unexcited velocities by their mean."""
    velocity = problem.inputs.velocity
    velocity = np.where(unexcited, velocity.mean(axis=0), velocity)
    return replace(problem, inputs=replace(problem.inputs, velocity=velocity))


def _r_squared(
    rows: Rows, models: tuple[DampingModel, ...], variance: FloatArray, length: float
) -> FloatArray:
    """Return the cross-validated R² of each axis by the better model."""
    duration = sum(np.ptp(rows.time[rows.segment == k]) for k in np.unique(rows.segment))
    n_folds = int(np.clip(duration / (_MIN_FOLD_LENGTH * length), 2, _MAX_FOLDS))
    splits = folds(rows, n_folds, gap=length).splits(rows)
    error = np.min([_prediction_error(splits, model) for model in models], axis=0)
    varies = variance > 0.0
    return np.where(varies, np.clip(1.0 - error / np.where(varies, variance, 1.0), 0.0, 1.0), 0.0)


def _prediction_error(splits: tuple[Split, ...], model: DampingModel) -> FloatArray:
    """Return the mean squared prediction error of each axis on held-out folds."""
    squares = np.zeros(6)
    for split in splits:
        for axis, terms in enumerate(model.terms):
            coefficients = solve_axis(split.train, terms, axis).coefficients
            error = split.test.target(axis) - split.test.columns(terms) @ coefficients
            squares[axis] += np.sum(error**2)
    return squares / sum(split.test.n_samples for split in splits)


_NOT_EXCITED_NOTE = (
    f"* poorly excited: the R² of the axis on held-out data is below {MIN_R_SQUARED}, of replays\n"
    "  or of the force by the weak form"
)


@dataclass(frozen=True)
class AxisIdentifiability:
    """Identifiability of the coefficients of one axis."""

    axis: str
    labels: tuple[str, ...]
    grades: tuple[Grade, ...]
    rank: int
    condition: float
    r_squared: float
    excited: bool
    groups: tuple[tuple[str, ...], ...]
    causes: tuple[Cause | None, ...] = ()

    def count(self, grade: Grade) -> int:
        """Return the number of coefficients of a grade."""
        return self.grades.count(grade)

    def __str__(self) -> str:
        """Return one row of the table."""
        counts = "".join(f"{self.count(grade):>8}" for grade in Grade)
        return (
            f"{self.axis:<5}{self.rank:>4} of {len(self.labels):<4}{self.condition:>10.3g}"
            f"{100.0 * self.r_squared:>10.0f} %{counts}{'' if self.excited else ' *'}"
        )


@dataclass(frozen=True)
class Identifiability:
    """Grade of every coefficient of a model from one log.

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
        return {k: v for axis in self.axes for k, v in zip(axis.labels, axis.grades, strict=True)}

    @property
    def causes(self) -> dict[str, Cause]:
        """Cause of each coefficient that is not determined, by label."""
        pairs = (zip(axis.labels, axis.causes, strict=False) for axis in self.axes)
        return {label: cause for label, cause in itertools.chain(*pairs) if cause}

    @property
    def summary(self) -> str:
        """Number of coefficients per grade, as text."""
        counts = Counter(self.grades.values())
        total = ", ".join(f"{counts[grade]} {grade.word}" for grade in Grade)
        return f"{self.model.key}: {total}"

    def labels_with(self, grade: Grade) -> tuple[str, ...]:
        """Return the labels of a grade, in the model's order."""
        return tuple(label for label, each in self.grades.items() if each is grade)

    def __str__(self) -> str:
        """Return one row per axis as text."""
        head = f"{'axis':<5}{'rank':>4}{'':<8}{'condition':>10}{'predicted':>12}"
        head += "".join(f"{word:>8}" for word in ("det.", "minor", "weak", "not"))
        lines = [self.summary, head, *map(str, self.axes)]
        if any(not axis.excited for axis in self.axes):
            lines.append(_NOT_EXCITED_NOTE)
        return "\n".join(lines)

    __repr__ = __str__


def identifiability(problem: Problem, model: DampingModel) -> Identifiability:
    """Grade how well a log determines each coefficient of a model, independent of the method.

    A coefficient is *not determined* where it is aliased, where its axis is poorly excited, where
    its leverage stems from noise, or where its 95 % interval contains zero. It is *determined*
    where the interval is narrow relative to the coefficient, *minor* where it is narrow relative to
    the response of the axis, and *weak* where only its sign is known. Coefficients and intervals
    are those of the weak form, with the noise estimated from the residuals of the model extended by
    the terms of Gertler and Hagen.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        The terms.

    Returns
    -------
    identifiability : Identifiability
        Axis by axis.

    Raises
    ------
    MethodError
        If the log is too short.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign, fossen = reenact(duration=60.0), catalog["fossen"]
    >>> report = identifiability(prepare(campaign.vehicle, campaign.train, fossen), fossen)
    >>> len(report.grades), report.axes[0].rank
    (12, 2)
    """
    return _grade_by_weak_form(analyse_excitation(problem, model))


def grade_fit(problem: Problem, fit: Fit) -> Identifiability:
    """Grade each coefficient of a fit.

    Where the method replays held-out parts of the log, by the interval of the fit and, unless score
    tests find the form adequate, by the R² of the replays; for other methods, by the worse of that
    by the weak form and by the interval. On an axis on which terms are missing a coefficient that
    would be determined is weak: its interval covers the difference of two estimates that both lack
    the terms, not that to the physical value.

    Parameters
    ----------
    problem : Problem
        Vehicle and log that the fit was identified from.
    fit : Fit
        With finite coefficients.

    Returns
    -------
    identifiability : Identifiability
        As of :func:`identifiability`, which is returned where the fit has no covariance.

    Raises
    ------
    MethodError
        If the log is too short.
    """
    return _grade_fit(_excitation_of(problem, fit), fit)


#: A fit with its grades, and what these are of or why there are none; None if not needed.
GradedFit = tuple[Fit, "Identifiability | str | None"]


def add_grades(problem: Problem, fit: Fit) -> GradedFit:
    """Return a fit with grades, and what they are of or why there are none; None if not needed."""
    if fit.grades or not fit.status.usable or not fit.model.n_coefficients:
        return fit, None
    try:
        graded = grade_fit(with_estimated_vehicle(problem, fit), fit)
    except MethodError as error:  # the log is too short for grades
        return fit, str(error)
    return replace(fit, grades=graded.grades), graded


def _grade_fit(excitation: Excitation, fit: Fit) -> Identifiability:
    damping, known = fit.damping, fit.uncertainty
    if damping.covariance is None:
        return _grade_by_weak_form(excitation)
    known = known or Uncertainty(damping.covariance, np.inf, "the covariance given")
    half = known.critical_value() * known.standard_errors
    by_fit = grade_by_excitation(excitation, half, damping.coefficients)
    if fit.held_out_r_squared:
        missing = () if fit.adequacy is None else fit.adequacy.missing
        determined = by_fit.labels_with(Grade.DETERMINED)
        effective = (label for label in determined if label.partition("_")[0] in missing)
        weak = (*fit.indirect, *effective)
        return replace(by_fit, axes=tuple(_limit_to_weak(axis, weak) for axis in by_fit.axes))
    pairs = zip(_grade_by_weak_form(excitation).axes, by_fit.axes, strict=True)
    return replace(by_fit, axes=tuple(_worse(*pair) for pair in pairs))


def _excitation_of(problem: Problem, fit: Fit) -> Excitation:
    """Return the excitation that a fit shows by its held-out replays, or that of the weak form."""
    if fit.damping.covariance is None or not fit.held_out_r_squared:
        return analyse_excitation(problem, fit.model)
    free = fit.model.restricted_to(problem.vehicle.axes)
    extended = problem.extend_to(free)
    rows = _weak_equations(extended)[1].rows(extended)
    columns = [rows.basis.index(term) for term in free.basis]
    wrench = rows.design[:, columns] @ free.unpack(fit.damping.coefficients).T
    response = np.sqrt(np.mean(wrench**2, axis=0))
    r_squared = np.array([fit.held_out_r_squared.get(axis, 0.0) for axis in AXES])
    settings = problem.vehicle.axes, rows, rows.design, frozen(r_squared), frozen(response)
    is_adequate = fit.adequacy is not None and fit.adequacy.form is Form.ADEQUATE
    return Excitation(free, *settings, is_adequate)


def _limit_to_weak(axis: AxisIdentifiability, labels: tuple[str, ...]) -> AxisIdentifiability:
    """Return an axis on which these labels are weak or worse."""
    order = list(Grade)
    graded = zip(axis.labels, axis.grades, strict=True)
    grades = (
        max(grade, Grade.WEAK, key=order.index) if label in labels else grade
        for label, grade in graded
    )
    return replace(axis, grades=tuple(grades))


def _worse(first: AxisIdentifiability, second: AxisIdentifiability) -> AxisIdentifiability:
    """Return the worse of two grades of each coefficient, with its cause."""
    order = list(Grade)
    graded = [zip(axis.grades, axis.causes, strict=True) for axis in (first, second)]
    worse = [max(pair, key=lambda each: order.index(each[0])) for pair in zip(*graded, strict=True)]
    grades, causes = zip(*worse, strict=True)
    return replace(first, grades=grades, causes=causes)


def _grade_by_weak_form(excitation: Excitation) -> Identifiability:
    """Grade by the coefficients of the weak form and the noise alone."""
    rows, triangle = excitation.rows, excitation.rows.triangle()
    solutions = [solve_axis(triangle, terms, i) for i, terms in enumerate(excitation.model.terms)]
    covariance = HarCovariance.of(rows, triangle)
    known = covariance.uncertainty(
        solutions, reference_model(excitation.axes), errors_in_variables=True
    )
    if known is None:
        raise MethodError(
            f"{rows.n} rows are too few to separate noise from model-form error: use a longer log"
        )
    half = known.critical_value() * known.noise_only.standard_errors
    return grade_by_excitation(excitation, half)


def grade_by_excitation(
    excitation: Excitation, half: FloatArray, coefficients: FloatArray | None = None
) -> Identifiability:
    """Grade by half the width of each coefficient's 95 % interval."""
    model, rows = excitation.model, excitation.rows
    ends = np.cumsum([0, *map(len, model.terms)]).tolist()
    axes = []
    for axis, (start, stop) in enumerate(itertools.pairwise(ends)):
        if start == stop:
            continue
        labels, block = model.labels[start:stop], slice(start, stop)
        columns = [rows.basis.index(term) for term in model.terms[axis]]
        design = rows.design[:, columns]
        span = column_span(design, labels)
        aliased = {label for group in span.aliased for label in group}
        weights = span.coefficients @ span.directions.T
        values = weights @ rows.target[:, axis] if coefficients is None else coefficients[block]
        excited, r_squared = bool(excitation.excited[axis]), float(excitation.r_squared[axis])
        size, response = np.sqrt(np.mean(design**2, axis=0)), float(excitation.response[axis])
        sound = np.einsum("mn,nm->m", weights, excitation.excited_design[:, columns])
        is_aliased = np.array([label in aliased for label in labels])
        grades, causes = grade_coefficients(
            values, half[block], size, sound, is_aliased, response=response, excited=excited
        )
        condition = np.inf if aliased else float(span.singular[0] / span.singular[-1])
        regression = span.rank, condition, r_squared, excited, span.aliased
        axes.append(AxisIdentifiability(AXES[axis], labels, grades, *regression, causes))
    return Identifiability(model, tuple(axes))
