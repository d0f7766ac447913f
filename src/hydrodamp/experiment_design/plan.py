"""Plan of the next dive: greedy pseudo-Bayesian optimal experiment design with a chance constraint.

The manoeuvres minimise the determinant of the expected covariance, which is the mean logarithm of
standard errors of uncorrelated coefficients, over a Monte Carlo ensemble of damping (D-optimality).
The dive is then attenuated until 95 % of the members keep the envelope. Predicted standard errors
are those of simulated and identified logs.
"""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import demand
from hydrodamp.experiment_design import optimise as design
from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.context import Mode, PlanningContext, limit_by_log
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.result import DivePlan, PlanSegment, Prediction
from hydrodamp.experiment_design.verification import (
    FeasibleDive,
    SimulatedEstimates,
    enforce_envelope,
    identify_simulated_logs,
)
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.progress import progress
from hydrodamp.vehicle.vehicle import Vehicle

N_OPTIMISED, VERIFIED_MEMBERS = 3, slice(4)
"""Members with which a dive is optimised; those whose logs are identified."""

MAX_DISTINCT_SEGMENTS = 6
"""The second half of a dive of more segments mirrors the first."""

DURATION_LIMITS = 60.0, 86400.0
"""Shortest and longest dive [s]."""

MODES = get_args(Mode)
"""How a dive may be executed."""

_NOT_BETTER = "No manoeuvres have smaller standard errors than steps commanded by setpoints: "

_CAUSE = "the model-form error exceeds the noise in the residuals. Try a model with more terms"

_WAYPOINT_CAUSE = (
    f"waypoints permit no manoeuvre that is quicker than a leg, or {_CAUSE}, or another mode"
)


