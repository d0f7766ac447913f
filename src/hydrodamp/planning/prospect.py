"""What a dive is planned with: what is known, the waters it may meet, and what it is to do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import ModelError, ProblemError
from hydrodamp.identification.fit import reach as reach_of
from hydrodamp.identification.grades import CONTRIBUTION, RELATIVE
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.planning.courses import Pilot
from hydrodamp.planning.design import Aim, Criterion, Designer, sailed, strayed
from hydrodamp.planning.dive import Rehearsal
from hydrodamp.planning.envelope import Area, Envelope
from hydrodamp.planning.helm import helm
from hydrodamp.planning.information import Seen, informed
from hydrodamp.planning.manoeuvres import Manoeuvre, campaign, classics, joined
from hydrodamp.planning.sailing import Fleet, Voyage, passed
from hydrodamp.planning.waters import drawn, known_damping, wide_model
from hydrodamp.simulation.problem import prepare
from hydrodamp.vehicle.vehicle import Vehicle

#: Waters that a dive is verified in.
VERIFIED = 40

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

#: Motion of a vehicle that is steered, at least: standard deviations [m/s, rad/s].
_MOTION = np.full(6, 0.1)

#: Strengths of steps that are tried.
_STRENGTHS = np.linspace(1.0, 0.1, 10)

#: A direction of the coefficients that tells less than this of a usual one tells nothing.
_NOTHING = 1e-11


@dataclass(frozen=True, eq=False)
class Sortie:
    """A dive that was sailed in all waters: its manoeuvres and orders, and how many draws kept."""

    manoeuvres: list[Manoeuvre]
    overlays: FloatArray
    courses: FloatArray
    voyage: Voyage
    within: float

    def until(self, stretches: int, samples: int) -> Sortie:
        """Return the first stretches."""
        n = stretches * samples
        return replace(
            self,
            manoeuvres=self.manoeuvres[:stretches],
            overlays=self.overlays[:n],
            courses=self.courses[:stretches],
            voyage=self.voyage.until(n),
        )


@dataclass(frozen=True, eq=False)
class Prospect:
    """What stays the same while a dive is planned; ``fleet`` is in all waters."""

    known: Damping
    fleet: Fleet
    seen: Seen
    samples: int
    stretches: int
    steps: list[Manoeuvre]
    sizes: FloatArray
    replay: FloatArray
    seed: int

    @classmethod
    def of(
        cls,
        vehicle: Vehicle,
        model: DampingModel,
        duration: float,
        damping: Damping | None,
        envelope: Envelope,
        seed: int,
    ) -> Prospect:
        """Sail steps in the water that is known, and draw others."""
        known = known_damping(vehicle, model, damping)
        wheel = helm(vehicle, known, envelope)
        wide = wide_model(vehicle, model, known)
        still = drawn(vehicle, model, known, np.zeros(wide.n_coefficients), 1, seed)
        alone = Fleet.of(vehicle, wheel, envelope, still)
        stretches = int(np.clip(round(duration / _STRETCH), 2, _MOST))
        samples = round(duration / envelope.period / stretches)
        steps = _steps(alone, samples, stretches)
        told, overlays = joined(steps, wheel, envelope, samples)
        voyage = alone.sail((told[:, None], overlays[:, None]))
        seen = Seen.of(envelope.deviations[:6])
        sizes = _sizes(alone, voyage, seed)
        waters = drawn(vehicle, model, known, sizes, 2 * VERIFIED, seed)
        fleet = _believed(Fleet.of(vehicle, wheel, envelope, waters), samples)
        unit = Seen(np.array([1.0] * 3 + [np.pi / 180.0] * 3), np.full(6, 1e-6))
        replay = informed(alone, voyage, unit, window=60.0)[0]
        made = cls(known, fleet, seen, samples, stretches, steps, sizes, replay, seed)
        made.check_excited(alone)
        return made

    @property
    def stretch(self) -> float:
        """Length of a stretch [s]."""
        return self.samples * self.fleet.envelope.period

    @property
    def model(self) -> DampingModel:
        """What is planned for."""
        return self.fleet.waters.model

    def sized(self, values: FloatArray) -> FloatArray:
        """Return values of the wide model's coefficients for those of the model."""
        return values[[self.fleet.waters.wide.index(label) for label in self.model.labels]]

    @property
    def value(self) -> FloatArray:
        """What is known of the coefficients."""
        return self.sized(self.fleet.waters.dampings[0].coefficients)

    def expected(self, rehearsal: Rehearsal) -> FloatArray:
        """Return what coefficients are known as, or come out as in the water that is known."""
        known = [label in self.known.model.labels for label in self.model.labels]
        return np.where(known, self.value, rehearsal.coefficients[0])

    def check_excited(self, alone: Fleet) -> None:
        """Refuse a model with terms that nothing moves, or that nothing tells apart."""
        designer = Designer(alone, self.seen, self.aim("determinant"), self.samples)
        found, _ = designer.tried(classics(len(alone.helm.overlays)))
        told = found.sum(axis=(0, 1))
        size = np.sqrt(np.maximum(np.diag(told), 0.0))
        moved = size > 0.0
        unit = np.where(moved, size, 1.0)
        level, directions = np.linalg.eigh(told / np.outer(unit, unit))
        null = directions[:, level < _NOTHING]
        lost = ~moved | (np.sum(null**2, axis=1) > 1e-3)
        if lost.any():
            labels = ", ".join(np.array(self.model.labels)[lost])
            raise ModelError(
                f"model '{self.model.key}' has terms that no dive of '{self.fleet.vehicle.name}' "
                f"excites, or tells from others: {labels}. Leave them out, or widen the envelope."
            )

    @property
    def before(self) -> FloatArray:
        """Standard errors known before, infinite where nothing is, shape (p,)."""
        covariance, found = self.known.covariance, np.full(self.model.n_coefficients, np.inf)
        if covariance is None:
            return found
        errors = dict(zip(self.known.model.labels, np.sqrt(np.diag(covariance)), strict=True))
        for place, label in enumerate(self.model.labels):
            error = errors.get(label, 0.0)
            found[place] = error if error > 0.0 else np.inf  # nor NaN
        return found

    def aim(self, criterion: Criterion, wider: FloatArray | None = None) -> Aim:
        """Return what the dive is to make small."""
        sizes = np.maximum(self.sized(self.sizes), 1e-9)
        allowed = np.maximum(RELATIVE * np.abs(self.value), CONTRIBUTION * sizes) / reach_of()
        wider = np.ones(len(sizes)) if wider is None else wider
        # Correlations of a prior are left out: those of a jackknife are not known well enough.
        known = np.diag(self.before**-2.0) + self.nothing
        return Aim(criterion, allowed, self.replay, wider, known)

    def kept(self, several: list[Manoeuvre]) -> Sortie:
        """Sail manoeuvres in all waters, and weaken them where draws leave the envelope."""
        fleet, worst, n = self.fleet, "", len(self.fleet.matrices)
        under_way = np.array([float(fleet.helm.propeller is not None), 1.0, 1.0])
        off = np.zeros((len(several), 1, 1, 2))
        for _ in range(_TRIALS):
            told, overlays = joined(several, fleet.helm, fleet.envelope, self.samples)
            own = under_way * told.reshape(len(several), self.samples, 3)
            pilot = Pilot(fleet.envelope.area, own, fleet.envelope.period, off)
            orders = np.repeat(told[:, None], n, axis=1), np.repeat(overlays[:, None], n, axis=1)
            voyage = fleet.sail(orders, self.seed, pilot)
            limits = passed(self.fleet.envelope, voyage)
            strays = {name: np.any(one > 0.0, axis=0) for name, one in limits.items()}
            within = 1.0 - float(np.mean(np.any(list(strays.values()), axis=0)))
            if within >= _WITHIN:
                return Sortie(several, overlays, np.array(pilot.courses), voyage, within)
            name = max(strays, key=lambda one: float(np.mean(strays[one])))
            share, far = np.mean(strays[name]), limits[name].max()
            worst = f"`{name}` is left in {share:.0%} of the draws, by up to {far:.0%}"
            off = pilot.learnt(voyage)
            # The few draws that may stray do not count.
            worst_of = np.max([one.max(axis=0) for one in limits.values()], axis=0)
            most = np.argsort(worst_of)[: int(np.ceil(_WITHIN * n))]
            counted = {name: one[:, most] for name, one in limits.items()}
            several = self._weakened(several, counted)
        raise ProblemError(
            f"no dive keeps to the envelope: after {_TRIALS} times weaker manoeuvres {worst}. "
            "Widen that limit, raise the lowest `speed`, or check the autopilot's gains."
        )

    def _weakened(self, several: list[Manoeuvre], limits: dict[str, FloatArray]) -> list[Manoeuvre]:
        """Return manoeuvres slower where they are too fast, weaker where they are too wild.

        Where the area is left all are a little slower: each leads on from those before.
        """
        far = [one for name, one in limits.items() if name in Area.model_fields]
        if far and np.max(far) > 0.0:
            several = [one.slower(_SLOWER) for one in several]
        wild = [limits[name] for name in ("depth", "pitch", "roll")]
        too_fast, too_wild = self._where(limits["speed"] > 0.0), self._where(np.max(wild, 0) > 0.0)
        slower = [
            one.slower(_WEAKER) if f else one for one, f in zip(several, too_fast, strict=True)
        ]
        return [one.weaker(_WEAKER) if w else one for one, w in zip(slower, too_wild, strict=True)]

    def _where(self, out: BoolArray) -> BoolArray:
        """Return which stretches leave a limit in any draw, a few seconds after they end, too."""
        late = np.roll(out.any(axis=1), -round(_LATE / self.fleet.envelope.period))
        return np.asarray(late.reshape(-1, self.samples).any(axis=1))

    def wider(self, rehearsal: Rehearsal, voyage: Voyage) -> FloatArray:
        """Return by how much standard errors exceed the bound, the median of each axis."""
        ratio, found = rehearsal.error / self.bound(voyage), np.ones(self.model.n_coefficients)
        axes = np.array([label[0] for label in self.model.labels])
        for axis in np.unique(axes):
            found[axes == axis] = max(float(np.median(ratio[axes == axis])), 1.0)
        return found

    @property
    def nothing(self) -> FloatArray:
        """Information of one who knows that coefficients are not absurd."""
        return np.diag((100.0 * np.maximum(self.sized(self.sizes), 1e-9)) ** -2.0)

    def bound(self, voyage: Voyage) -> FloatArray:
        """Return Cramer and Rao's bound in the water that is known."""
        told = informed(self.fleet.in_waters([0]), voyage.part([0]), self.seen)
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(told[0] + self.nothing))))


