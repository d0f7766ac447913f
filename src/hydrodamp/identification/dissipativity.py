"""The power a damping puts into the motion over the velocities a vehicle is operated at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, freeze
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

# Share of the samples left out at either end, so that outliers do not set the box, and the share
# by which the quantiles are widened, for a replay sails a little further.
TAIL, _WIDENING = 0.01, 0.25

# Least surge, as a share of the greatest, of a vehicle that is said to be under way.
_UNDER_WAY = 0.05

# Quasi-random velocities looked at, and how many of the worst are improved. The root of
# x^7 = x + 1: its inverse powers spread a Kronecker sequence in six dimensions as the golden ratio
# does in one.
_SPREAD, _POLISHED, _GOLDEN = 2048, 128, 1.1127756842787055

# Steps of the search as a share of the box: it ends when none longer helps, or after so many.
_FIRST_STEP, _LAST_STEP, _MOVES = 0.25, 1e-5, 200

# Values of a velocity at which the others are varied.
_PLACES = 25


@dataclass(frozen=True, eq=False)
class OperatingBox:
    """An interval for every velocity.

    Parameters
    ----------
    low, high : array_like, shape (6,)
        Bounds of u v w [m/s] p q r [rad/s], body frame. Both zero for a locked velocity.

    Raises
    ------
    MethodError
        If a bound is not finite, or a lower one above its upper one.

    Examples
    --------
    >>> print(OperatingBox([1, -0.2, 0, 0, 0, -0.3], [2, 0.2, 0, 0, 0, 0.3]))
    u 1 to 2 m/s, v -0.2 to 0.2 m/s, r -0.3 to 0.3 rad/s
    """

    low: FloatArray
    high: FloatArray

    def __post_init__(self) -> None:
        """Copy the bounds and check them."""
        freeze(self, MethodError, low=(6,), high=(6,))
        wrong = ~(np.isfinite(self.low) & np.isfinite(self.high) & (self.low <= self.high))
        if wrong.any():
            first = int(np.argmax(wrong))
            raise MethodError(
                f"the operating box must be finite with `low` <= `high`; got {VELOCITIES[first]} "
                f"from {self.low[first]:g} to {self.high[first]:g}."
            )

    @property
    def max_abs(self) -> FloatArray:
        """Greatest absolute value of each velocity, shape (6,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    @property
    def min_abs(self) -> FloatArray:
        """Least absolute value of each velocity, shape (6,); zero where it may vanish."""
        away = np.minimum(np.abs(self.low), np.abs(self.high))
        return np.where(self.low * self.high > 0.0, away, 0.0)

    def restrict(self, kept: BoolArray) -> OperatingBox:
        """Return the box with zero for velocities that are not kept."""
        return OperatingBox(self.low * kept, self.high * kept)

    def at(self, places: FloatArray) -> FloatArray:
        """Return the velocities at relative places (n, 6), 0 the lower bound and 1 the upper."""
        return self.low + places * (self.high - self.low)

    def __str__(self) -> str:
        """Return the intervals of the velocities that are not locked."""
        return ", ".join(
            f"{name} {low:.3g} to {high:.3g} {'m/s' if name in 'uvw' else 'rad/s'}"
            for name, low, high in zip(VELOCITIES, self.low, self.high, strict=True)
            if low != 0.0 or high != 0.0
        )


def operating_box(problem: Problem) -> OperatingBox:
    """Return the box that a log was sailed in: its velocities but for outliers, a quarter wider.

    Every velocity but surge gets an interval symmetric about zero: water does not know
    port from starboard. Surge gets its own quantiles where it keeps its sign, so that
    the box of a vehicle under way does not reach down to rest; where surge changes sign
    or nearly vanishes, the vehicle hovers and its interval is symmetric too.

    Parameters
    ----------
    problem : Problem
        Its velocities, of the free axes.

    Returns
    -------
    box : OperatingBox
        Zero on locked axes.
    """
    return velocity_box(problem.inputs.velocity, _WIDENING)


def velocity_box(velocity: FloatArray, widening: float = 0.0, tail: float = TAIL) -> OperatingBox:
    """Return the box of some velocities, shape (n, 6)."""
    low, high = np.quantile(velocity, [tail, 1.0 - tail], axis=0)
    reach = (1.0 + widening) * np.maximum(np.abs(low), np.abs(high))
    below, above = -reach, reach.copy()
    if low[0] > _UNDER_WAY * high[0]:
        below[0] = low[0] * (1.0 - widening)
    elif high[0] < _UNDER_WAY * low[0]:
        above[0] = high[0] * (1.0 - widening)
    return OperatingBox(below, above)


def is_damping_term(term: Term) -> bool:
    """Tell whether a term is damping: a function of the velocities alone, zero at rest."""
    foreign = term.commands or term.needs_attitude or term.needs_propulsion
    return bool(term.velocities) and not foreign


@dataclass(frozen=True)
class PowerRows:
    """Power as a linear function of the coefficients: ``ν·τ(ν) = row(ν)·κ``.

    In products of a velocity and an absolute value, such as v|r|, the absolute values may be taken
    apart from the velocities, as speeds of their own.
    """

    model: DampingModel

    @cached_property
    def counted(self) -> BoolArray:
        """Which coefficients belong to damping terms, shape (n_coefficients,)."""
        return np.array(
            [is_damping_term(term) for row in self.model.terms for term in row], dtype=bool
        )

    @cached_property
    def velocities(self) -> BoolArray:
        """Which velocities the power depends on, shape (6,)."""
        used = {
            name
            for own, row in zip(VELOCITIES, self.model.terms, strict=True)
            for term in filter(is_damping_term, row)
            for name in (own, *term.velocities)
        }
        return np.array([name in used for name in VELOCITIES])

    @cached_property
    def _table(self) -> tuple[Basis, IntArray, IntArray, IntArray]:
        """Return the terms without the absolute values of products; axis, column, speed of each."""
        found = [
            (axis, *_without_speed(term))
            for axis, row in enumerate(self.model.terms)
            for term in row
            if is_damping_term(term)
        ]
        basis = Basis(tuple(dict.fromkeys(term for _, term, _ in found)))
        places = [(axis, basis.index(term), speed) for axis, term, speed in found]
        axes, columns, speeds = np.array(places, dtype=np.intp).reshape(-1, 3).T
        return basis, axes, columns, speeds

    def rows(self, velocity: FloatArray, speeds: FloatArray | None = None) -> FloatArray:
        """Return the rows at some velocities, and at speeds where these are apart."""
        basis, axes, columns, places = self._table
        factors = np.abs(velocity) if speeds is None else speeds
        factors = np.column_stack([factors, np.ones(len(velocity))])  # the last for no speed
        rows = np.zeros((len(velocity), self.model.n_coefficients))
        values = velocity[:, axes] * basis.evaluate(velocity)[:, columns]
        rows[:, self.counted] = values * factors[:, places]
        return rows

    def power(
        self, coefficients: FloatArray, velocity: FloatArray, box: OperatingBox | None = None
    ) -> FloatArray:
        """Return the power of the damping terms; within a box that at the worst speeds."""
        rest, by_speed = self._by_speed(coefficients, velocity)
        speeds = np.abs(velocity) if box is None else _worst(by_speed, box)
        return np.asarray(rest + np.sum(speeds * by_speed, axis=1))

    def worst_speeds(
        self, coefficients: FloatArray, velocity: FloatArray, box: OperatingBox
    ) -> FloatArray:
        """Return the speeds within a box at which the power is greatest."""
        return _worst(self._by_speed(coefficients, velocity)[1], box)

    def _by_speed(
        self, coefficients: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the power without speeds (n,), and that for each unit of speed (n, 6)."""
        basis, axes, columns, places = self._table
        table = np.zeros((7, len(basis), 6))
        np.add.at(table, (places, columns, axes), coefficients[self.counted])
        power = np.einsum("sna,na->ns", basis.evaluate(velocity) @ table, velocity)
        return power[:, 6], power[:, :6]


def _without_speed(term: Term) -> tuple[Term, int]:
    """Return the velocity and the place of the speed of a product; the term and 6 for another."""
    if len(term.factors) == 2 and term.factors[0] in VELOCITIES and term.factors[1][0] == "|":
        return Term(term.factors[:1]), VELOCITIES.index(term.factors[1].strip("|"))
    return term, 6


def _worst(by_speed: FloatArray, box: OperatingBox) -> FloatArray:
    return np.where(by_speed > 0.0, box.max_abs, box.min_abs)


class PowerMaximum(NamedTuple):
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


def max_damping_power(damping: Damping, box: OperatingBox) -> PowerMaximum:
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
    worst : PowerMaximum
        The greatest power found.

    Examples
    --------
    >>> damping = Damping.from_dict(None, {"X_u": -2.0, "Y_v": 1.0})
    >>> box = OperatingBox([1, -3, 0, 0, 0, 0], [2, 3, 0, 0, 0, 0])
    >>> round(max_damping_power(damping, box).power, 6)
    7.0
    """
    rows = PowerRows(damping.model)

    def power(velocity: FloatArray) -> FloatArray:
        return rows.power(damping.coefficients, velocity)

    places = local_maxima(power, box)
    values = power(places)
    worst = int(np.argmax(values))
    return PowerMaximum(float(values[worst]), places[worst])


def relative_square(velocity: FloatArray, box: OperatingBox) -> FloatArray:
    """Return the sum of squares of velocities relative to the box."""
    extent = np.where(box.max_abs > 0.0, box.max_abs, 1.0)
    return np.asarray(np.sum((velocity / extent) ** 2, axis=1) + 1e-9)


def sample_box(box: OperatingBox) -> FloatArray:
    """Return velocities all over a box: corners, middles and a quasi-random sequence."""
    grid = np.array(list(product((0.0, 0.5, 1.0), repeat=6)))
    scattered = np.outer(np.arange(_SPREAD), _GOLDEN ** -np.arange(1.0, 7.0)) % 1.0
    return np.unique(box.at(np.vstack([grid, scattered])), axis=0)


def local_maxima(value: Callable[[FloatArray], FloatArray], box: OperatingBox) -> FloatArray:
    """Return velocities of a box at which something is locally greatest: a compass search.

    All points move at once by steps along axes and across, halved where none helps.
    """
    starts = sample_box(box)
    points = starts[np.argsort(value(starts))[-_POLISHED:]]
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


def power_range(damping: Damping, box: OperatingBox, name: str) -> tuple[FloatArray, FloatArray]:
    """Return values of one velocity, and the power at each over the others, shape (n, m)."""
    axis, rows = VELOCITIES.index(name), PowerRows(damping.model)
    values = np.linspace(box.low[axis], box.high[axis], _PLACES)
    here = np.arange(6) == axis
    low, high = (np.where(here, 0.0, bound) for bound in (box.low, box.high))
    others = sample_box(OperatingBox(low, high))
    power = [rows.power(damping.coefficients, np.where(here, v, others)) for v in values.tolist()]
    return values, np.array(power)
