"""What a log determines: axes that respond to motion, rank and condition, a grade a coefficient."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Uncertainty
from hydrodamp.identification.har_covariance import HarCovariance, reference_model
from hydrodamp.identification.qr_factor import column_span, solve_axis
from hydrodamp.identification.regression_rows import Rows, Split, folds
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import TextEnum

#: Least share of the response that must be predicted: a correlation of one half between the
#: response predicted and the response seen.
MIN_R_SQUARED = 0.25

#: Length of the test functions [s]: some time constants of a small vehicle, so that noise of the
#: velocities, which dominates accelerations from sample to sample, is averaged out.
TEST_FUNCTION_LENGTH = 8.0

#: Shortest fold, in test functions.
_FOLD = 5.0

#: Test functions over an instant.
_OVERLAP = 4

#: Folds a long log is divided into.
_MOST_FOLDS = 10


@dataclass(frozen=True, eq=False)
class Excitation:
    """What the motion of a log tells, axis by axis."""

    model: DampingModel
    axes: tuple[str, ...]
    rows: Rows
    excited_design: FloatArray
    r_squared: FloatArray
    response: FloatArray

    @property
    def excited(self) -> BoolArray:
        """On which axes enough of the response is predicted; shape (6,)."""
        return self.r_squared >= MIN_R_SQUARED


def analyse_excitation(problem: Problem, model: DampingModel) -> Excitation:
    """Find how much of the motion on each axis equation 1 accounts for."""
    free = model.restricted_to(problem.vehicle.axes)
    rich = zip(AXES, reference_model(problem.vehicle.axes).terms, strict=True)
    both = free.with_terms({axis: " ".join(map(str, terms)) for axis, terms in rich if terms})
    wide = problem.extend_to(both)
    equations = WeakRegression(
        min(TEST_FUNCTION_LENGTH, float(wide.durations.max())), _OVERLAP, windows=()
    )
    rows = equations.rows(wide)
    response = equations.rows(_without_momentum(wide)).target
    variance = response.var(axis=0)
    share = _share(rows, (free, both), variance)
    quiet = equations.rows(_held(wide, share < MIN_R_SQUARED)).design
    return Excitation(
        model=free,
        axes=problem.vehicle.axes,
        rows=rows,
        excited_design=quiet,
        r_squared=frozen(share),
        response=frozen(np.sqrt(share * variance)),
    )


def _without_momentum(problem: Problem) -> Problem:
    """Cancel the momentum term by a wrench, so that targets are responses."""
    inputs = problem.inputs
    momentum = core.coriolis(problem.vehicle.mass_matrix, inputs.velocity)
    wrench = (inputs.wrench - momentum) * problem.vehicle.free
    return replace(problem, inputs=replace(inputs, wrench=wrench))


def _held(problem: Problem, held: BoolArray) -> Problem:
    """Hold some velocities at their mean."""
    velocity = problem.inputs.velocity
    quiet = np.where(held, velocity.mean(axis=0), velocity)
    return replace(problem, inputs=replace(problem.inputs, velocity=quiet))


def _share(rows: Rows, models: tuple[DampingModel, ...], variance: FloatArray) -> FloatArray:
    """Cross-validate each axis of each model, and take the better model."""
    length = sum(np.ptp(rows.time[rows.segment == one]) for one in np.unique(rows.segment))
    wanted = int(np.clip(length / (_FOLD * TEST_FUNCTION_LENGTH), 2, _MOST_FOLDS))
    splits = folds(rows, wanted, gap=TEST_FUNCTION_LENGTH).splits(rows)
    error = np.min([_missed(splits, model) for model in models], axis=0)
    moved = variance > 0.0
    return np.where(moved, np.clip(1.0 - error / np.where(moved, variance, 1.0), 0.0, 1.0), 0.0)


def _missed(splits: tuple[Split, ...], model: DampingModel) -> FloatArray:
    """Return the mean square of what each axis leaves of the folds held out."""
    squares = np.zeros(6)
    for split in splits:
        for axis, terms in enumerate(model.terms):
            found = solve_axis(split.train, terms, axis).coefficients
            left = split.test.target(axis) - split.test.columns(terms) @ found
            squares[axis] += np.sum(left**2)
    return squares / sum(split.test.n_samples for split in splits)


#: A 95 % interval of at most this share of the coefficient to either side determines it: the least
#: accuracy at which damping coefficients are worth comparing with others.
MAX_RELATIVE_HALF_WIDTH = 0.25

#: An interval that is worth at most this share of the axis' response leaves too little open to
#: matter, whatever the number is.
MINOR_CONTRIBUTION = 0.05

#: Least share of the leverage of a coefficient that must come from excited motion: below it, more
#: than half of what distinguishes its column from the others may be noise, which biases a
#: coefficient towards zero by that share (Fuller, "Measurement Error Models", 1987,
#: doi:10.1002/9780470316665, section 1.1).
MIN_MOTION_LEVERAGE = 0.5

_STAR = (
    "* the force is not predicted on stretches held out, for want of motion or of\n"
    "  the right terms; a replay, which sums it over time, may still be near"
)


class Grade(TextEnum):
    """How well a coefficient is determined; the value says what to do with it.

    Examples
    --------
    >>> Grade.NOT_DETERMINED.word
    'not determined'
    """

    DETERMINED = "determined: the number can be used."
    MINOR = (
        "minor: what its interval leaves open is worth less than "
        f"{100.0 * MINOR_CONTRIBUTION:.0f} % of the response of its axis; weak where the vehicle "
        "moves otherwise."
    )
    WEAK = "weak: sign and order of magnitude at best; use it with the whole model only."
    NOT_DETERMINED = "not determined: the data do not tell; take it from elsewhere or leave it out."


class Cause(TextEnum):
    """Why a coefficient is not determined, the first that holds; the value says what it means."""

    ALIASED = "aliased: its column is zero throughout or a sum of others."
    POORLY_EXCITED = (
        "quiet: too little of the force on its axis is predicted on stretches held out; a replay, "
        "which sums it over time, may still be near."
    )
    NOISE = "noise: what tells its column from others may be more noise than motion."
    NOT_SIGNIFICANT = "wide: its interval holds zero, and what it leaves open matters."
    MODEL_FORM = "model form: residuals persist on its axis, so no interval would hold."


@dataclass(frozen=True)
class AxisIdentifiability:
    """What a log determines on one axis."""

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
        """Return how many coefficients have a grade."""
        return self.grades.count(grade)

    def __str__(self) -> str:
        """Return a line for the table."""
        counts = "".join(f"{self.count(grade):>8}" for grade in Grade)
        return (
            f"{self.axis:<5}{self.rank:>4} of {len(self.labels):<4}{self.condition:>10.3g}"
            f"{100.0 * self.r_squared:>10.0f} %{counts}{'' if self.excited else ' *'}"
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
    def causes(self) -> dict[str, Cause]:
        """Why each coefficient that is not determined is not, by label."""
        pairs = (zip(one.labels, one.causes, strict=False) for one in self.axes)
        return {label: cause for label, cause in itertools.chain(*pairs) if cause}

    @property
    def summary(self) -> str:
        """How many coefficients have which grade."""
        counts = Counter(self.grades.values())
        total = ", ".join(f"{counts[grade]} {grade.word}" for grade in Grade)
        return f"{self.model.key}: {total}"

    def labels_with(self, grade: Grade) -> tuple[str, ...]:
        """Return the labels of a grade, in the model's order."""
        return tuple(label for label, given in self.grades.items() if given is grade)

    def __str__(self) -> str:
        """Return a table of the axes."""
        head = f"{'axis':<5}{'rank':>4}{'':<8}{'condition':>10}{'predicted':>12}"
        head += "".join(f"{word:>8}" for word in ("det.", "minor", "weak", "not"))
        lines = [self.summary, head, *map(str, self.axes)]
        if any(not one.excited for one in self.axes):
            lines.append(_STAR)
        return "\n".join(lines)


