"""Plan of the next dive: greedy pseudo-Bayesian optimal experiment design with a chance constraint.

The manoeuvres minimise a criterion of the expected covariance over a Monte Carlo ensemble of
damping: D-optimal (determinant), the largest standard error relative to its target (an 8-norm), or
I-optimal (expected replay error). The dive is then attenuated until 95 % of the members keep the
envelope. Predicted standard errors are those of simulated and identified logs.
"""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import HydrodampError, MethodError, demand, no_such
from hydrodamp.experiment_design import optimise as design
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.context import Mode, PlanningContext
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import CommandLimits, Envelope
from hydrodamp.experiment_design.guidance import candidate_manoeuvres
from hydrodamp.experiment_design.result import DivePlan, PlanSegment, Prediction
from hydrodamp.experiment_design.verification import (
    FeasibleDive,
    SimulatedEstimates,
    enforce_envelope,
    expected_coefficients,
    identify_simulated_logs,
    shortest_duration,
)
from hydrodamp.identification.differentiation import noise_variance
from hydrodamp.identification.fit import Fit, critical_value
from hydrodamp.identification.grades import MAX_RELATIVE_HALF_WIDTH, Grade
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.progress import progress
from hydrodamp.simulation.problem import Problem
from hydrodamp.vehicle.vehicle import Vehicle

N_OPTIMISED, VERIFIED_MEMBERS = 3, slice(4)
"""Members with which a dive is optimised; those whose logs are identified."""

MAX_DISTINCT_SEGMENTS = 6
"""The second half of a dive of more segments mirrors the first."""

DURATION_LIMITS = 60.0, 86400.0
"""Shortest and longest dive [s]."""

CRITERIA = get_args(design.Criterion)
"""Optimality criteria."""

MODES = get_args(Mode)
"""How a dive may be executed."""

GOALS = tuple(grade.word for grade in list(Grade)[:3])
"""Grades for which a dive may be planned."""

_NOT_BETTER = "No manoeuvres have smaller standard errors than steps commanded by setpoints: "

_CAUSE = "the model-form error exceeds the noise in the residuals. Try a model with more terms"

_WAYPOINT_CAUSE = (
    f"waypoints permit no manoeuvre that is quicker than a leg, or {_CAUSE}, or another mode"
)

GAIN_DURATION, GAIN_SEGMENT, N_GAIN_MANOEUVRES = 600.0, 40.0, 4
"""Dive of :func:`expected_gain`: duration and duration of a segment [s]; distinct manoeuvres."""

RIDGE = 1e-3
"""Prior of :func:`expected_gain`: inverse standard deviation over the root of the information."""

UNLIMITED_DEPTH, LOG_PERCENTILES = (0.0, 1000.0), (5.0, 95.0)
"""A depth band without effect [m]; percentiles of a log's speeds and commands that are limits."""


