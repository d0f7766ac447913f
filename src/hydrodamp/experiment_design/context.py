"""Assembly of the design problem: prior, autopilot, ensemble, baseline campaign and objective.

Members of the ensemble that violate the envelope in a plain turn are rejected; the baseline is a
campaign of steps of the same duration; a model whose scaled Fisher information is singular is
refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ModelError, ProblemError
from hydrodamp.experiment_design import optimise as design
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot, design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.ensemble import extended_model, prior_damping, sample_ensemble
from hydrodamp.experiment_design.envelope import CommandLimits, Envelope
from hydrodamp.experiment_design.guidance import (
    Manoeuvre,
    baseline_manoeuvres,
    candidate_manoeuvres,
    join_setpoints,
)
from hydrodamp.identification.fit import Fit
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.problem import prepare
from hydrodamp.vehicle.actuators import Matrix, Propeller
from hydrodamp.vehicle.vehicle import Vehicle

Mode = Literal["overlays", "setpoints", "waypoints"]
"""How a dive is executed: setpoints and overlays of commands, setpoints alone, or waypoints."""

DEFAULT_MODE: Mode = "setpoints"
"""Mode of a vehicle with a propeller and a heading loop; docs/how-to/plan-a-dive.md."""

N_MEMBERS = 40
"""Members of the ensemble with which a dive is verified."""

ACCEPTANCE_LENGTHS = 2.0
"""Lookahead distance and radius of acceptance of waypoints, in lengths of the vehicle: T. I.
Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), section 10.3."""

SEGMENT_DURATION, MAX_SEGMENTS = 50.0, 16
"""Duration of a segment [s], and largest number of segments."""

MIN_EIGENVALUE = 1e-11
"""Relative eigenvalue of the Fisher information below which a direction is not identifiable."""

MIN_MOTION = np.full(6, 0.1)
"""Least motion for the scale of coefficients: standard deviations [m/s, rad/s]; assumed."""

BASELINE_STRENGTHS = np.linspace(1.0, 0.1, 10)
"""Strengths of the baseline's steps, the largest feasible one of which is used."""


