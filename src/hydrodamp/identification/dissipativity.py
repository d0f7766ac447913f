"""Damping power ``ν·τ(ν)`` over an operating box: maximum, regressors, intervals of injection.

The power is linear in the coefficients. Along one velocity x it is x times a polynomial in |x|,
for a fixed surge; the damping injects energy (νᵀτ(ν) > 0) on the intervals between the roots where
the polynomial is positive. The operating range of test data may exceed that of the training data.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, freeze
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import AXES, MAX_FACTORS, VELOCITIES, VELOCITY_OF, Term
from hydrodamp.errors import MethodError
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

# Share of the samples excluded at either end, so that outliers do not set the box, and the share
# by which the quantiles are widened, since replays exceed them slightly.
TAIL, _WIDENING = 0.01, 0.25

# Least surge of a vehicle under way, as a share of the greatest.
_MIN_SURGE_SHARE = 0.05

# Number of quasi-random velocities, and of the worst that are refined. The root of x^7 = x + 1: its
# inverse powers generate a Kronecker sequence in six dimensions, as the golden ratio does in one.
_N_SAMPLES, _N_REFINED, _GENERATOR = 2048, 128, 1.1127756842787055

# Initial and final step of the compass search as a share of the box; maximum iterations.
_FIRST_STEP, _LAST_STEP, _MAX_ITERATIONS = 0.25, 1e-5, 200

# Grid points of one velocity for which the others are varied.
_N_GRID = 25


@dataclass(frozen=True, eq=False)
class OperatingBox:
    """Interval of each velocity.

    Parameters
    ----------
    low, high : array_like, shape (6,)
        Bounds of u v w [m/s] p q r [rad/s], body frame. Both zero for a locked velocity.

    Raises
    ------
    MethodError
        If a bound is not finite, or a lower bound exceeds its upper bound.

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
        invalid = ~(np.isfinite(self.low) & np.isfinite(self.high) & (self.low <= self.high))
        if invalid.any():
            first = int(np.argmax(invalid))
            raise MethodError(
                f"the operating box must be finite with `low` <= `high`; got {VELOCITIES[first]} "
                f"from {self.low[first]:g} to {self.high[first]:g}."
            )

    @property
    def max_abs(self) -> FloatArray:
        """Maximum absolute value of each velocity, shape (6,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    @property
    def min_abs(self) -> FloatArray:
        """Minimum absolute value of each velocity, shape (6,); zero where the sign changes."""
        smallest = np.minimum(np.abs(self.low), np.abs(self.high))
        return np.where(self.low * self.high > 0.0, smallest, 0.0)

    def restrict(self, mask: BoolArray) -> OperatingBox:
        """Return the box with zero for velocities outside a mask."""
        return OperatingBox(self.low * mask, self.high * mask)

    def widen(self, share: float = _WIDENING) -> OperatingBox:
        """Return the box with every bound farther out by a share."""
        factor = 1.0 + share
        low = np.where(self.low < 0.0, self.low * factor, self.low / factor)
        high = np.where(self.high > 0.0, self.high * factor, self.high / factor)
        return OperatingBox(low, high)

    def at(self, fractions: FloatArray) -> FloatArray:
        """Return the velocities at fractions (n, 6) of the box, from 0, the lower bound, to 1."""
        return self.low + fractions * (self.high - self.low)

    def __str__(self) -> str:
        """Return the intervals of the velocities that are not locked."""
        return ", ".join(
            f"{name} {low:.3g} to {high:.3g} {'m/s' if name in 'uvw' else 'rad/s'}"
            for name, low, high in zip(VELOCITIES, self.low, self.high, strict=True)
            if low != 0.0 or high != 0.0
        )


def operating_box(problem: Problem) -> OperatingBox:
    """Return the operating box of a log: 1 % and 99 % quantiles of its velocities, 25 % wider.

    Every interval except that of surge is symmetric about zero, since the hull is symmetric.
    Surge has its own quantiles where its sign is constant, so that the box of a vehicle under
    way excludes zero; where surge changes sign or nearly vanishes, its interval is symmetric,
    too.

    Parameters
    ----------
    problem : Problem
        Velocities of the free axes.

    Returns
    -------
    box : OperatingBox
        Zero on locked axes.
    """
    return velocity_box(problem.inputs.velocity).widen()


def velocity_box(velocity: FloatArray, tail: float = TAIL) -> OperatingBox:
    """Return the box of some velocities, shape (n, 6)."""
    low, high = np.quantile(velocity, [tail, 1.0 - tail], axis=0)
    reach = np.maximum(np.abs(low), np.abs(high))
    below, above = -reach, reach.copy()
    if low[0] > _MIN_SURGE_SHARE * high[0]:
        below[0] = low[0]
    elif high[0] < _MIN_SURGE_SHARE * low[0]:
        above[0] = high[0]
    return OperatingBox(below, above)


def axis_terms(model: DampingModel) -> list[tuple[int, Term]]:
    """Return axis and term of every coefficient."""
    return [(axis, term) for axis, terms in enumerate(model.terms) for term in terms]


def is_damping_term(term: Term) -> bool:
    """Whether a term is damping: a function of the velocities alone, zero at rest."""
    depends_on_more = term.commands or term.needs_attitude or term.needs_propulsion
    return bool(term.velocities) and not depends_on_more


@dataclass(frozen=True)
class PowerRegressor:
    """Power as a linear function of the coefficients: ``ν·τ(ν) = row(ν)·κ``.

    In products of a velocity and an absolute value, such as v|r|, the absolute values may be
    independent variables, called speeds.
    """

    model: DampingModel

    @cached_property
    def counted(self) -> BoolArray:
        """Which coefficients belong to damping terms, shape (n_coefficients,)."""
        return np.array([is_damping_term(term) for _, term in axis_terms(self.model)], dtype=bool)

    @cached_property
    def velocities(self) -> BoolArray:
        """Which velocities the power depends on, shape (6,)."""
        pairs = [(axis, term) for axis, term in axis_terms(self.model) if is_damping_term(term)]
        used = {name for axis, term in pairs for name in (VELOCITIES[axis], *term.velocities)}
        return np.array([name in used for name in VELOCITIES])

    @cached_property
    def _table(self) -> tuple[Basis, IntArray, IntArray, IntArray]:
        """Terms without the absolute values of products; axis, column and speed of each."""
        pairs = [(axis, term) for axis, term in axis_terms(self.model) if is_damping_term(term)]
        entries = [(axis, *_without_speed(term)) for axis, term in pairs]
        basis = Basis(tuple(dict.fromkeys(term for _, term, _ in entries)))
        indices = [(axis, basis.index(term), speed) for axis, term, speed in entries]
        axes, columns, speeds = np.array(indices, dtype=np.intp).reshape(-1, 3).T
        return basis, axes, columns, speeds

    def rows(self, velocity: FloatArray, speeds: FloatArray | None = None) -> FloatArray:
        """Return the rows at velocities (n, 6), optionally with independent speeds (n, 6)."""
        basis, axes, columns, speed_index = self._table
        factors = np.abs(velocity) if speeds is None else speeds
        factors = np.column_stack([factors, np.ones(len(velocity))])  # the last: no speed
        rows = np.zeros((len(velocity), self.model.n_coefficients))
        values = velocity[:, axes] * basis.evaluate(velocity)[:, columns]
        rows[:, self.counted] = values * factors[:, speed_index]
        return rows

    def power(
        self, coefficients: FloatArray, velocity: FloatArray, box: OperatingBox | None = None
    ) -> FloatArray:
        """Return the power of the damping terms; with a box the greatest over the speeds."""
        base, by_speed = self._by_speed(coefficients, velocity)
        speeds = np.abs(velocity) if box is None else _worst(by_speed, box)
        return np.asarray(base + np.sum(speeds * by_speed, axis=1))

    def worst_speeds(
        self, coefficients: FloatArray, velocity: FloatArray, box: OperatingBox
    ) -> FloatArray:
        """Return the speeds of a box at which the power is greatest."""
        return _worst(self._by_speed(coefficients, velocity)[1], box)

    def _by_speed(
        self, coefficients: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the power independent of speeds (n,), and per unit of each speed (n, 6)."""
        basis, axes, columns, speed_index = self._table
        table = np.zeros((7, len(basis), 6))
        np.add.at(table, (speed_index, columns, axes), coefficients[self.counted])
        power = np.einsum("sna,na->ns", basis.evaluate(velocity) @ table, velocity)
        return power[:, 6], power[:, :6]


