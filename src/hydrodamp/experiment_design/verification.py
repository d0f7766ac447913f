"""Monte Carlo verification of a dive: chance constraint, and predicted standard errors.

A dive is feasible if P(g_i <= 0 for every limit i at every sample) >= 0.95; the probability is
estimated by the share of ensemble members that satisfy it, the feasibility rate. Segments of an
infeasible dive are attenuated or slowed down.

Simulated logs of some members are identified: the predicted standard error of a coefficient is the
geometric mean of those that the recommended method reports, the predicted grade the median of the
grades. The members that steer the attenuation also give the reported feasibility rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.envelope import Area
from hydrodamp.experiment_design.guidance import (
    CourseGuidance,
    Manoeuvre,
    follow_tracks,
    join_setpoints,
)
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Cause, Grade
from hydrodamp.identification.identifiability import Identifiability, grade_fit
from hydrodamp.identification.output_error import Recommended
from hydrodamp.progress import run_parallel
from hydrodamp.simulation.problem import prepare

MIN_FEASIBILITY_RATE = 0.95
"""Share of the members that must satisfy all constraints."""

ATTENUATION, MAX_ATTENUATIONS = 0.8, 12
"""Factor on a segment that violates a limit, and how often it is applied at most."""

AREA_SLOWDOWN = 0.9
"""Factor on the speed of all segments where the area is violated."""

RESPONSE_TIME = 5.0
"""Time after a segment in which it can cause a violation [s]; assumed."""


@dataclass(frozen=True, eq=False)
class FeasibleDive:
    """A dive simulated for the whole ensemble.

    ``feasibility_rate`` is the share of members that satisfy all constraints, ``saturation`` the
    share of time at a limit by command, ``waypoints`` (m, 5) replace setpoints.
    """

    manoeuvres: list[Manoeuvre]
    overlays: FloatArray
    courses: FloatArray
    trajectories: Trajectories
    feasibility_rate: float
    saturation: dict[str, float]
    waypoints: FloatArray | None = None


def enforce_envelope(
    context: PlanningContext, manoeuvres: list[Manoeuvre], *, baseline: bool = False
) -> FeasibleDive:
    """Attenuate manoeuvres until the ensemble satisfies the chance constraint.

    The baseline is executed by setpoints in every mode.
    """
    simulator = context.simulator
    envelope, autopilot, n = simulator.envelope, simulator.autopilot, simulator.n_members
    by_waypoints = context.mode == "waypoints" and not baseline
    moves = np.array([float(autopilot.propeller is not None), 1.0, 1.0])
    drift, message = np.zeros((len(manoeuvres), 1, 1, 2)), ""
    for _ in range(MAX_ATTENUATIONS):
        setpoints, overlays = join_setpoints(manoeuvres, autopilot, envelope, context.samples)
        by_segment = (moves * setpoints).reshape(len(manoeuvres), context.samples, 3)
        course = CourseGuidance(envelope.area, by_segment, envelope.period, drift)
        waypoints: FloatArray | None = None
        excitation = setpoints[:, None], overlays[:, None]
        if by_waypoints:
            planned = simulator.with_members([0]).simulate(excitation, None, course)
            trajectories, (waypoints, *_) = follow_tracks(
                simulator, planned, context.acceptance_radius, context.seed
            )
        else:
            planned = trajectories = simulator.simulate(excitation, context.seed, course)
        violations = trajectories.limit_violations(envelope)
        violated = {name: np.any(g > 0.0, axis=0) for name, g in violations.items()}
        feasibility_rate = 1.0 - float(np.mean(np.any([*violated.values()], axis=0)))
        if feasibility_rate >= MIN_FEASIBILITY_RATE:
            shares = trajectories.saturation(autopilot).items()
            return FeasibleDive(
                *(manoeuvres, overlays, np.array(course.courses), trajectories),
                *(feasibility_rate, {name: float(np.mean(share)) for name, share in shares}),
                waypoints,
            )
        name = max(violated, key=lambda limit: float(np.mean(violated[limit])))
        message = (
            f"`{name}` is violated in {np.mean(violated[name]):.0%} of the ensemble, by up to "
            f"{violations[name].max():.0%}"
        )
        drift = course.update_drift(planned)
        # The members of largest violation, which may be infeasible, do not count.
        worst = np.max([g.max(axis=0) for g in violations.values()], axis=0)
        counted = np.argsort(worst)[: int(np.ceil(MIN_FEASIBILITY_RATE * n))]
        manoeuvres = _attenuate(
            context, manoeuvres, {name: g[:, counted] for name, g in violations.items()}
        )
    raise ProblemError(
        f"no feasible dive: after {MAX_ATTENUATIONS} attenuations {message}. Widen that limit, "
        "raise the lowest `speed`, or check the autopilot's gains."
    )


def _attenuate(
    context: PlanningContext, manoeuvres: list[Manoeuvre], violations: dict[str, FloatArray]
) -> list[Manoeuvre]:
    """Slow down segments that are too fast; attenuate those that violate other limits.

    Where the area is violated, all are slowed down: each starts where the last one ends.
    """
    if any(np.max(violations[name]) > 0.0 for name in Area.model_fields if name in violations):
        manoeuvres = [manoeuvre.slow_down(AREA_SLOWDOWN) for manoeuvre in manoeuvres]
    angles = np.max([violations[name] for name in ("depth", "pitch", "roll")], axis=0)
    fast = _segments_of(context, violations["speed"] > 0.0)
    strong = _segments_of(context, angles > 0.0)
    if context.simulator.autopilot.propeller is None:
        # Without a speed setpoint the excitation alone determines the speed.
        strong, fast = strong | fast, np.zeros_like(fast)
    for is_violated, change in ((fast, Manoeuvre.slow_down), (strong, Manoeuvre.attenuate)):
        pairs = zip(manoeuvres, is_violated, strict=True)
        manoeuvres = [change(item, ATTENUATION) if flag else item for item, flag in pairs]
    return manoeuvres


def _segments_of(context: PlanningContext, violated: BoolArray) -> BoolArray:
    """Return the segments in which, or shortly after which, a member violates a limit."""
    shift = round(RESPONSE_TIME / context.simulator.envelope.period)
    late = np.roll(violated.any(axis=1), -shift)
    return np.asarray(late.reshape(-1, context.samples).any(axis=1))


@dataclass(frozen=True, eq=False)
class SimulatedEstimates:
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

    @property
    def log_std_error(self) -> float:
        """Logarithm of the geometric mean of the standard errors of all coefficients."""
        return float(np.mean(np.log(self.std_errors)))

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


def identify_simulated_logs(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, *, grading: bool = True
) -> SimulatedEstimates:
    """Identify the model from the log of each vehicle by the recommended method."""
    n = trajectories.states.shape[1]
    calls = [(simulator, trajectories.select([index]), grading) for index in range(n)]
    fits, grades = zip(*run_parallel(_identify, calls), strict=True)
    covariances = [fit.damping.covariance for fit in fits if fit.damping.covariance is not None]
    coefficients = np.array([fit.damping.coefficients for fit in fits])
    return SimulatedEstimates(coefficients, np.array(covariances), grades)


def _identify(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, grading: bool
) -> tuple[Fit, Identifiability | None]:
    log = trajectories.log(simulator.vehicle, simulator.autopilot.names)
    problem = prepare(simulator.vehicle, log, simulator.ensemble.model)
    fit = Recommended().identify(problem, simulator.ensemble.model)
    return fit, grade_fit(problem, fit) if grading and fit.status.usable else None
