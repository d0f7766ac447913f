"""A scale for numbers of either sign and any size: coefficients of one axis, side by side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from hydrodamp.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

_FEW = 2.0
"""Powers of ten in a range below which twice and five times each are written too."""

_MOST = 9
"""Powers of ten written in a range."""

_SMALL = 0.25
"""Share of the numbers that may lie in the linear stretch about zero."""


@dataclass(frozen=True)
class SignedScale:
    """Logarithmic to both sides of a linear stretch about zero."""

    linear: float
    low: float
    high: float

    @classmethod
    def of(cls, values: FloatArray, *, beyond: float, decades: int) -> SignedScale:
        """Return the scale for some numbers."""
        finite = values[np.isfinite(values)]
        sizes = np.abs(finite[finite != 0.0])
        powers = np.floor(np.log10(sizes)) if len(sizes) else np.zeros(1)
        low_power = np.floor(np.quantile(powers, _SMALL))
        linear = 10.0 ** float(max(low_power, powers.max() - decades))
        low, high = float(finite.min(initial=-linear)), float(finite.max(initial=linear))
        return cls(linear, beyond * low, beyond * high)

    def ticks(self, most: int) -> tuple[float, ...]:
        """Return zero and a few powers of ten to either side, the greatest among them."""
        ticks = [0.0]
        for sign, end in ((-1.0, -self.low), (1.0, self.high)):
            powers = np.arange(round(np.log10(self.linear)), np.floor(np.log10(end)) + 1)
            chosen = powers[::-1][:: max(-(-len(powers) // most), 1)]
            ticks += [sign * 10.0**power for power in chosen.tolist()]
        return tuple(sorted(ticks))

    def along(self, panel: Axes, direction: Literal["x", "y"], most: int = 2) -> None:
        """Scale one direction of a panel."""
        if direction == "x":
            panel.set_xscale("symlog", linthresh=self.linear)
            panel.set_xlim(self.low, self.high)
            panel.set_xticks([], minor=True)
            panel.set_xticks(self.ticks(most))
        else:
            panel.set_yscale("symlog", linthresh=self.linear)
            panel.set_ylim(self.low, self.high)
            panel.set_yticks([], minor=True)
            panel.set_yticks(self.ticks(most))


def round_ticks(axis: Axis, low: float, high: float) -> None:
    """Write plain round numbers along a logarithmic axis: tens, or 1, 2 and 5 of each."""
    numbers = round_numbers(low, high)
    axis.set_ticks(numbers, [f"{number:g}" for number in numbers])
    axis.set_ticks([], minor=True)


def round_numbers(low: float, high: float) -> list[float]:
    """Return round numbers of a range."""
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    few = np.log10(high / low) < _FEW
    steps = (1.0, 2.0, 5.0) if few else (1.0,)
    every = -(-len(powers) // _MOST) if not few else 1
    numbers = [float(f"{step:g}e{power}") for power in powers[::every] for step in steps]
    return [number for number in numbers if low <= number <= high]