def _without_speed(term: Term) -> tuple[Term, int]:
    """Return velocity and index of the speed of a product; term and 6 for any other term."""
    if len(term.factors) == 2 and term.factors[0] in VELOCITIES and term.factors[1][0] == "|":
        return Term(term.factors[:1]), VELOCITIES.index(term.factors[1].strip("|"))
    return term, 6


def _worst(by_speed: FloatArray, box: OperatingBox) -> FloatArray:
    return np.where(by_speed > 0.0, box.max_abs, box.min_abs)


class PowerMaximum(NamedTuple):
    """Maximum damping power on a box.

    Attributes
    ----------
    power : float
        [W]. Negative where the damping is dissipative at every sampled velocity.
    velocity : ndarray, shape (6,)
        At which it occurs: u v w [m/s] p q r [rad/s].
    """

    power: float
    velocity: FloatArray


def max_damping_power(damping: Damping, box: OperatingBox) -> PowerMaximum:
    """Search for the velocity of a box at which a damping injects most power into the motion.

    Corners, midpoints and quasi-random velocities are evaluated; the worst are refined
    by a compass search. The maximum is a lower bound; it is not proven to be global.

    Parameters
    ----------
    damping : Damping
        Coefficients. Only damping terms count.
    box : OperatingBox
        Range of the search.

    Returns
    -------
    worst : PowerMaximum
        The greatest power and its velocity.

    Examples
    --------
    >>> damping = Damping.from_dict(None, {"X_u": -2.0, "Y_v": 1.0})
    >>> box = OperatingBox([1, -3, 0, 0, 0, 0], [2, 3, 0, 0, 0, 0])
    >>> round(max_damping_power(damping, box).power, 6)
    7.0
    """
    rows = PowerRegressor(damping.model)

    def power(velocity: FloatArray) -> FloatArray:
        return rows.power(damping.coefficients, velocity)

    velocities = local_maxima(power, box)
    values = power(velocities)
    worst = int(np.argmax(values))
    return PowerMaximum(float(values[worst]), velocities[worst])


