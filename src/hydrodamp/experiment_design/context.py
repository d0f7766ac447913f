"""The design problem: prior, ensemble of damping, baseline campaign, and enforced envelope."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import ModelError, ProblemError
from hydrodamp.experiment_design.autopilot import design_autopilot
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Orders,
    Trajectories,
    limit_violations,
    saturation,
)
from hydrodamp.experiment_design.ensemble import prior_damping, sample_ensemble, wide_model
from hydrodamp.experiment_design.envelope import Area, Envelope
from hydrodamp.experiment_design.excitation import Manoeuvre, candidate_manoeuvres, join_setpoints
from hydrodamp.experiment_design.fisher_information import ErrorModel, fisher_information
from hydrodamp.experiment_design.guidance import CourseGuidance, follow_tracks
from hydrodamp.experiment_design.optimiser import (
    Criterion,
    Objective,
    Optimiser,
)
from hydrodamp.experiment_design.preparation import (
    VERIFIED,
    Mode,
    check_reachable,
    choose_mode,
    coefficient_sizes,
    largest_steps,
    steerable_members,
)
from hydrodamp.experiment_design.result import MonteCarloVerification
from hydrodamp.identification.fit import critical_value as reach_of
from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH, MINOR_CONTRIBUTION
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.vehicle.vehicle import Vehicle

#: Lookahead distance and radius of acceptance of waypoints, in lengths of the vehicle: two, as
#: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), section 10.3.
ACCEPTANCE = 2.0

#: Share of the draws that must keep to the envelope.
_WITHIN = 0.95

#: A stretch that leaves the envelope becomes so much weaker, so often at most.
_WEAKER, _TRIALS = 0.8, 12

#: All of them become so much slower where the area is left.
_SLOWER = 0.9

#: For how long a stretch is to blame for what comes after it [s].
_LATE = 5.0

#: Length of a stretch [s] and how many there are at most.
_STRETCH, _MOST = 50.0, 16

#: A direction of the coefficients that tells less than this of a usual one tells nothing.
_NOTHING = 1e-11


@dataclass(frozen=True, eq=False)
class CandidateDive:
    """A dive simulated for the whole ensemble.

    ``within`` is the share of members that stay inside the envelope, ``saturated`` the share of
    time at a limit by command, ``waypoints`` (m, 4) what the dive follows in place of setpoints.
    """

    manoeuvres: list[Manoeuvre]
    overlays: FloatArray
    courses: FloatArray
    trajectories: Trajectories
    feasibility_rate: float
    saturation: dict[str, float]
    waypoints: FloatArray | None = None

    def until(self, stretches: int, samples: int) -> CandidateDive:
        """Return the first stretches."""
        n, waypoints = stretches * samples, self.waypoints
        if waypoints is not None:
            waypoints = waypoints[: np.searchsorted(waypoints[:, 0], n * self.trajectories.period)]
        return replace(
            self,
            waypoints=waypoints,
            manoeuvres=self.manoeuvres[:stretches],
            overlays=self.overlays[:n],
            courses=self.courses[:stretches],
            trajectories=self.trajectories.until(n),
        )


@dataclass(frozen=True, eq=False)
class PlanningContext:
    """The design problem; ``closed_loop`` holds the whole ensemble, nominal member first."""

    prior: Damping
    closed_loop: ClosedLoopSimulator
    error_model: ErrorModel
    samples: int
    n_segments: int
    baseline: list[Manoeuvre]
    coefficient_scale: FloatArray
    replay_information: FloatArray
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
        """Simulate steps with the nominal damping, and draw the ensemble."""
        known = prior_damping(vehicle, model, damping)
        autopilot = design_autopilot(vehicle, known, envelope)
        mode = choose_mode(autopilot, mode)
        autopilot = replace(autopilot, excites=mode == "overlays")
        wide = wide_model(vehicle, model, known)
        draws = sample_ensemble(
            vehicle, model, known, np.zeros(wide.n_coefficients), VERIFIED, seed
        )
        prior = ClosedLoopSimulator.of(vehicle, autopilot, envelope, draws)
        check_reachable(prior)
        alone = prior.with_members([0])
        stretches = int(np.clip(round(duration / _STRETCH), 2, _MOST))
        samples = round(duration / envelope.period / stretches)
        steps = largest_steps(alone, samples, stretches)
        setpoints, overlays = join_setpoints(steps, autopilot, envelope, samples)
        trajectories = alone.simulate((setpoints[:, None], overlays[:, None]))
        seen = ErrorModel.of(envelope.noise_std[:6])
        sizes = coefficient_sizes(alone, trajectories, seed)
        ensemble = sample_ensemble(vehicle, model, known, sizes, 2 * VERIFIED, seed)
        closed_loop = steerable_members(
            ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble), samples
        )
        unit = ErrorModel(np.array([1.0] * 3 + [np.pi / 180.0] * 3), np.full(6, 1e-6))
        replay = fisher_information(alone, trajectories, unit, window=60.0)[0]
        made = cls(known, closed_loop, seen, samples, stretches, steps, sizes, replay, seed, mode)
        made.check_excited(alone)
        return made

    @property
    def acceptance(self) -> float:
        """Lookahead distance and radius of acceptance of waypoints [m]."""
        return ACCEPTANCE * (estimate_length(self.closed_loop.vehicle) or 1.0)

    @property
    def segment_duration(self) -> float:
        """Length of a stretch [s]."""
        return self.samples * self.closed_loop.envelope.period

    @property
    def model(self) -> DampingModel:
        """What is planned for."""
        return self.closed_loop.ensemble.model

    def model_values(self, values: FloatArray) -> FloatArray:
        """Return values of the wide model's coefficients for those of the model."""
        return values[[self.closed_loop.ensemble.wide.index(label) for label in self.model.labels]]

    @property
    def prior_coefficients(self) -> FloatArray:
        """What is known of the coefficients."""
        return self.model_values(self.closed_loop.ensemble.dampings[0].coefficients)

    def expected_coefficients(self, fits: MonteCarloVerification) -> FloatArray:
        """Return what coefficients are known as, or the fit to the nominal member."""
        known = [label in self.prior.model.labels for label in self.model.labels]
        return np.where(known, self.prior_coefficients, fits.coefficients[0])

    def check_excited(self, alone: ClosedLoopSimulator) -> None:
        """Refuse a model with terms that nothing moves, or that nothing tells apart."""
        optimiser = Optimiser(alone, self.error_model, self.objective("determinant"), self.samples)
        found, *_ = optimiser.evaluate(candidate_manoeuvres(len(alone.autopilot.overlays)))
        information = found.sum(axis=(0, 1))
        size = np.sqrt(np.maximum(np.diag(information), 0.0))
        moved = size > 0.0
        unit = np.where(moved, size, 1.0)
        level, directions = np.linalg.eigh(information / np.outer(unit, unit))
        null = directions[:, level < _NOTHING]
        lost = ~moved | (np.sum(null**2, axis=1) > 1e-3)
        if lost.any():
            labels = ", ".join(np.array(self.model.labels)[lost])
            raise ModelError(
                f"model '{self.model.key}' has terms that no dive of "
                f"'{self.closed_loop.vehicle.name}' excites, or tells from others: {labels}. "
                "Leave them out, or widen the envelope."
            )

    @property
    def prior_std_errors(self) -> FloatArray:
        """Standard errors known before, infinite where nothing is, shape (p,)."""
        covariance, found = self.prior.covariance, np.full(self.model.n_coefficients, np.inf)
        if covariance is None:
            return found
        errors = dict(zip(self.prior.model.labels, np.sqrt(np.diag(covariance)), strict=True))
        for place, label in enumerate(self.model.labels):
            error = errors.get(label, 0.0)
            found[place] = error if error > 0.0 else np.inf  # nor NaN
        return found

    def objective(
        self, criterion: Criterion, std_error_inflation: FloatArray | None = None
    ) -> Objective:
        """Return what the dive is to make small."""
        sizes = np.maximum(self.model_values(self.coefficient_scale), 1e-9)
        allowed = (
            np.maximum(
                MAX_RELATIVE_HALF_WIDTH * np.abs(self.prior_coefficients),
                MINOR_CONTRIBUTION * sizes,
            )
            / reach_of()
        )
        std_error_inflation = (
            np.ones(len(sizes)) if std_error_inflation is None else std_error_inflation
        )
        # Correlations of a prior are left out: those of a jackknife are not known well enough.
        known = np.diag(self.prior_std_errors**-2.0) + self.weak_prior_information
        return Objective(criterion, allowed, self.replay_information, std_error_inflation, known)

    def enforce_envelope(
        self, several: list[Manoeuvre], *, baseline: bool = False
    ) -> CandidateDive:
        """Simulate manoeuvres for the ensemble; weaken them where members leave the envelope.

        The baseline is executed by setpoints, whatever the mode.
        """
        follow = self.mode == "waypoints" and not baseline
        envelope, autopilot = self.closed_loop.envelope, self.closed_loop.autopilot
        n, violation = len(self.closed_loop.matrices), ""
        under_way = np.array([float(autopilot.propeller is not None), 1.0, 1.0])
        off = np.zeros((len(several), 1, 1, 2))
        for _ in range(_TRIALS):
            orders = join_setpoints(several, autopilot, envelope, self.samples)
            own = under_way * orders[0].reshape(len(several), self.samples, 3)
            course = CourseGuidance(envelope.area, own, envelope.period, off)
            waypoints: FloatArray | None = None
            if follow:
                nominal = self.closed_loop.with_members([0])
                planned = nominal.simulate(_repeated(orders, 1), None, course)
                trajectories, (waypoints, *_) = follow_tracks(
                    self.closed_loop, planned, self.acceptance, self.seed
                )
            else:
                planned = self.closed_loop.simulate(_repeated(orders, n), self.seed, course)
                trajectories = planned
            limits = limit_violations(envelope, trajectories)
            outside = {name: np.any(one > 0.0, axis=0) for name, one in limits.items()}
            within = 1.0 - float(np.mean(np.any(list(outside.values()), axis=0)))
            if within >= _WITHIN:
                shares = saturation(autopilot, trajectories)
                saturated = {name: float(np.mean(share)) for name, share in shares.items()}
                courses = np.array(course.courses)
                return CandidateDive(
                    several, orders[1], courses, trajectories, within, saturated, waypoints
                )
            name = max(outside, key=lambda one: float(np.mean(outside[one])))
            share, far = np.mean(outside[name]), limits[name].max()
            violation = f"`{name}` is left in {share:.0%} of the draws, by up to {far:.0%}"
            off = course.update_drift(planned)
            # The few members that may leave the envelope do not count.
            worst_of = np.max([one.max(axis=0) for one in limits.values()], axis=0)
            most = np.argsort(worst_of)[: int(np.ceil(_WITHIN * n))]
            counted = {name: one[:, most] for name, one in limits.items()}
            several = self._weakened(several, counted)
        raise ProblemError(
            f"no dive keeps to the envelope: after {_TRIALS} times weaker manoeuvres {violation}. "
            "Widen that limit, raise the lowest `speed`, or check the autopilot's gains."
        )

    def _weakened(self, several: list[Manoeuvre], limits: dict[str, FloatArray]) -> list[Manoeuvre]:
        """Return manoeuvres slower where they are too fast, weaker where they are too wild.

        Where the area is left all are a little slower: each leads on from those before.
        """
        far = [one for name, one in limits.items() if name in Area.model_fields]
        if far and np.max(far) > 0.0:
            several = [one.slow_down(_SLOWER) for one in several]
        wild = [limits[name] for name in ("depth", "pitch", "roll")]
        too_fast, too_wild = self._where(limits["speed"] > 0.0), self._where(np.max(wild, 0) > 0.0)
        if self.closed_loop.autopilot.propeller is None:
            # No setpoint of speed: excitation alone makes it.
            too_wild, too_fast = too_wild | too_fast, np.zeros_like(too_fast)
        slower = [
            one.slow_down(_WEAKER) if f else one for one, f in zip(several, too_fast, strict=True)
        ]
        return [
            one.attenuate(_WEAKER) if w else one for one, w in zip(slower, too_wild, strict=True)
        ]

    def _where(self, out: BoolArray) -> BoolArray:
        """Return which stretches leave a limit in any draw, a few seconds after they end, too."""
        late = np.roll(out.any(axis=1), -round(_LATE / self.closed_loop.envelope.period))
        return np.asarray(late.reshape(-1, self.samples).any(axis=1))

    def wider(self, fits: MonteCarloVerification, trajectories: Trajectories) -> FloatArray:
        """Return by how much standard errors exceed the bound, the median of each axis."""
        ratio, found = (
            fits.std_errors / self.cramer_rao_bound(trajectories),
            np.ones(self.model.n_coefficients),
        )
        axes = np.array([label[0] for label in self.model.labels])
        for axis in np.unique(axes):
            found[axes == axis] = max(float(np.median(ratio[axes == axis])), 1.0)
        return found

    @property
    def weak_prior_information(self) -> FloatArray:
        """Information of one who knows that coefficients are not absurd."""
        return np.diag(
            (100.0 * np.maximum(self.model_values(self.coefficient_scale), 1e-9)) ** -2.0
        )

    def cramer_rao_bound(self, trajectories: Trajectories) -> FloatArray:
        """Return Cramer and Rao's bound for the nominal damping."""
        information = fisher_information(
            self.closed_loop.with_members([0]), trajectories.select([0]), self.error_model
        )
        return np.asarray(
            np.sqrt(np.diag(np.linalg.inv(information[0] + self.weak_prior_information)))
        )


def _repeated(orders: Orders, n: int) -> Orders:
    """Return orders for each of n vehicles."""
    setpoints, overlays = (np.repeat(one[:, None], n, axis=1) for one in orders)
    return setpoints, overlays