def plan(
    vehicle: Vehicle,
    model: DampingModel,
    duration: float,
    *,
    damping: Damping | None = None,
    envelope: Envelope | None = None,
    goal: str | None = None,
    criterion: design.Criterion = "determinant",
    mode: Mode | None = None,
    seed: int = 0,
) -> DivePlan:
    """Plan the dive that is optimal for the identification of a model (optimal experiment design).

    Parameters
    ----------
    vehicle : Vehicle
        With actuators, or a model and ``damping`` that have gains of commands.
    model : DampingModel
        The model to identify.
    duration : float
        Duration of the dive, 60 to 86400 [s]; with a goal its upper limit.
    damping : Damping, optional
        The prior, best with its covariance, such as an earlier fit. By default a published set of
        the vehicle, else an estimate from the size of its hull.
    envelope : Envelope, optional
        Constraints of the dive.
    goal : {"determined", "minor", "weak"}, optional
        Plan the shortest dive that brings every coefficient to this grade, if it can.
    criterion : {"determinant", "worst", "replay"}
        The optimality criterion: determinant of the covariance (D-optimal), largest standard error
        relative to its target (minimax), or expected error of a replay, eq. 24 (I-optimal).
    mode : {"waypoints", "setpoints", "overlays"}, optional
        How the dive is executed: along waypoints, by setpoints of speed, heading and depth, or by
        setpoints with excitation added to each other command. Standard errors hold for that
        mode. By default setpoints where a propeller drives the vehicle and its
        heading is steered, else overlays.
    seed : int, optional
        Seed of the ensemble and of the noise.

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
    if goal is not None and goal not in GOALS:
        raise MethodError(no_such("goal", goal, GOALS))
    demand(mode is None or mode in MODES, "mode", " or ".join(MODES), mode)
    demand(criterion in CRITERIA, "criterion", " or ".join(CRITERIA), criterion)
    context = PlanningContext.of(
        vehicle, model, duration, damping, envelope or Envelope(), seed, mode
    )

    def verify_dive(dive: FeasibleDive, *, grading: bool = True) -> SimulatedEstimates:
        trajectories = dive.trajectories.select(VERIFIED_MEMBERS)
        return identify_simulated_logs(context.simulator, trajectories, grading=grading)

    baseline_dive = enforce_envelope(context, context.baseline, baseline=True)
    baseline = verify_dive(baseline_dive, grading=False)
    dive = optimise(context, "worst" if goal else criterion, baseline, baseline_dive)
    result = verify_dive(dive)
    notes: tuple[str, ...] = ()
    if not result.log_std_error <= baseline.log_std_error:
        # In waypoint mode the executed baseline may determine less than the manoeuvres do.
        executed = enforce_envelope(context, context.baseline)
        executed_result = verify_dive(executed)
        notes = (f"{_NOT_BETTER}{_WAYPOINT_CAUSE if context.mode == 'waypoints' else _CAUSE}.",)
        if not result.log_std_error < executed_result.log_std_error:
            dive, result = executed, executed_result
    goal_duration = None
    if goal is not None:
        trajectories, n = dive.trajectories.select(VERIFIED_MEMBERS), len(dive.manoeuvres)
        goal_duration, n, result = shortest_duration(context, goal, n, trajectories, result)
        dive = dive.until(n, context.samples)
    return replace(
        _make_plan(context, dive, result, baseline), goal_duration=goal_duration, notes=notes
    )


def optimise(
    context: PlanningContext,
    criterion: design.Criterion,
    baseline: SimulatedEstimates,
    baseline_dive: FeasibleDive,
) -> FeasibleDive:
    """Optimise manoeuvres; the second half of a long dive mirrors the first."""
    is_long = context.n_segments > MAX_DISTINCT_SEGMENTS
    n = -(-context.n_segments // 2) if is_long else context.n_segments
    inflation = context.std_error_inflation(baseline.std_errors, baseline_dive.trajectories)
    optimiser = design.Optimiser(
        context.simulator.with_members([*range(N_OPTIMISED)]),
        context.error_model,
        context.objective(criterion, inflation),
        context.samples,
        context.acceptance_radius if context.mode == "waypoints" else None,
    )
    with progress("optimising manoeuvres", n) as step:
        manoeuvres = optimiser.optimise_dive(n, context.seed, step)
    if is_long:
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
    values, bounds = expected_coefficients(context, result), context.cramer_rao_bound(trajectories)
    combined = (std_errors**-2.0 + prior**-2.0) ** -0.5
    grades, causes = result.grades(labels), result.causes(labels)
    return tuple(
        Prediction(
            label=label,
            value=float(values[index]),
            prior_std_error=float(prior[index]) if np.isfinite(prior[index]) else None,
            cramer_rao_bound=float(bounds[index]),
            std_error=float(std_errors[index]),
            combined_std_error=float(combined[index]),
            baseline_std_error=float(baseline.std_errors[index]),
            grade=grades[index],
            cause=causes[index] if grades[index] is Grade.NOT_DETERMINED else None,
        )
        for index, label in enumerate(labels)
    )


def expected_gain(problem: Problem, fit: Fit, grades: Identifiability) -> str:
    """Return what a dive of ten minutes is expected to add to a log, in a sentence.

    Candidate manoeuvres are simulated with the fit's damping at the speeds of the log. Standard
    errors are assumed to decrease from those of the fit as the Cramer-Rao bound does.
    """
    labels = fit.model.labels
    weak = [label for label, grade in grades.grades.items() if grade is not Grade.DETERMINED]
    if not weak:
        return ""
    command = f"`hydrodamp plan --damping FILE --duration {GAIN_DURATION:.0f}` plans it"
    counted = f"{len(weak)} of {len(labels)} coefficients are not graded determined"
    if fit.damping.covariance is None:
        return f"{counted}. A further dive may determine them: {command}."
    try:
        ratio = _std_error_ratio(problem, fit)
    except HydrodampError:
        return f"{counted}. A further dive needs a vehicle that can be steered: {command}."
    half_width = critical_value() * np.sqrt(np.diag(fit.damping.covariance)) * ratio
    narrow = half_width <= MAX_RELATIVE_HALF_WIDTH * np.abs(fit.damping.coefficients)
    gained = [label for label, flag in zip(labels, narrow, strict=True) if flag and label in weak]
    reduction = 100.0 * (1.0 - float(np.exp(np.mean(np.log(ratio)))))
    names = f" ({', '.join(gained[:3])}{', ...' * (len(gained) > 3)})" if gained else ""
    return (
        f"{counted}. A planned dive of {GAIN_DURATION / 60.0:.0f} min is expected to reduce "
        f"standard errors by {reduction:.0f} % and to determine {len(gained)} of them{names}: "
        f"{command}."
    )


def _std_error_ratio(problem: Problem, fit: Fit) -> FloatArray:
    """Return standard errors with the dive added to the log over those of the log, (p,)."""
    vehicle, log = problem.vehicle, problem.log
    low, high = np.percentile(log.velocity[:, 0], LOG_PERCENTILES).tolist()
    commands = {}
    for name in log.command_names:
        a, b = np.percentile(log.command(name), LOG_PERCENTILES).tolist()
        if (a or b) and name in (*vehicle.commands, *fit.model.commands):
            commands[name] = CommandLimits(lowest=min(a, -b), highest=max(b, -a))
    speed = max(low, 0.1), max(high, 0.2)
    envelope = Envelope(depth=UNLIMITED_DEPTH, speed=speed, commands=commands)
    autopilot = design_autopilot(vehicle, fit.damping, envelope)
    ensemble = DampingEnsemble((fit.damping,), fit.model)
    simulator = ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)
    error_model = design.ErrorModel.of(np.sqrt(noise_variance(problem)))
    matrix = problem.matrix(fit.damping)
    by_log = design.window_information(problem, matrix, fit.model, error_model).sum(axis=0)
    candidates = candidate_manoeuvres(len(autopilot.overlays))
    samples = round(GAIN_SEGMENT / envelope.period)
    trajectories = design.simulate_candidates(simulator, candidates, samples)
    feasible = simulator.worst_violation(trajectories).max(axis=1) <= 0.0
    if not feasible.any():
        raise HydrodampError("no feasible manoeuvre")
    by_manoeuvre = design.fisher_information(simulator, trajectories, error_model)[feasible]
    total = by_log + RIDGE**2 * np.diag(np.diag(by_log + by_manoeuvre.sum(axis=0)))
    initial = np.diag(np.linalg.inv(total))
    repetitions = GAIN_DURATION / GAIN_SEGMENT / N_GAIN_MANOEUVRES
    for _ in range(N_GAIN_MANOEUVRES):
        best = int(np.argmax(np.linalg.slogdet(total + by_manoeuvre)[1]))
        total = total + by_manoeuvre[best] * repetitions
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(total)) / initial))