def identifiability(problem: Problem, model: DampingModel) -> Identifiability:
    """Grade how well a log determines each coefficient of a model, whatever the method.

    A coefficient is *not determined* where it is aliased, where its axis is not excited, where
    its column lives on velocities that are not, or where its interval tells nothing. It is
    *determined* where the interval is narrow against the coefficient, *minor* where it is narrow
    against what matters on the axis, and *weak* where it tells the sign. Coefficients and intervals
    are those of the weak form, from the noise that the model and the terms of Gertler and Hagen
    together leave over.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        Which terms.

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
    >>> found = identifiability(prepare(campaign.vehicle, campaign.train, fossen), fossen)
    >>> len(found.grades), found.axes[0].rank
    (12, 2)
    """
    return _by_log(analyse_excitation(problem, model))


def grade_fit(problem: Problem, fit: Fit) -> Identifiability:
    """Grade each coefficient of a fit by the log and by the fit's own interval; the worse holds.

    The noise and the manoeuvres of a log may determine a coefficient that a method, or a model
    of the wrong form, still gives with a wide interval. And an interval may be narrow where the
    log cannot tell one column from another, or hardly moved the axis.

    Parameters
    ----------
    problem : Problem
        Vehicle and log it was identified from.
    fit : Fit
        With numbers.

    Returns
    -------
    identifiability : Identifiability
        As of :func:`identifiability`; by the log alone where the fit has no standard errors.

    Raises
    ------
    MethodError
        If the log is too short.
    """
    seen = analyse_excitation(problem, fit.model)
    by_log, damping = _by_log(seen), fit.damping
    if damping.covariance is None:
        return by_log
    known = fit.uncertainty or Uncertainty(damping.covariance, np.inf, "the covariance given")
    by_fit = grade_by_excitation(
        seen, known.critical_value() * known.standard_errors, damping.coefficients
    )
    pairs = zip(by_log.axes, by_fit.axes, strict=True)
    return replace(by_log, axes=tuple(_worse(one, other) for one, other in pairs))


