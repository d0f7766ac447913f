"""Numbers that no vehicle in water has: infinite ones, and speeds without bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES

FASTEST = 50.0
"""Largest component of a recorded velocity [m/s, rad/s]; beyond it a replay has diverged."""

COLUMNS_OF = {
    "velocity": VELOCITIES,
    "acceleration": tuple(f"d{name}" for name in VELOCITIES),
    "wrench": AXES,
    "attitude": ("qw", "qx", "qy", "qz"),
}
"""What the columns of each array of a log are called."""


def speed_faults(
    velocity: FloatArray, place: Callable[[int], str], names: Sequence[str] = VELOCITIES
) -> Iterator[str]:
    """Yield a sentence for each velocity that is larger than :data:`FASTEST`."""
    for column, (name, values) in enumerate(zip(VELOCITIES, velocity.T, strict=True)):
        with np.errstate(invalid="ignore"):
            over = np.flatnonzero((np.abs(values) > FASTEST) & np.isfinite(values))
        if name not in names or len(over) == 0:
            continue
        first, more = int(over[0]), len(over) - 1
        unit = "m/s" if column < 3 else "rad/s"
        tail = f" and so in {more} more row{'s' if more > 1 else ''}" if more else ""
        degrees = "" if column < 3 else "If rates are in deg/s, convert them. "
        yield (
            f"`{name}` must be at most {FASTEST:g} {unit} in size; it is {values[first]:.4g} in"
            f" {place(first)}{tail}. {degrees}If it is a spike, put NaN or nothing there: that"
            " marks a missing sample"
        )


def unbounded(name: str, block: FloatArray) -> tuple[str, int, float] | None:
    """Return the first number of an array that is not finite."""
    flat = block.reshape(len(block), -1)
    bad = np.argwhere(~np.isfinite(flat))
    if len(bad) == 0:
        return None
    row, column = bad[0].tolist()
    return COLUMNS_OF.get(name, (name,) * flat.shape[1])[column], row, float(flat[row, column])