def _believed(fleet: Fleet, samples: int) -> Fleet:
    """Leave out waters in which it cannot calmly turn to a course: the vehicle dives already."""
    turns = (0.0, 0.75, 0.0, *[0.0] * len(fleet.helm.overlays))
    calm = [Manoeuvre("steps", level, 0.0, turns) for level in (0.0, 0.5, 1.0)]
    keeps = strayed(fleet, sailed(fleet, calm, samples)).max(axis=0) <= 0.0
    keeps[0] = True
    if keeps.sum() < VERIFIED:
        raise ProblemError(
            f"in {1.0 - keeps.mean():.0%} of the waters that may be, the autopilot leaves the "
            "envelope as it turns to a course. Raise the lowest `speed`, give the `autopilot` its "
            "gains, or plan with a fit that knows the water better."
        )
    return fleet.in_waters(np.flatnonzero(keeps)[:VERIFIED].tolist())


def _steps(alone: Fleet, samples: int, stretches: int) -> list[Manoeuvre]:
    """Return a campaign of steps, each as large as the envelope lets it be."""
    helm = alone.helm
    several = campaign(len(helm.overlays), helm.hovers)
    offered = [one.weaker(share) for one in several for share in _STRENGTHS]
    worst = strayed(alone, sailed(alone, offered, samples)).reshape(len(several), -1)
    fits = worst < 0.0
    fits[:, -1] = True  # if need be, the weakest
    best = fits.argmax(axis=1)
    found = [one.weaker(_STRENGTHS[place]) for one, place in zip(several, best, strict=True)]
    return [found[n % len(found)] for n in range(stretches)]


def _sizes(alone: Fleet, voyage: Voyage, seed: int) -> FloatArray:
    """Return the coefficients of the wide model that would make all the force on their axis.

    The motion counts as no smaller than ``_MOTION``: a column that was hardly moved says nothing.
    """
    log = voyage.log(alone.vehicle, alone.helm.names, exact=True)
    moved = np.random.default_rng(seed).standard_normal(log.velocity.shape) * _MOTION
    wide, damping = alone.waters.wide, alone.waters.dampings[0]
    problem = prepare(alone.vehicle, replace(log, velocity=log.velocity + moved), wide)
    columns = problem.regressor()[:, problem.columns.n_known :]
    own = problem.matrix(damping)[problem.columns.n_known :]
    force = np.sqrt(np.mean((columns @ own) ** 2, axis=0))
    size = dict(zip(problem.columns.basis, np.sqrt(np.mean(columns**2, axis=0)), strict=True))
    rows = zip(force, wide.terms, strict=True)
    made = [f / (size[t] or 1.0) for f, terms in rows for t in terms]
    return np.array(made)