def _worse(one: AxisIdentifiability, other: AxisIdentifiability) -> AxisIdentifiability:
    """Take the worse of two grades of each coefficient, with its cause."""
    order = list(Grade)
    each = [zip(by.grades, by.causes, strict=True) for by in (one, other)]
    worse = [
        max(both, key=lambda rate_estimates: order.index(rate_estimates[0]))
        for both in zip(*each, strict=True)
    ]
    grades, causes = zip(*worse, strict=True)
    return replace(one, grades=grades, causes=causes)


def _by_log(seen: Excitation) -> Identifiability:
    """Grade by the weak form's own numbers and the noise alone."""
    triangle, rows = seen.rows.triangle(), enumerate(seen.model.terms)
    solved = [solve_axis(triangle, terms, axis) for axis, terms in rows]
    grams, rich = HarCovariance.of(seen.rows, triangle), reference_model(seen.axes)
    known = grams.uncertainty(solved, rich, noisy_terms=True)
    if known is None:
        raise MethodError(
            f"{seen.rows.n} rows are too few to tell noise from the model's form: give a longer log"
        )
    return grade_by_excitation(seen, known.critical_value() * known.noise_only.standard_errors)


def grade_by_excitation(
    seen: Excitation, half: FloatArray, coefficients: FloatArray | None = None
) -> Identifiability:
    """Grade by half the width of each coefficient's 95 % interval."""
    model, rows = seen.model, seen.rows
    ends = np.cumsum([0, *map(len, model.terms)]).tolist()
    axes = []
    for axis, (start, stop) in enumerate(itertools.pairwise(ends)):
        if start == stop:
            continue
        labels, part = model.labels[start:stop], slice(start, stop)
        columns = [rows.basis.index(term) for term in model.terms[axis]]
        design = rows.design[:, columns]
        span = column_span(design, labels)
        lost = {label for group in span.aliased for label in group}
        weights = span.coefficients @ span.directions.T
        known = weights @ rows.target[:, axis] if coefficients is None else coefficients[part]
        excited = bool(seen.excited[axis])
        grades, causes = grade_coefficients(
            coefficient=known,
            half=half[part],
            size=np.sqrt(np.mean(design**2, axis=0)),
            sound=np.einsum("mn,nm->m", weights, seen.excited_design[:, columns]),
            aliased=np.array([label in lost for label in labels]),
            response=float(seen.response[axis]),
            excited=excited,
        )
        axes.append(
            AxisIdentifiability(
                axis=AXES[axis],
                labels=labels,
                grades=grades,
                rank=span.rank,
                condition=np.inf if lost else float(span.singular[0] / span.singular[-1]),
                r_squared=float(seen.r_squared[axis]),
                excited=excited,
                groups=span.aliased,
                causes=causes,
            )
        )
    return Identifiability(model, tuple(axes))


def grade_coefficients(
    coefficient: FloatArray,
    half: FloatArray,
    size: FloatArray,
    sound: FloatArray,
    aliased: BoolArray,
    *,
    response: float,
    excited: bool,
) -> tuple[tuple[Grade, ...], tuple[Cause | None, ...]]:
    """Return the grade of each coefficient of one axis, and why one is not determined.

    By value and half of its interval, root mean square of its column, the share of its leverage
    that is excited motion, and whether it is aliased; then by the axis's response.
    """
    value = np.abs(coefficient)
    rungs = np.array(
        [
            half <= MAX_RELATIVE_HALF_WIDTH * value,
            half * size <= MINOR_CONTRIBUTION * response,
            half < value,
        ]
    )
    quiet = np.full(half.shape, not excited)
    blind = np.array(
        [aliased | (size == 0.0), quiet, sound < MIN_MOTION_LEVERAGE, ~rungs.any(axis=0)]
    )
    words = np.where(blind.any(axis=0), len(rungs), rungs.argmax(axis=0)).tolist()
    first = np.where(blind.any(axis=0), blind.argmax(axis=0), -1).tolist()
    causes = (*Cause, None)
    return tuple(tuple(Grade)[place] for place in words), tuple(causes[place] for place in first)