def plan(
    vehicle: Vehicle,
    model: DampingModel,
    duration: float,
    *,
    damping: Damping | None = None,
    envelope: Envelope | None = None,
    mode: Mode | None = None,
    seed: int = 0,
    fit: Fit | None = None,
) -> DivePlan:
    """Plan the dive that is optimal for the identification of a model (optimal experiment design).

    Parameters
    ----------
    vehicle : Vehicle
        With actuators, or a model and ``damping`` that have gains of commands.
    model : DampingModel
        The model to identify.
    duration : float
        Duration of the dive, 60 to 86400 [s].
    damping : Damping, optional
        The prior, best with its covariance, such as an earlier fit. By default a published set of
        the vehicle, else an estimate from the size of its hull.
    envelope : Envelope, optional
        Constraints of the dive.
    mode : {"waypoints", "setpoints", "overlays"}, optional
        How the dive is executed: along waypoints, by setpoints of speed, heading and depth, or by
        setpoints with excitation added to each other command. Standard errors hold for that
        mode. By default setpoints where a propeller drives the vehicle and its
        heading is steered, else overlays.
    seed : int, optional
        Seed of the ensemble and of the noise.
    fit : Fit, optional
        An earlier fit: its damping is the prior by default. Without speeds of the envelope, they
        are those of its log; commands without limits keep to their range in its log.

    Returns
    -------
    plan : DivePlan
        The same for the same arguments.

    Raises
    ------
    ModelError
        If a term is not identifiable in the envelope, or ``damping`` has another mass matrix.
    ProblemError
        If the vehicle cannot be steered, a speed is not reachable, no dive is feasible, or the
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
    allowed = f"from {DURATION_LIMITS[0]:g} s to {DURATION_LIMITS[1]:g} s (24 h)"
    demand(DURATION_LIMITS[0] <= duration <= DURATION_LIMITS[1], "duration", allowed, duration)
    demand(seed >= 0, "seed", "0 or more", seed)
    demand(mode is None or mode in MODES, "mode", " or ".join(MODES), mode)
    envelope = envelope or Envelope()
    if fit is not None:
        damping, envelope = damping or fit.damping, limit_by_log(vehicle, envelope, fit)
    context = PlanningContext.of(vehicle, model, duration, damping, envelope, seed, mode)

    def verify_dive(dive: FeasibleDive, *, grading: bool = True) -> SimulatedEstimates:
        trajectories = dive.trajectories.select(VERIFIED_MEMBERS)
        return identify_simulated_logs(context.simulator, trajectories, grading=grading)

    baseline_dive = enforce_envelope(context, context.baseline, baseline=True)
    baseline = verify_dive(baseline_dive, grading=False)
    dive = optimise(context, baseline, baseline_dive)
    result = verify_dive(dive)
    notes: tuple[str, ...] = ()
    if not result.log_std_error <= baseline.log_std_error:
        # In waypoint mode the executed baseline may determine less than the manoeuvres do.
        executed = enforce_envelope(context, context.baseline)
        executed_result = verify_dive(executed)
        notes = (f"{_NOT_BETTER}{_WAYPOINT_CAUSE if context.mode == 'waypoints' else _CAUSE}.",)
        if not result.log_std_error < executed_result.log_std_error:
            dive, result = executed, executed_result
    grades = {} if fit is None else fit.grades
    return replace(_make_plan(context, dive, result, baseline), notes=notes, grades=grades)


def optimise(
    context: PlanningContext, baseline: SimulatedEstimates, baseline_dive: FeasibleDive
) -> FeasibleDive:
    """Optimise the manoeuvres; the second half of a long dive mirrors the first."""
    is_long = context.n_segments > MAX_DISTINCT_SEGMENTS
    n = -(-context.n_segments // 2) if is_long else context.n_segments
    inflation = context.std_error_inflation(baseline.std_errors, baseline_dive.trajectories)
    optimiser = design.Optimiser(
        context.simulator.with_members([*range(N_OPTIMISED)]),
        *(context.time_scale, context.samples, context.prior_information, inflation),
        context.acceptance_radius if context.mode == "waypoints" else None,
    )
    with progress("optimising manoeuvres", n) as step:
        manoeuvres = optimiser.optimise_dive(n, context.seed, step)
    if n < context.n_segments:
        manoeuvres += [manoeuvre.attenuate(-1.0) for manoeuvre in manoeuvres]
    return enforce_envelope(context, manoeuvres[: context.n_segments])


def _make_plan(
    context: PlanningContext,
    dive: FeasibleDive,
    result: SimulatedEstimates,
    baseline: SimulatedEstimates,
) -> DivePlan:
    simulator, length = context.simulator, context.segment_duration
    vehicle, envelope, autopilot = simulator.vehicle, simulator.envelope, simulator.autopilot
    pairs = zip(dive.manoeuvres, dive.courses.tolist(), strict=True)
    return DivePlan(
        vehicle=vehicle,
        model=context.model,
        envelope=envelope,
        prior=context.prior.source or "the given damping",
        time=np.asarray(envelope.period * np.arange(len(dive.overlays)), dtype=np.float64),
        setpoints=_setpoints(context, dive),
        segments=tuple(
            PlanSegment(n * length, (n + 1) * length, course, manoeuvre)
            for n, (manoeuvre, course) in enumerate(pairs)
        ),
        track=dive.trajectories.select([0]).log(vehicle, autopilot.names),
        depth_band=np.quantile(dive.trajectories.states[:, :, 11], [0.05, 0.95], axis=1).T,
        feasibility_rate=dive.feasibility_rate,
        n_members=simulator.n_members,
        mode=context.mode,
        waypoints=dive.waypoints,
        saturation=dive.saturation,
        assumptions=autopilot.assumptions,
        predictions=_predictions(context, dive.trajectories, result, baseline),
    )


def _setpoints(context: PlanningContext, dive: FeasibleDive) -> dict[str, FloatArray]:
    """Return setpoints of loops, the propeller's command, and overlays, by name."""
    autopilot, setpoints = context.simulator.autopilot, dive.trajectories.setpoints[:, 0]
    columns: dict[str, FloatArray] = {}
    if (propeller := autopilot.propeller) is not None:
        columns["speed"] = setpoints[:, 0]
        limits = autopilot.lowest[propeller], autopilot.highest[propeller]
        command = np.clip(autopilot.propeller_command(setpoints[:, 0]), *limits)
        columns[autopilot.names[propeller]] = command
    if autopilot.heading is not None:
        columns["heading"] = np.angle(np.exp(1j * setpoints[:, 1]))
    if autopilot.depth is not None:
        columns["depth"] = setpoints[:, 2]
    for index in autopilot.overlays:
        columns[f"{autopilot.names[index]}_overlay"] = dive.overlays[:, index]
    return columns


def _predictions(
    context: PlanningContext,
    trajectories: Trajectories,
    result: SimulatedEstimates,
    baseline: SimulatedEstimates,
) -> tuple[Prediction, ...]:
    labels, prior, std_errors = context.model.labels, context.prior_std_errors, result.std_errors
    is_known = [label in context.prior.model.labels for label in labels]
    numbers = (
        context.cramer_rao_bound(trajectories),
        std_errors,
        (std_errors**-2.0 + prior**-2.0) ** -0.5,
        baseline.std_errors,
    )
    values = np.where(is_known, context.prior_coefficients, result.coefficients[0]).tolist()
    known_errors = [std if np.isfinite(std) else None for std in prior.tolist()]
    grades = result.grades(labels)
    pairs = zip(grades, result.causes(labels), strict=True)
    causes = [cause if grade is Grade.NOT_DETERMINED else None for grade, cause in pairs]
    columns = values, known_errors, *(each.tolist() for each in numbers), grades, causes
    return tuple(Prediction(*row) for row in zip(labels, *columns, strict=True))
