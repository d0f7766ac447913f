"""The plan of the next dive, from what is known and what it may do."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError, demand, no_such
from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.context import CandidateDive, PlanningContext
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.optimiser import Criterion, Optimiser
from hydrodamp.experiment_design.preparation import Mode
from hydrodamp.experiment_design.result import (
    DivePlan,
    GoalDuration,
    MonteCarloVerification,
    PlanSegment,
    Prediction,
    verify,
)
from hydrodamp.experiment_design.shortest import shortest_duration
from hydrodamp.identification.identifiability import Grade
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.progress import progress
from hydrodamp.vehicle.vehicle import Vehicle

#: Members of the ensemble that a dive is optimised for, and identified from.
_SEARCHED, VERIFIED_MEMBERS = 3, slice(4)

#: Dives of more stretches than this simulate each manoeuvre twice.
_ONCE = 6

#: Shortest and longest dive [s].
_LEAST, _MOST = 60.0, 86400.0

_NO_BETTER = "No manoeuvres determine more than a campaign of steps commanded by setpoints: "

_BY_MODEL = "more of the residuals is the form of the model than noise. Try a model with more terms"

_BY_WAYPOINTS = f"waypoints carry none that are quicker than a leg, or {_BY_MODEL}, or another mode"

CRITERIA = get_args(Criterion)
"""What a dive may minimise."""

MODES = get_args(Mode)
"""How a dive may be executed."""

GOALS = tuple(grade.word for grade in list(Grade)[:3])
"""Grades that a dive may be planned for."""


def plan(
    vehicle: Vehicle,
    model: DampingModel,
    duration: float,
    *,
    damping: Damping | None = None,
    envelope: Envelope | None = None,
    goal: str | None = None,
    criterion: Criterion = "determinant",
    mode: Mode | None = None,
    seed: int = 0,
) -> DivePlan:
    """Plan the dive that tells most of a model's coefficients.

    Parameters
    ----------
    vehicle : Vehicle
        With actuators, or a model and ``damping`` that have gains of commands.
    model : DampingModel
        What is to be identified.
    duration : float
        Length of the dive, 60 to 86400 [s]; with a goal the longest that may be.
    damping : Damping, optional
        What is known, best with its covariance, such as an earlier fit. By default a published set
        of the vehicle, else what the size of its hull tells.
    envelope : Envelope, optional
        What the dive may do.
    goal : {"determined", "minor", "weak"}, optional
        Plan the shortest dive that brings every coefficient to this grade, if it can.
    criterion : {"determinant", "worst", "replay"}
        What is made small: the volume of the coefficients' errors, the worst of them against what
        their grade allows, or the expected error of a replay (eq. 24).
    mode : {"waypoints", "setpoints", "overlays"}, optional
        How the dive is executed: along waypoints, by setpoints of speed, heading and depth, or by
        setpoints with excitation added to each other command. Standard errors are those of the
        dive so executed. By default setpoints where a propeller drives the vehicle and its
        heading is steered, else overlays.
    seed : int, optional
        Of draws and noise.

    Returns
    -------
    plan : DivePlan
        The same for the same arguments.

    Raises
    ------
    ModelError
        If nothing in the envelope excites a term, or ``damping`` is of another mass matrix.
    ProblemError
        If nothing can be steered, a speed is out of reach, no dive keeps to the envelope, or the
        vehicle cannot execute the mode.
    MethodError
        If an argument is out of range.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> hd.plan(hd.fleet["vt690"], hd.catalog["fossen"], 10.0)
    Traceback (most recent call last):
        ...
    hydrodamp.errors.MethodError: `duration` must be from 60 s to 86400 s (24 h); got 10.0
    """
    longest = f"from {_LEAST:g} s to {_MOST:g} s (24 h)"
    demand(_LEAST <= duration <= _MOST, "duration", longest, duration)
    demand(seed >= 0, "seed", "0 or more", seed)
    if goal is not None and goal not in GOALS:
        raise MethodError(no_such("goal", goal, GOALS))
    demand(mode is None or mode in MODES, "mode", " or ".join(MODES), mode)
    demand(criterion in CRITERIA, "criterion", " or ".join(CRITERIA), criterion)
    context = PlanningContext.of(
        vehicle, model, duration, damping, envelope or Envelope(), seed, mode
    )
    by_steps = context.enforce_envelope(context.baseline, baseline=True)
    steps = verify(
        context.closed_loop, by_steps.trajectories.select(VERIFIED_MEMBERS), grading=False
    )
    candidate = optimise(context, "worst" if goal else criterion, steps, by_steps)
    fits = verify(context.closed_loop, candidate.trajectories.select(VERIFIED_MEMBERS))
    notes: tuple[str, ...] = ()
    if np.mean(np.log(fits.std_errors)) > np.mean(np.log(steps.std_errors)):
        # By waypoints the steps themselves may determine less than the manoeuvres do.
        executed = context.enforce_envelope(context.baseline)
        others = verify(context.closed_loop, executed.trajectories.select(VERIFIED_MEMBERS))
        notes = (f"{_NO_BETTER}{_BY_WAYPOINTS if context.mode == 'waypoints' else _BY_MODEL}.",)
        if np.mean(np.log(others.std_errors)) <= np.mean(np.log(fits.std_errors)):
            candidate, fits = executed, others
    some, reach = candidate.trajectories.select(VERIFIED_MEMBERS), None
    if goal is not None:
        n = len(candidate.manoeuvres)
        reach, n, fits = shortest_duration(context, goal, n, some, fits)
        candidate = candidate.until(n, context.samples)
    return replace(_plan_of(context, candidate, fits, steps, reach), notes=notes)


def optimise(
    context: PlanningContext,
    criterion: Criterion,
    steps: MonteCarloVerification,
    by_steps: CandidateDive,
) -> CandidateDive:
    """Search manoeuvres; of a long dive the second half mirrors the first."""
    times = 2 if context.n_segments > _ONCE else 1
    n = -(-context.n_segments // times)
    few = context.closed_loop.with_members([*range(_SEARCHED)])
    aim = context.objective(criterion, context.wider(steps, by_steps.trajectories))
    with progress("searching manoeuvres", n) as step:
        radius = context.acceptance if context.mode == "waypoints" else None
        optimiser = Optimiser(few, context.error_model, aim, context.samples, radius)
        found = optimiser.optimise_dive(n, context.seed, step)
    both = found + [one.mirrored for one in found] * (times - 1)
    return context.enforce_envelope(both[: context.n_segments])


def _plan_of(
    context: PlanningContext,
    candidate: CandidateDive,
    fits: MonteCarloVerification,
    steps: MonteCarloVerification,
    reach: GoalDuration | None,
) -> DivePlan:
    """Return the plan of what was found."""
    closed_loop, length = context.closed_loop, context.segment_duration
    pairs = zip(candidate.manoeuvres, candidate.courses.tolist(), strict=True)
    depths = np.quantile(candidate.trajectories.states[:, :, 11], [0.05, 0.95], axis=1).T
    return DivePlan(
        vehicle=closed_loop.vehicle,
        model=context.model,
        envelope=closed_loop.envelope,
        prior=context.prior.source or "the damping given",
        time=np.asarray(
            closed_loop.envelope.period * np.arange(len(candidate.overlays)), dtype=np.float64
        ),
        setpoints=_orders(context, candidate),
        segments=tuple(
            PlanSegment(n * length, (n + 1) * length, course, one)
            for n, (one, course) in enumerate(pairs)
        ),
        track=candidate.trajectories.select([0]).log(
            closed_loop.vehicle, closed_loop.autopilot.names
        ),
        depth_band=depths,
        feasibility_rate=candidate.feasibility_rate,
        n_members=len(closed_loop.matrices),
        mode=context.mode,
        waypoints=candidate.waypoints,
        saturation=candidate.saturation,
        assumptions=closed_loop.autopilot.assumptions,
        predictions=_predictions(context, candidate.trajectories, fits, steps),
        goal_duration=reach,
    )


def _orders(context: PlanningContext, candidate: CandidateDive) -> dict[str, FloatArray]:
    """Return what to tell by name: setpoints that a loop follows, the propeller, overlays."""
    autopilot, setpoints, orders = (
        context.closed_loop.autopilot,
        candidate.trajectories.setpoints[:, 0],
        {},
    )
    if autopilot.propeller is not None:
        orders["speed"] = setpoints[:, 0]
        driving = np.clip(autopilot.driving(setpoints[:, 0]), *autopilot.band(autopilot.propeller))
        orders[autopilot.names[autopilot.propeller]] = driving
    if autopilot.heading is not None:
        orders["heading"] = np.angle(np.exp(1j * setpoints[:, 1]))
    if autopilot.depth is not None:
        orders["depth"] = setpoints[:, 2]
    added = {
        f"{autopilot.names[place]}_overlay": candidate.overlays[:, place]
        for place in autopilot.overlays
    }
    return orders | added


def _predictions(
    context: PlanningContext,
    trajectories: Trajectories,
    fits: MonteCarloVerification,
    steps: MonteCarloVerification,
) -> tuple[Prediction, ...]:
    """Return what the dive will say of each coefficient."""
    labels, before = context.model.labels, context.prior_std_errors
    errors, bound, by_steps = (
        fits.std_errors,
        context.cramer_rao_bound(trajectories),
        steps.std_errors,
    )
    together = (errors**-2.0 + before**-2.0) ** -0.5
    values = context.expected_coefficients(fits)
    grades, causes = fits.grades(labels), fits.causes(labels)
    return tuple(
        Prediction(
            label=label,
            value=float(values[place]),
            prior_std_error=float(before[place]) if np.isfinite(before[place]) else None,
            cramer_rao_bound=float(bound[place]),
            std_error=float(errors[place]),
            combined_std_error=float(together[place]),
            baseline_std_error=float(by_steps[place]),
            grade=grades[place],
            cause=causes[place] if grades[place] is Grade.NOT_DETERMINED else None,
        )
        for place, label in enumerate(labels)
    )
