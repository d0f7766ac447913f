"""What stands along the axes of figures: SNAME symbols (1950), units, scales of wide range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.models.model import latex_label, read_label
from hydrodamp.simulation.score import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def velocity_unit(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the unit a velocity is shown in."""
    return "m/s" if name in VELOCITIES[:3] else f"{rate_unit}/s"


def velocity_label(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the label of an axis that shows a velocity."""
    return f"${name}$ [{velocity_unit(name, rate_unit)}]"


def shown(velocity: FloatArray, name: str, rate_unit: RateUnit = "deg") -> FloatArray:
    """Return one column of velocities in the unit it is shown in."""
    column = velocity[:, VELOCITIES.index(name)]
    return np.degrees(column) if velocity_unit(name, rate_unit) == "deg/s" else column


def wrench_unit(axis: str) -> str:
    """Return the unit of an axis of a wrench."""
    return "N" if axis in "XYZ" else "N m"


def coefficient_symbol(label: str) -> str:
    r"""Return the symbol of a coefficient as matplotlib's mathematics."""
    spelt = latex_label(*read_label(label))
    for bar in (r"\lvert ", r"\lvert", r"\rvert ", r"\rvert"):
        spelt = spelt.replace(bar, "|")
    return f"${spelt}$"


def error_scale(panel: Axes) -> None:
    """Put a logarithmic scale with plain numbers up the side of a panel that is drawn."""
    from matplotlib.ticker import LogLocator, NullLocator

    panel.set_yscale("log")
    low, high = panel.get_ylim()
    few = high < 1000.0 * low
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=9))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter("{x:g}")


def signed_scale(
    panel: Axes,
    side: Literal["x", "y"],
    values: FloatArray,
    *,
    beyond: float,
    decades: int,
    ticks: int,
) -> None:
    """Put a scale for numbers of either sign along a panel, linear in a stretch about zero."""
    from matplotlib.ticker import NullLocator

    finite = values[np.isfinite(values)]
    sizes = np.abs(finite[finite != 0.0])
    powers = np.floor(np.log10(sizes)) if sizes.size else np.zeros(1)
    # The linear stretch holds a quarter of the numbers.
    first = float(max(np.floor(np.quantile(powers, 0.25)), powers.max() - decades))
    low, high = (
        beyond * finite.min(initial=-(10.0**first)),
        beyond * finite.max(initial=10.0**first),
    )
    places = [0.0]
    for sign, end in ((-1.0, -low), (1.0, high)):
        outward = np.arange(first, np.floor(np.log10(end)) + 1.0)
        places += (sign * 10.0 ** outward[::-1][:: -(-len(outward) // ticks)]).tolist()
    set_scale = panel.set_xscale if side == "x" else panel.set_yscale
    set_scale("symlog", linthresh=10.0**first)
    panel.set(**{f"{side}lim": (low, high), f"{side}ticks": sorted(places)})
    (panel.xaxis if side == "x" else panel.yaxis).set_minor_locator(NullLocator())
