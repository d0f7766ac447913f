"""The search for a dive: one manoeuvre after another, each the one that tells most beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from hydrodamp.arrays import FloatArray
from hydrodamp.planning.information import Seen, informed
from hydrodamp.planning.manoeuvres import Manoeuvre, classics
from hydrodamp.planning.sailing import Fleet, Voyage, passed

Criterion = Literal["determinant", "worst", "replay"]

#: Candidates of each generation, generations, and changes of those that are kept.
_MEMBERS, _GENERATIONS = 14, 4

#: What a share of a limit that is passed costs, against a factor e in all standard errors; how much
#: of each limit a manoeuvre leaves free for what comes before and after it.
_COST, _FREE = 20.0, 0.05

#: The norm that stands for the worst of several numbers.
_NORM = 8.0


@dataclass(frozen=True, eq=False)
class Aim:
    """What a dive is to make small.

    Attributes
    ----------
    criterion : {"determinant", "worst", "replay"}
        The volume of the coefficients' errors, the worst standard error against what is allowed,
        or the expected error of a replay.
    allowed : ndarray, shape (p,)
        Standard error of each coefficient that would do.
    replay : ndarray, shape (p, p)
        What replays are off by, squared, per error of the coefficients.
    wider : ndarray, shape (p,)
        By how much standard errors of fits exceed the bound.
    known : ndarray, shape (p, p)
        Information there is before.
    """

    criterion: Criterion
    allowed: FloatArray
    replay: FloatArray
    wider: FloatArray
    known: FloatArray

    def value(self, told: FloatArray, share: float) -> FloatArray:
        """Return what is to be made small where so large a share of a dive was told, (n,)."""
        unit, wider = np.outer(self.allowed, self.allowed), np.outer(self.wider, self.wider)
        whole = np.linalg.inv(told / share / wider + self.known) / unit
        return np.asarray(np.mean(self._size(whole), axis=-1))

    def _size(self, covariance: FloatArray) -> FloatArray:
        if self.criterion == "determinant":
            return np.asarray(0.5 * np.linalg.slogdet(covariance)[1] / len(self.allowed))
        if self.criterion == "worst":
            square = np.maximum(np.einsum("...pp->...p", covariance), 0.0)
            return np.asarray(0.5 / _NORM * np.log(np.sum(square**_NORM, axis=-1)))
        weight = self.replay * np.outer(self.allowed, self.allowed)
        return np.asarray(0.5 * np.log(np.einsum("...pq,pq->...", covariance, weight)))


@dataclass(frozen=True, eq=False)
class Designer:
    """Finds manoeuvres of so many samples for a vehicle in a few waters."""

    fleet: Fleet
    seen: Seen
    aim: Aim
    samples: int

    def tried(self, several: Sequence[Manoeuvre]) -> tuple[FloatArray, FloatArray]:
        """Return what manoeuvres tell in each water, (n, waters, p, p), and how far they stray."""
        voyage = sailed(self.fleet, several, self.samples)
        found = informed(self.fleet, voyage, self.seen)
        shape = len(several), len(self.fleet.matrices), *found.shape[1:]
        return found.reshape(shape), strayed(self.fleet, voyage)

    def next(
        self, told: FloatArray, share: float, start: Sequence[Manoeuvre], seed: int
    ) -> tuple[Manoeuvre, FloatArray]:
        """Return the manoeuvre that best follows what was told in each water, and all together."""
        best: list[tuple[float, Manoeuvre, FloatArray]] = []

        def cost(numbers: FloatArray, /) -> Any:
            several = [Manoeuvre.of(one) for one in np.atleast_2d(numbers.T)]
            found, passed = self.tried(several)
            after = found + told
            strays = np.maximum(passed + _FREE, 0.0).max(axis=1)
            costs = self.aim.value(after, share) + _COST * strays
            place = int(np.argmin(costs))
            best.append((float(costs[place]), several[place], after[place]))
            return costs

        first = np.array([one.numbers for one in start])
        differential_evolution(
            cost,
            Bounds(np.zeros(first.shape[1]), np.ones(first.shape[1])),
            init=np.clip(first, 0.0, 1.0),
            maxiter=_GENERATIONS,
            vectorized=True,
            updating="deferred",
            polish=False,
            rng=seed,
        )
        _, manoeuvre, after = min(best, key=lambda one: one[0])
        return manoeuvre, after

    def dive(
        self, stretches: int, seed: int, done: Callable[[], None] = lambda: None
    ) -> list[Manoeuvre]:
        """Return the manoeuvres of a dive in order."""
        p = len(self.aim.allowed)
        found: list[Manoeuvre] = []
        told = np.zeros((len(self.fleet.matrices), p, p))
        offered = classics(len(self.fleet.helm.overlays))
        for number in range(stretches):
            rng = np.random.default_rng([seed, number])
            start = [*found[-3:], *(offered[i] for i in rng.permutation(len(offered)))][:_MEMBERS]
            manoeuvre, told = self.next(told, (number + 1) / stretches, start, seed + number)
            found.append(manoeuvre)
            done()
        return found


def sailed(fleet: Fleet, several: Sequence[Manoeuvre], samples: int) -> Voyage:
    """Sail each manoeuvre in each water, from a steady run at half depth."""
    envelope, n = fleet.envelope, len(fleet.matrices)
    orders = [one.orders(fleet.helm, envelope, samples) for one in several]
    told = np.repeat(np.stack([one for one, _ in orders], axis=1), n, axis=1)
    overlays = np.repeat(np.stack([one for _, one in orders], axis=1), n, axis=1)
    told[:, :, 2] += envelope.middle
    return fleet.sail((told, overlays))


def strayed(fleet: Fleet, voyage: Voyage) -> FloatArray:
    """Return by how much each manoeuvre passes a limit in each water, shape (n, waters)."""
    limits = passed(fleet.envelope, voyage, area=False).values()
    worst = np.max([one.max(axis=0) for one in limits], axis=0)
    return np.reshape(worst, (-1, len(fleet.matrices)))
