"""The power a damping model puts into the motion, and the worst of it on a box."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

Measure = Callable[[FloatArray], FloatArray]
"""Gives a number at each of many velocities, shape (m, 6)."""

_SPREAD = 2048
"""Quasi-random velocities looked at."""

_GOLDEN = 1.1127756842787055
"""Root of ``x^7 = x + 1``: its inverse powers spread a Kronecker sequence in six
dimensions as the golden ratio does in one."""

_POLISHED = 128
"""How many of the worst are polished."""

_FIRST_STEP = 0.25
_LAST_STEP = 1e-5
"""Steps of the search as a share of the box: it ends when none longer helps."""

_MOVES = 200
"""A search ends after this many steps at the latest."""


def dissipates(term: Term) -> bool:
    """Tell whether a term is damping: a function of the velocities alone, zero at rest."""
    foreign = term.commands or term.needs_attitude or term.needs_propulsion
    return bool(term.velocities) and not foreign


@dataclass(frozen=True)
class PowerRows:
    """Power as a linear function of the coefficients: ``ν·τ(ν) = row(ν)·κ``."""

    model: DampingModel

    @cached_property
    def counted(self) -> BoolArray:
        """Which coefficients belong to damping terms, shape (n_coefficients,)."""
        return np.array([dissipates(term) for row in self.model.terms for term in row], dtype=bool)

    @cached_property
    def velocities(self) -> BoolArray:
        """Which velocities the power depends on, shape (6,)."""
        used = {name for term in self._basis for name in term.velocities}
        used |= {VELOCITIES[axis] for axis in self._places[0]}
        return np.array([name in used for name in VELOCITIES])

    @cached_property
    def _basis(self) -> Basis:
        return Basis(tuple(term for term in self.model.basis if dissipates(term)))

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Axis and column of every counted coefficient."""
        column = {term: place for place, term in enumerate(self._basis)}
        pairs = [
            (axis, column[term])
            for axis, row in enumerate(self.model.terms)
            for term in row
            if term in column
        ]
        axes, columns = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return axes, columns

    def rows(self, velocity: FloatArray) -> FloatArray:
        """Return the rows at some velocities."""
        rows = np.zeros((len(velocity), self.model.n_coefficients))
        axes, columns = self._places
        rows[:, self.counted] = velocity[:, axes] * self._basis.evaluate(velocity)[:, columns]
        return rows

    def power(self, coefficients: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the power of the damping terms."""
        axes, columns = self._places
        matrix = np.zeros((len(self._basis), 6))
        matrix[columns, axes] = coefficients[self.counted]
        wrench = self._basis.evaluate(velocity) @ matrix
        return np.asarray(np.sum(velocity * wrench, axis=1))


@dataclass(frozen=True, eq=False)
class WorstPower:
    """The greatest power found on a box.

    Attributes
    ----------
    power : float
        [W]. Negative where damping takes power at every velocity looked at.
    velocity : ndarray, shape (6,)
        Where: u v w [m/s] p q r [rad/s].
    """

    power: float
    velocity: FloatArray

    def __str__(self) -> str:
        """Return the power and the place."""
        place = ", ".join(
            f"{name} {value:.3g}"
            for name, value in zip(VELOCITIES, self.velocity, strict=True)
            if abs(value) > 1e-9
        )
        return f"{self.power:.3g} W at {place or 'rest'}"


def worst_power(damping: Damping, box: OperatingBox) -> WorstPower:
    """Search the velocity of a box at which a damping puts most power into the motion.

    Corners, middles and quasi-random velocities are looked at; the worst are improved
    by a compass search. What it finds is there; that there is no worse is not proven.

    Parameters
    ----------
    damping : Damping
        Coefficients, however they were found. Only its damping terms count.
    box : OperatingBox
        Where to search.

    Returns
    -------
    worst : WorstPower
        The greatest power found.

    Examples
    --------
    >>> damping = Damping.from_dict(None, {"X_u": -2.0, "Y_v": 1.0})
    >>> box = OperatingBox([1, -3, 0, 0, 0, 0], [2, 3, 0, 0, 0, 0])
    >>> round(worst_power(damping, box).power, 6)
    7.0
    """
    rows = PowerRows(damping.model)
    return worst_found(lambda velocity: rows.power(damping.coefficients, velocity), box)


def worst_found(power: Measure, box: OperatingBox) -> WorstPower:
    """Return the greatest power that a search of a box finds."""
    places = worst_places(power, box)
    values = power(places)
    worst = int(np.argmax(values))
    return WorstPower(float(values[worst]), places[worst])


def worst_places(value: Measure, box: OperatingBox) -> FloatArray:
    """Return velocities of a box at which something is locally greatest."""
    starts = spread(box)
    worst = np.argsort(value(starts))[-_POLISHED:]
    return _climbed(value, starts[worst], box)


def size(velocity: FloatArray, box: OperatingBox) -> FloatArray:
    """Return the sum of squares of velocities relative to the box."""
    extent = np.where(box.extent > 0.0, box.extent, 1.0)
    return np.asarray(np.sum((velocity / extent) ** 2, axis=1) + 1e-9)


def spread(box: OperatingBox) -> FloatArray:
    """Return velocities all over a box: corners, middles and a quasi-random sequence."""
    grid = np.array(list(product((0.0, 0.5, 1.0), repeat=6)))
    scattered = np.outer(np.arange(_SPREAD), _GOLDEN ** -np.arange(1.0, 7.0)) % 1.0
    return np.unique(box.at(np.vstack([grid, scattered])), axis=0)


def _climbed(value: Measure, points: FloatArray, box: OperatingBox) -> FloatArray:
    """Improve all points at once by steps along axes and across, halved where none helps."""
    oblique = np.linalg.qr(np.random.default_rng(0).normal(size=(6, 6)))[0]
    directions = np.vstack([np.eye(6), -np.eye(6), oblique, -oblique])[:, None, :]
    directions = directions * (box.high - box.low)
    best, step = value(points), np.full(len(points), _FIRST_STEP)
    each = np.arange(len(points))
    for _ in range(_MOVES):
        trial = np.clip(points + step[:, None] * directions, box.low, box.high)
        values = value(trial.reshape(-1, 6)).reshape(len(directions), -1)
        chosen = np.argmax(values, axis=0)
        better = values[chosen, each] > best
        points = np.where(better[:, None], trial[chosen, each], points)
        best = np.where(better, values[chosen, each], best)
        step = np.where(better, step, 0.5 * step)
        if step.max() < _LAST_STEP:
            break
    return points
