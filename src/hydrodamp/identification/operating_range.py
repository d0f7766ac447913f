"""How far velocities go beyond the training, and where a damping feeds the motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import MAX_FACTORS, Term
from hydrodamp.identification.dissipativity import is_damping_term, velocity_box
from hydrodamp.models.damping import Damping

# Least and greatest value of velocities [m/s, rad/s].
Ranges = Mapping[str, tuple[float, float]]

# From the first on a speed is told to be beyond the training's, up to the second feeding is told,
# both as multiples of the greatest speed sailed.
_BEYOND, _NEAR = 1.1, 1.5


def velocity_ranges(velocity: FloatArray, axes: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of the velocities of free axes, as an operating box has them."""
    box = velocity_box(velocity)
    places = {VELOCITY_OF[axis]: AXES.index(axis) for axis in axes}
    return {name: (float(box.low[k]), float(box.high[k])) for name, k in places.items()}


def join_ranges(one: Ranges, other: Ranges) -> dict[str, tuple[float, float]]:
    """Return the ranges that hold two; a velocity that one alone has keeps its range."""
    both = {
        name: (min(low, one[name][0]), max(high, one[name][1]))
        for name, (low, high) in other.items()
        if name in one
    }
    return {**one, **other, **both}


def range_exceedance_warnings(training: Ranges, test: Ranges) -> Iterator[str]:
    """Say which velocities reach further in the test than in training."""
    parts = []
    for name in filter(test.__contains__, training):
        here, there = (max(map(abs, ranges[name])) for ranges in (training, test))
        if there > _BEYOND * here:
            parts.append(
                f"{name} reaches {there:.2g} {_unit(name)} in the test, {here:.2g} in training"
            )
    if parts:
        yield f"Beyond the training data: {'; '.join(parts)}."


def energy_injection_warnings(
    damping: Damping, ranges: Ranges, whose: str = "The"
) -> Iterator[str]:
    """Say which velocities a damping feeds with energy near or beyond their ranges."""
    surge = float(np.clip(0.0, *ranges.get("u", (0.0, 0.0))))
    parts = {}
    for name, (low, high) in ranges.items():
        near = [
            (start, stop)
            # Nothing is said of a direction that was not sailed, such as astern.
            for sign, reach in ((1.0, high), (-1.0, -low))
            for start, stop in unstable_speed_ranges(damping, name, sign, surge)
            if start < _NEAR * reach and stop > reach
        ]
        if near:
            parts[name] = f"{name} {_between(*min(near), _unit(name))}"
    if parts:
        at = f" (at {surge:.2g} m/s of surge)" if surge and set(parts) != {"u"} else ""
        yield (
            f"{whose} damping feeds energy into {', '.join(parts.values())}{at}: a replay may run "
            "away there."
        )


def unstable_speed_ranges(
    damping: Damping, name: str, sign: float = 1.0, surge: float = 0.0
) -> list[tuple[float, float]]:
    """Return between which speeds, ahead or back, the damping of an axis feeds its own velocity.

    The other velocities are zero but for a surge. Then power is a polynomial of the speed.
    """
    row = damping.model.terms[VELOCITIES.index(name)]
    axis = AXES[VELOCITIES.index(name)]
    powers = np.zeros(MAX_FACTORS + 1)
    for term in row:
        if is_damping_term(term) and name in term.velocities:
            factor, degree = _alone(term, name, sign, surge)
            powers[degree] += sign * factor * damping[f"{axis}_{term}"]
    if not np.isfinite(powers).all():  # a damping file may lack a number
        return []
    # Division by the speed leaves the sign of the power.
    polynomial = np.polynomial.Polynomial(powers[1:]).trim()
    roots = np.asarray(polynomial.roots(), dtype=np.complex128)
    real = roots.real[(roots.imag == 0.0) & (roots.real > 0.0)].tolist()
    parts = pairwise(sorted({0.0, *real, math.inf}))
    return [(a, b) for a, b in parts if polynomial(min(0.5 * (a + b), 2.0 * a + 1.0)) > 0.0]


def _alone(term: Term, name: str, sign: float, surge: float) -> tuple[float, int]:
    """Return factor and degree of a term in one speed; the speed U beside a surge is that surge."""
    ahead = surge if name != "u" else 0.0
    if term.vanishes_without(set(VELOCITIES) - {name, "u" if ahead else name}):
        return 0.0, 0
    held = [atom for atom in term.factors if ahead and atom in ("u", "|u|", "U")]
    odd = sum(atom in (name, f"V_{name}") for atom in term.factors)
    factor = math.prod(ahead if atom == "u" else abs(ahead) for atom in held)
    return factor * sign**odd, len(term.factors) - len(held)


def _between(start: float, stop: float, unit: str) -> str:
    """Say between which speeds."""
    if math.isinf(stop):
        return f"beyond {start:.2g} {unit}" if start else "at any speed"
    return f"from {start:.2g} to {stop:.2g} {unit}" if start else f"up to {stop:.2g} {unit}"


def _unit(name: str) -> str:
    return "m/s" if name in VELOCITIES[:3] else "rad/s"
