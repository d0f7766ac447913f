"""Operating range of the training data: exceedance by the test data, and energy injection.

Along one velocity x the damping power is x times a polynomial in |x|, for a fixed surge; it injects
energy (νᵀτ(ν) > 0) on the intervals between the roots where the polynomial is positive.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, MAX_FACTORS, VELOCITIES, VELOCITY_OF, Term
from hydrodamp.identification.dissipativity import is_damping_term, velocity_box
from hydrodamp.models.damping import Damping

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


def range_exceedance_warnings(training: Ranges, test: Ranges) -> Iterator[str]:
    """Yield a sentence on the velocities of the test data beyond the training data."""
    exceedances = []
    for name in filter(test.__contains__, training):
        trained, tested = (max(map(abs, ranges[name])) for ranges in (training, test))
        if tested > _MIN_EXCEEDANCE * trained:
            exceedances.append(
                f"{name} reaches {tested:.2g} {_unit(name)} in the test, {trained:.2g} in training"
            )
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
            injections[name] = f"{name} {_interval(*min(unstable), _unit(name))}"
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


def _unit(name: str) -> str:
    return "m/s" if name in VELOCITIES[:3] else "rad/s"