@dataclass(frozen=True, eq=False)
class PlanningContext:
    """The design problem of a dive of ``n_segments`` segments of ``samples`` samples.

    ``time_scale`` [s] is that of the baseline, for all manoeuvres.
    """

    prior: Damping
    simulator: ClosedLoopSimulator
    time_scale: float
    samples: int
    n_segments: int
    baseline: list[Manoeuvre]
    coefficient_scale: FloatArray
    seed: int
    mode: Mode

    @classmethod
    def of(
        cls,
        vehicle: Vehicle,
        model: DampingModel,
        duration: float,
        damping: Damping | None,
        envelope: Envelope,
        seed: int,
        mode: Mode | None = None,
    ) -> PlanningContext:
        """Design the autopilot, simulate the baseline, and sample the ensemble."""
        prior = prior_damping(vehicle, model, damping)
        autopilot = design_autopilot(vehicle, prior, envelope)
        mode = choose_mode(autopilot, mode)
        autopilot = replace(autopilot, adds_excitation=mode == "overlays")

        def simulator_of(scale: FloatArray, n: int) -> ClosedLoopSimulator:
            ensemble = sample_ensemble(vehicle, model, prior, scale, n, seed)
            return ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)

        n_coefficients = extended_model(vehicle, model, prior).n_coefficients
        simulator = simulator_of(np.zeros(n_coefficients), N_MEMBERS)
        check_reachable(simulator)
        nominal = simulator.with_members([0])
        n_segments = int(np.clip(round(duration / SEGMENT_DURATION), 2, MAX_SEGMENTS))
        samples = round(duration / envelope.period / n_segments)
        baseline = largest_baseline(nominal, samples, n_segments)
        setpoints, overlays = join_setpoints(baseline, autopilot, envelope, samples)
        trajectories = nominal.simulate((setpoints[:, None], overlays[:, None]))
        scale = coefficient_scale(nominal, trajectories, seed)
        context = cls(
            prior,
            steerable_members(simulator_of(scale, 2 * N_MEMBERS), samples),
            trajectories.log(vehicle, autopilot.names, exact=True).time_scale,
            *(samples, n_segments, baseline, scale, seed, mode),
        )
        context.check_excitation(nominal)
        return context

    @property
    def acceptance_radius(self) -> float:
        """Lookahead distance and radius of acceptance of waypoints [m]."""
        return ACCEPTANCE_LENGTHS * (estimate_length(self.simulator.vehicle) or 1.0)

    @property
    def segment_duration(self) -> float:
        """Duration of a segment [s]."""
        return self.samples * self.simulator.envelope.period

    @property
    def model(self) -> DampingModel:
        """The model to identify."""
        return self.simulator.ensemble.model

    def model_values(self, values: FloatArray) -> FloatArray:
        """Return the values of the model's coefficients from those of the extended model."""
        extended = self.simulator.ensemble.extended_model
        return values[[extended.index(label) for label in self.model.labels]]

    @property
    def prior_coefficients(self) -> FloatArray:
        """Coefficients of the prior, shape (p,)."""
        return self.model_values(self.simulator.ensemble.dampings[0].coefficients)

    @property
    def prior_std_errors(self) -> FloatArray:
        """Standard errors of the prior, infinite where unknown, shape (p,)."""
        if self.prior.covariance is None:
            return np.full(self.model.n_coefficients, np.inf)
        std = np.sqrt(np.diag(self.prior.covariance))
        known = dict(zip(self.prior.model.labels, np.where(std > 0.0, std, np.inf), strict=True))
        return np.array([known.get(label, np.inf) for label in self.model.labels])

    @property
    def weak_prior_information(self) -> FloatArray:
        """Information of a prior 100 times wider than the scale of the coefficients."""
        scale = np.maximum(self.model_values(self.coefficient_scale), 1e-9)
        return np.diag((100.0 * scale) ** -2.0)

    @property
    def prior_information(self) -> FloatArray:
        """Inverse covariance of the prior without its correlations, shape (p, p).

        A jackknife of few blocks does not determine them.
        """
        return np.diag(self.prior_std_errors**-2.0) + self.weak_prior_information

    def cramer_rao_bound(self, trajectories: Trajectories) -> FloatArray:
        """Return the Cramer-Rao bound of standard errors with the nominal damping."""
        nominal = self.simulator.with_members([0])
        information = design.ensemble_information(
            nominal, trajectories.select([0]), self.time_scale
        )[0]
        covariance = np.linalg.inv(information + self.weak_prior_information)
        return np.asarray(np.sqrt(np.diag(covariance)))

    def std_error_inflation(self, std_errors: FloatArray, trajectories: Trajectories) -> FloatArray:
        """Return the ratio of standard errors to the bound, the median of each axis, at least 1."""
        ratio = std_errors / self.cramer_rao_bound(trajectories)
        axes = np.array([label[0] for label in self.model.labels])
        medians = [np.median(ratio[axes == axis]) for axis in axes]
        return np.maximum(medians, 1.0)

    def check_excitation(self, nominal: ClosedLoopSimulator) -> None:
        """Refuse a model with terms that no manoeuvre excites, or that are collinear."""
        candidates = candidate_manoeuvres(len(nominal.autopilot.overlays))
        trajectories = design.simulate_candidates(nominal, candidates, self.samples)
        by_manoeuvre = design.ensemble_information(nominal, trajectories, self.time_scale)
        information = by_manoeuvre.sum(axis=0)
        size = np.sqrt(np.maximum(np.diag(information), 0.0))
        unit = np.where(size > 0.0, size, 1.0)
        eigenvalues, eigenvectors = np.linalg.eigh(information / np.outer(unit, unit))
        null_space = eigenvectors[:, eigenvalues < MIN_EIGENVALUE]
        unidentifiable = (size == 0.0) | (np.sum(null_space**2, axis=1) > 1e-3)
        if unidentifiable.any():
            labels = ", ".join(np.array(self.model.labels)[unidentifiable])
            raise ModelError(
                f"model '{self.model.key}' has terms that are not identifiable from any dive of "
                f"'{self.simulator.vehicle.name}' (not excited, or collinear): {labels}. "
                "Leave them out, or widen the envelope."
            )


def limit_by_log(vehicle: Vehicle, envelope: Envelope, fit: Fit) -> Envelope:
    """Return an envelope with the speeds and commands of the log of a fit where none are stated.

    The limit of a propeller is assumed: a range would exclude speeds beyond those of the log.
    """
    known = {
        item.command
        for item in vehicle.actuators
        if not isinstance(item, Matrix) and (item.limit or isinstance(item, Propeller))
    }
    limits = {
        name: CommandLimits(lowest=low, highest=high)
        for name, (low, high) in fit.command_range.items()
        if name not in known and low < high
    }
    changes: dict[str, object] = {"commands": {**limits, **envelope.commands}}
    slow, fast = fit.training_range.get("u", (0.0, 0.0))
    if fast > 0.0 and "speed" not in envelope.model_fields_set:
        changes["speed"] = (max(slow, 0.0), fast)
    return envelope.model_copy(update=changes)