def relative_square(velocity: FloatArray, box: OperatingBox) -> FloatArray:
    """Return the sum of squares of velocities relative to the box."""
    extent = np.where(box.max_abs > 0.0, box.max_abs, 1.0)
    return np.asarray(np.sum((velocity / extent) ** 2, axis=1) + 1e-9)


def sample_box(box: OperatingBox) -> FloatArray:
    """Return samples of a box: corners, midpoints and a quasi-random sequence."""
    grid = np.array(list(product((0.0, 0.5, 1.0), repeat=6)))
    sequence = np.outer(np.arange(_N_SAMPLES), _GENERATOR ** -np.arange(1.0, 7.0)) % 1.0
    return np.unique(box.at(np.vstack([grid, sequence])), axis=0)


def local_maxima(value: Callable[[FloatArray], FloatArray], box: OperatingBox) -> FloatArray:
    """Return local maximisers of a function over a box, by parallel compass searches.

    Steps along coordinate and oblique directions are halved where none increases the value.
    """
    starts = sample_box(box)
    points = starts[np.argsort(value(starts))[-_N_REFINED:]]
    oblique = np.linalg.qr(np.random.default_rng(0).normal(size=(6, 6)))[0]
    directions = np.vstack([np.eye(6), -np.eye(6), oblique, -oblique])[:, None, :]
    directions = directions * (box.high - box.low)
    best, step = value(points), np.full(len(points), _FIRST_STEP)
    index = np.arange(len(points))
    for _ in range(_MAX_ITERATIONS):
        trial = np.clip(points + step[:, None] * directions, box.low, box.high)
        values = value(trial.reshape(-1, 6)).reshape(len(directions), -1)
        direction = np.argmax(values, axis=0)
        better = values[direction, index] > best
        points = np.where(better[:, None], trial[direction, index], points)
        best = np.where(better, values[direction, index], best)
        step = np.where(better, step, 0.5 * step)
        if step.max() < _LAST_STEP:
            break
    return points


def power_range(damping: Damping, box: OperatingBox, name: str) -> tuple[FloatArray, FloatArray]:
    """Return a grid of one velocity (n,), and the power at samples of the others, shape (n, m)."""
    axis, rows = VELOCITIES.index(name), PowerRegressor(damping.model)
    values = np.linspace(box.low[axis], box.high[axis], _N_GRID)
    is_axis = np.arange(6) == axis
    low, high = (np.where(is_axis, 0.0, bound) for bound in (box.low, box.high))
    samples = sample_box(OperatingBox(low, high))
    velocities = (np.where(is_axis, v, samples) for v in values.tolist())
    power = [rows.power(damping.coefficients, velocity) for velocity in velocities]
    return values, np.array(power)


# Minimum and maximum of velocities [m/s, rad/s].
Ranges = Mapping[str, tuple[float, float]]

# Test over training speed [1] that is reported.
_MIN_EXCEEDANCE = 1.1

# Energy injection is reported up to this multiple [1] of the largest training speed.
_MAX_REPORTED_SPEED = 1.5


