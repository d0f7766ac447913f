"""Monte Carlo verification of a dive: simulated logs of ensemble members are identified.

The predicted standard error of a coefficient is the geometric mean of those that the recommended
method reports for the members; the predicted grade is the median of their grades.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.result import GoalDuration
from hydrodamp.identification.fit import Fit, critical_value as critical_value
from hydrodamp.identification.identifiability import (
    MAX_RELATIVE_HALF_WIDTH,
    Cause,
    Grade,
    Identifiability,
    grade_fit,
)
from hydrodamp.identification.output_error import Recommended
from hydrodamp.simulation.parallel import run_parallel
from hydrodamp.simulation.problem import prepare

N_DURATIONS = 5
"""Durations that are tried for a goal: a fifth of the dive, two fifths, and so on."""

MAX_HOURS = 10.0
"""Extrapolated durations beyond this are reported as more than it [h]."""


@dataclass(frozen=True, eq=False)
class MonteCarloVerification:
    """Estimates of the recommended method from simulated dives, one for each member.

    ``coefficients`` (n, p) and ``covariances`` (n, p, p) are as ``identify`` reports them.
    """

    coefficients: FloatArray
    covariances: FloatArray
    identifiability: tuple[Identifiability | None, ...]

    @property
    def std_errors(self) -> FloatArray:
        """Predicted standard errors: the geometric mean over the members, shape (p,)."""
        variances = np.einsum("npp->np", self.covariances)
        return np.asarray(np.exp(0.5 * np.mean(np.log(variances), axis=0)))

    def grades(self, labels: Sequence[str]) -> list[Grade]:
        """Return the grade, or a better one, that at least half of the members give."""
        order = list(Grade)
        graded = [item.grades for item in self.identifiability if item is not None]
        if not graded:
            return [Grade.NOT_DETERMINED for _ in labels]
        ranks = [[order.index(grades[label]) for grades in graded] for label in labels]
        return [order[int(np.median(row) + 0.5)] for row in ranks]

    def causes(self, labels: Sequence[str]) -> list[Cause | None]:
        """Return why coefficients are not determined, of the first member that has a cause."""
        causes = [item.causes for item in self.identifiability if item is not None]
        return [next((item[label] for item in causes if label in item), None) for label in labels]


def verify(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, *, grading: bool = True
) -> MonteCarloVerification:
    """Identify the model from the log of each vehicle by the recommended method."""
    n = trajectories.states.shape[1]
    calls = [(simulator, trajectories.select([index]), grading) for index in range(n)]
    fits, grades = zip(*run_parallel(_identify, calls), strict=True)
    covariances = [fit.damping.covariance for fit in fits if fit.damping.covariance is not None]
    coefficients = np.array([fit.damping.coefficients for fit in fits])
    return MonteCarloVerification(coefficients, np.array(covariances), grades)


def _identify(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, grading: bool
) -> tuple[Fit, Identifiability | None]:
    log = trajectories.log(simulator.vehicle, simulator.autopilot.names)
    problem = prepare(simulator.vehicle, log, simulator.ensemble.model)
    fit = Recommended().identify(problem, simulator.ensemble.model)
    return fit, grade_fit(problem, fit) if grading and fit.status.usable else None


def expected_coefficients(
    context: PlanningContext, verification: MonteCarloVerification
) -> FloatArray:
    """Return the prior's coefficients; where it has none, the estimate for the nominal member."""
    known = [label in context.prior.model.labels for label in context.model.labels]
    return np.where(known, context.prior_coefficients, verification.coefficients[0])


def shortest_duration(
    context: PlanningContext,
    goal: str,
    n_segments: int,
    trajectories: Trajectories,
    full: MonteCarloVerification,
) -> tuple[GoalDuration, int, MonteCarloVerification]:
    """Return the shortest duration by axis for a grade; number of segments and verification."""
    grade = next(item for item in Grade if item.word == goal)
    order, labels = list(Grade), context.model.labels
    lengths = {max(2, -(-n_segments * k // N_DURATIONS)) for k in range(1, N_DURATIONS)}
    verifications = {
        n: verify(context.simulator, trajectories.until(n * context.samples))
        for n in sorted(lengths - {n_segments})
    } | {n_segments: full}
    reached = {
        n: np.array([order.index(item) <= order.index(grade) for item in result.grades(labels)])
        for n, result in verifications.items()
    }
    reachable, axes = reached[n_segments], np.array([label[0] for label in labels])

    def shortest(selected: np.ndarray) -> int:
        return next(n for n, is_reached in reached.items() if np.all(is_reached[selected]))

    duration_by_axis: dict[str, float | None] = {}
    for axis in dict.fromkeys(axes.tolist()):
        selected = reachable & (axes == axis)
        length = shortest(selected) * context.segment_duration if selected.any() else None
        duration_by_axis[axis] = length
    n = shortest(reachable) if reachable.any() else n_segments
    causes, minutes = full.causes(labels), n_segments * context.segment_duration / 60.0
    values, std_errors = expected_coefficients(context, full).tolist(), full.std_errors.tolist()
    unreached = {
        label: _explain(values[index], std_errors[index], causes[index], minutes, grade)
        for index, label in enumerate(labels)
        if not reachable[index]
    }
    return GoalDuration(grade, duration_by_axis, unreached), n, verifications[n]


def _explain(
    value: float, std_error: float, cause: Cause | None, minutes: float, goal: Grade
) -> str:
    """Return why a coefficient does not reach a grade in some minutes, and how long it takes."""
    if cause is not None and cause is not Cause.NOT_SIGNIFICANT:
        return str(cause.value)
    half_width, size = critical_value() * std_error, max(abs(value), 1e-12)
    target = MAX_RELATIVE_HALF_WIDTH if goal is Grade.DETERMINED else 1.0
    interval = (
        f"the confidence interval +-{half_width:.2g} is {half_width / size:.0%} of {value:.3g}"
    )
    if half_width <= target * size:
        return f"{interval}, which is enough, but the weak form, which grades the log, differs."
    required = (half_width / target / size) ** 2 * minutes
    is_long = required >= 60.0 * MAX_HOURS
    duration = f"more than {MAX_HOURS:.0f} h" if is_long else f"{required:.0f} min"
    return (
        f"{interval}; standard errors fall with the root of time, so it takes {duration}, or more "
        "speed and larger angles than the envelope permits."
    )