def choose_mode(autopilot: DesignedAutopilot, mode: Mode | None) -> Mode:
    """Return the mode, by default that of the vehicle; refuse one that it cannot execute."""
    has_setpoints = autopilot.propeller is not None and autopilot.heading is not None
    if mode is None:
        return DEFAULT_MODE if has_setpoints else "overlays"
    if mode != "overlays" and not has_setpoints:
        raise ProblemError(
            f"mode '{mode}' needs a propeller and a heading loop, which this vehicle or envelope "
            "does not have: plan with mode 'overlays'."
        )
    return mode


def check_reachable(simulator: ClosedLoopSimulator) -> None:
    """Refuse a speed that most members do not reach at the limits of the actuators."""
    autopilot, highest = simulator.autopilot, simulator.envelope.speed[1]
    speeds = simulator.reachable_speeds()
    if not np.any(autopilot.full_ahead) or np.median(speeds) >= highest:
        return
    low, middle, high = np.quantile(speeds, [0.05, 0.5, 0.95])
    pairs = zip(autopilot.names, autopilot.full_ahead, strict=True)
    limits = ", ".join(f"`{name}` of {command:.4g}" for name, command in pairs if command)
    raise ProblemError(
        f"envelope: `speed` up to {highest:g} m/s is not reachable: with {limits} the vehicle "
        f"reaches {middle:.2g} m/s, {low:.2g} to {high:.2g} in 90 % of the ensemble of damping. "
        f"Lower `speed`, or correct these limits. {' '.join(autopilot.assumptions)}".rstrip()
    )


def steerable_members(simulator: ClosedLoopSimulator, samples: int) -> ClosedLoopSimulator:
    """Return the members that turn to a course within the envelope, as the real vehicle does."""
    turns = (0.0, 0.75, 0.0, *[0.0] * len(simulator.autopilot.overlays))
    calm = [Manoeuvre("steps", level, 0.0, turns) for level in (0.0, 0.5, 1.0)]
    trajectories = design.simulate_candidates(simulator, calm, samples)
    feasible = simulator.worst_violation(trajectories).max(axis=0) <= 0.0
    feasible[0] = True
    if feasible.sum() < N_MEMBERS:
        raise ProblemError(
            f"in {1.0 - feasible.mean():.0%} of the ensemble of damping, the autopilot violates "
            "the envelope as it turns to a course. Raise the lowest `speed`, give the `autopilot` "
            "its gains, or plan with a fit of smaller standard errors (`--damping`)."
        )
    return simulator.with_members(np.flatnonzero(feasible)[:N_MEMBERS].tolist())


def largest_baseline(
    nominal: ClosedLoopSimulator, samples: int, n_segments: int
) -> list[Manoeuvre]:
    """Return the baseline campaign, each step as large as the envelope permits."""
    autopilot = nominal.autopilot
    steps = baseline_manoeuvres(len(autopilot.overlays), autopilot.hovers)
    candidates = [step.attenuate(strength) for step in steps for strength in BASELINE_STRENGTHS]
    trajectories = design.simulate_candidates(nominal, candidates, samples)
    feasible = nominal.worst_violation(trajectories).reshape(len(steps), -1) < 0.0
    feasible[:, -1] = True  # the weakest, if no other is feasible
    largest = BASELINE_STRENGTHS[feasible.argmax(axis=1)]
    baseline = [step.attenuate(strength) for step, strength in zip(steps, largest, strict=True)]
    return [baseline[number % len(baseline)] for number in range(n_segments)]


def coefficient_scale(
    nominal: ClosedLoopSimulator, trajectories: Trajectories, seed: int
) -> FloatArray:
    """Return the coefficients of the extended model that alone make the force on their axis.

    The motion counts as at least ``MIN_MOTION``.
    """
    log = trajectories.log(nominal.vehicle, nominal.autopilot.names, exact=True)
    motion = np.random.default_rng(seed).standard_normal(log.velocity.shape) * MIN_MOTION
    extended, damping = nominal.ensemble.extended_model, nominal.ensemble.dampings[0]
    problem = prepare(nominal.vehicle, replace(log, velocity=log.velocity + motion), extended)
    n_known = problem.equations.n_known
    regressor = problem.regressor()[:, n_known:]
    force = np.sqrt(np.mean((regressor @ problem.matrix(damping)[n_known:]) ** 2, axis=0))
    rms = np.sqrt(np.mean(regressor**2, axis=0))
    by_term = dict(zip(problem.equations.basis, rms, strict=True))
    rows = zip(force, extended.terms, strict=True)
    return np.array([axis / (by_term[term] or 1.0) for axis, terms in rows for term in terms])