def velocity_ranges(velocity: FloatArray, axes: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of the velocities of free axes, without outliers."""
    box = velocity_box(velocity)
    indices = {VELOCITY_OF[axis]: AXES.index(axis) for axis in axes}
    return {name: (float(box.low[k]), float(box.high[k])) for name, k in indices.items()}


def join_ranges(first: Ranges, second: Ranges) -> dict[str, tuple[float, float]]:
    """Return the union of ranges, velocity by velocity."""
    joined = dict(first)
    for name, (low, high) in second.items():
        lowest, highest = first.get(name, (low, high))
        joined[name] = (min(low, lowest), max(high, highest))
    return joined


def find_exceedances(training: Ranges, test: Ranges) -> dict[str, tuple[float, float]]:
    """Return the largest speeds of both, by velocity that is beyond the training data."""
    largest = {
        name: (max(map(abs, training[name])), max(map(abs, test[name])))
        for name in filter(test.__contains__, training)
    }
    return {name: pair for name, pair in largest.items() if pair[1] > _MIN_EXCEEDANCE * pair[0]}


def range_exceedance_warnings(training: Ranges, test: Ranges) -> Iterator[str]:
    """Yield a sentence on the velocities of the test data beyond the training data."""
    exceedances = [
        f"{name} reaches {tested:.2g} {velocity_unit(name)} in the test, {trained:.2g} in training"
        for name, (trained, tested) in find_exceedances(training, test).items()
    ]
    if exceedances:
        yield f"Extrapolation beyond the training data: {'; '.join(exceedances)}."


def energy_injection_warnings(
    damping: Damping, ranges: Ranges, whose: str = "The"
) -> Iterator[str]:
    """Yield a sentence on the velocities that a damping increases near or beyond their ranges."""
    surge = float(np.clip(0.0, *ranges.get("u", (0.0, 0.0))))
    injections = {}
    for name, (low, high) in ranges.items():
        unstable = [
            (start, stop)  # A direction without data, such as astern, has a negative largest speed.
            for sign, largest in ((1.0, high), (-1.0, -low))
            for start, stop in unstable_speed_ranges(damping, name, sign, surge)
            if start < _MAX_REPORTED_SPEED * largest and stop > largest
        ]
        if unstable:
            injections[name] = f"{name} {_interval(*min(unstable), velocity_unit(name))}"
    if injections:
        at = f" (at a surge of {surge:.2g} m/s)" if surge and set(injections) != {"u"} else ""
        yield (
            f"{whose} damping injects energy into {', '.join(injections.values())}{at}: a replay "
            "may diverge there."
        )


def unstable_speed_ranges(
    damping: Damping, name: str, sign: float = 1.0, surge: float = 0.0
) -> list[tuple[float, float]]:
    """Return the speed ranges in which the damping of an axis increases its own velocity.

    ``sign`` is the direction; all other velocities are zero, except for a surge [m/s].
    """
    row = damping.model.terms[VELOCITIES.index(name)]
    axis = AXES[VELOCITIES.index(name)]
    power = np.zeros(MAX_FACTORS + 1)  # polynomial coefficients in the speed
    for term in row:
        if is_damping_term(term) and name in term.velocities:
            factor, degree = _monomial(term, name, sign, surge)
            power[degree] += sign * factor * damping[f"{axis}_{term}"]
    if not np.isfinite(power).all():  # a damping file may lack a coefficient
        return []
    # Division by the speed does not change the sign of the power.
    polynomial = np.polynomial.Polynomial(power[1:]).trim()
    roots = np.asarray(polynomial.roots(), dtype=np.complex128)
    real = roots.real[(roots.imag == 0.0) & (roots.real > 0.0)].tolist()
    intervals = pairwise(sorted({0.0, *real, math.inf}))
    return [(a, b) for a, b in intervals if polynomial(min(0.5 * (a + b), 2.0 * a + 1.0)) > 0.0]


def _monomial(term: Term, name: str, sign: float, surge: float) -> tuple[float, int]:
    """Return factor and degree of a term in one speed; with a surge, the total speed U is it."""
    ahead = surge if name != "u" else 0.0
    if term.vanishes_without(set(VELOCITIES) - {name, "u" if ahead else name}):
        return 0.0, 0
    constant = [atom for atom in term.factors if ahead and atom in ("u", "|u|", "U")]
    odd = sum(atom in (name, f"V_{name}") for atom in term.factors)
    factor = math.prod(ahead if atom == "u" else abs(ahead) for atom in constant)
    return factor * sign**odd, len(term.factors) - len(constant)


def _interval(start: float, stop: float, unit: str) -> str:
    """Return a range of speeds as text."""
    if math.isinf(stop):
        return f"beyond {start:.2g} {unit}" if start else "at any speed"
    return f"from {start:.2g} to {stop:.2g} {unit}" if start else f"up to {stop:.2g} {unit}"


def velocity_unit(name: str) -> str:
    """Return the unit of a velocity by its name."""
    return "m/s" if name in VELOCITIES[:3] else "rad/s"
