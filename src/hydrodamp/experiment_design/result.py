"""A planned dive: commands and their times, the predicted track, and the predicted errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.excitation import Manoeuvre
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.identifiability import Cause, Grade, Identifiability, grade_fit
from hydrodamp.identification.output_error import Recommended
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.parallel import run_parallel
from hydrodamp.simulation.problem import prepare
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Prediction:
    """What the dive will say of one coefficient.

    Attributes
    ----------
    label : str
        Of the coefficient.
    value : float
        What is known of it; where nothing is, what a fit to the nominal member gives.
    before : float or None
        Its standard error before; None where it is not known.
    bound : float
        Cramer and Rao's bound of its standard error, from the noise of the sensors alone.
    after : float
        Standard error that ``identify`` will give from this dive alone.
    together : float
        With what was known before, as if its errors were independent.
    steps : float
        That from a dive of steps of the same length and envelope.
    grade : Grade
        What ``identify`` will say.
    cause : Cause or None
        Why it is not determined.
    """

    label: str
    value: float
    prior_std_error: float | None
    cramer_rao_bound: float
    std_error: float
    combined_std_error: float
    baseline_std_error: float
    grade: Grade
    cause: Cause | None


@dataclass(frozen=True)
class PlanSegment:
    """A manoeuvre of a dive: from when to when [s], on which course [rad]."""

    start: float
    end: float
    course: float
    manoeuvre: Manoeuvre


@dataclass(frozen=True)
class GoalDuration:
    """How long a dive must be for a goal, axis by axis [s]; None where it is out of reach."""

    goal: Grade
    duration_by_axis: dict[str, float | None]
    unreached: dict[str, str]


@dataclass(frozen=True, eq=False)
class DivePlan:
    """The next dive.

    Attributes
    ----------
    vehicle : Vehicle
        Who dives.
    model : DampingModel
        What is to be identified, restricted to the free axes.
    envelope : Envelope
        What the dive may do.
    known : str
        Where the coefficients it was planned with are from.
    time : ndarray, shape (n,)
        Of each line of the plan [s].
    orders : dict of str to ndarray, shape (n,)
        What to tell: ``speed`` [m/s] and the propeller's command, ``heading`` [rad], ``depth`` [m],
        and what to add to each other command (``rudder_overlay``).
    stretches : tuple of Stretch
        The manoeuvres.
    track : Log
        Predicted with the nominal damping, as the sensors record it.
    depths : ndarray, shape (n, 2)
        Band that holds the depth in 90 % of the draws [m].
    within : float
        Share of the draws that never leave the envelope.
    draws : int
        How many were simulated.
    mode : {"waypoints", "setpoints", "overlays"}
        How the dive is executed; the predictions are of the dive so executed.
    waypoints : ndarray, shape (m, 5), or None
        For that mode: expected time [s], north, east and depth [m], and the speed of the leg to
        each [m/s]. ``orders`` are then what guidance asks of the nominal member.
    saturated : dict of str to float
        Share of the time that each command is at its limit or rate limit, the mean of the draws.
    assumptions : tuple of str
        What was assumed because neither vehicle nor envelope states it.
    predictions : tuple of Prediction
        A coefficient each, in the model's order.
    reach : Reach or None
        For a goal.
    notes : tuple of str
        What else there is to know.
    """

    vehicle: Vehicle
    model: DampingModel
    envelope: Envelope
    prior: str
    time: FloatArray
    setpoints: dict[str, FloatArray]
    segments: tuple[PlanSegment, ...]
    track: Log
    depth_band: FloatArray
    feasibility_rate: float
    n_members: int
    mode: str
    waypoints: FloatArray | None
    saturation: dict[str, float]
    assumptions: tuple[str, ...]
    predictions: tuple[Prediction, ...]
    goal_duration: GoalDuration | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def duration(self) -> float:
        """How long the dive is [s]."""
        return float(self.time[-1])

    def labels_of_grade(self, grade: Grade) -> tuple[str, ...]:
        """Return the labels that will have a grade."""
        return tuple(one.label for one in self.predictions if one.grade is grade)

    def __str__(self) -> str:
        """Return what it will determine, in a sentence."""
        counts = ", ".join(f"{len(self.labels_of_grade(grade))} {grade.word}" for grade in Grade)
        return (
            f"A dive of {self.duration:.0f} s by {self.mode} for '{self.model.key}' on "
            f"{self.vehicle.name}: {counts}; "
            f"within its envelope in {100.0 * self.feasibility_rate:.0f} % of {self.n_members} "
            "draws."
        )


@dataclass(frozen=True, eq=False)
class MonteCarloVerification:
    """Estimates of the recommended method from simulated dives, one for each ensemble member.

    ``coefficients`` (n, p) and ``covariances`` (n, p, p) are as ``identify`` reports them.
    """

    coefficients: FloatArray
    covariances: FloatArray
    identifiability: tuple[Identifiability | None, ...]

    @property
    def std_errors(self) -> FloatArray:
        """Standard error to expect of each coefficient, the geometric mean over the members."""
        found: FloatArray = np.exp(0.5 * np.mean(np.log(np.einsum("npp->np", self.covariances)), 0))
        return found

    def grades(self, labels: Sequence[str]) -> list[Grade]:
        """Return the grade that at least half of the members give, or a better one."""
        order = list(Grade)
        found = [one.grades for one in self.identifiability if one is not None]
        return [
            order[int(np.median([order.index(one[label]) for one in found]) + 0.5)]
            if found
            else Grade.NOT_DETERMINED
            for label in labels
        ]

    def causes(self, labels: Sequence[str]) -> list[Cause | None]:
        """Return why coefficients are not determined, of the first member that says so."""
        found = [one.causes for one in self.identifiability if one is not None]
        return [next((one[label] for one in found if label in one), None) for label in labels]


def verify(
    closed_loop: ClosedLoopSimulator, trajectories: Trajectories, *, grading: bool = True
) -> MonteCarloVerification:
    """Identify the model from what each vehicle recorded, by the recommended method."""
    n = trajectories.states.shape[1]
    calls = [(closed_loop, trajectories.select([one]), grading) for one in range(n)]
    fits = run_parallel(_identified, calls)
    covariances = [fit.damping.covariance for fit, _ in fits]
    known = [one for one in covariances if one is not None]
    found = [fit.damping.coefficients for fit, _ in fits]
    return MonteCarloVerification(
        np.array(found), np.array(known), tuple(grades for _, grades in fits)
    )


def _identified(
    closed_loop: ClosedLoopSimulator, trajectories: Trajectories, grading: bool
) -> tuple[Fit, Identifiability | None]:
    log = trajectories.log(closed_loop.vehicle, closed_loop.autopilot.names)
    problem = prepare(closed_loop.vehicle, log, closed_loop.ensemble.model)
    fit = Recommended().identify(problem, closed_loop.ensemble.model)
    return fit, grade_fit(problem, fit) if grading and fit.status.usable else None
