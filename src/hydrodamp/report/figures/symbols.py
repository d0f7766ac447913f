"""Words of figures: SNAME symbols (1950), units in brackets, names from files as they are."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.models.labels import latex_label, read_label
from hydrodamp.simulation.score import RateUnit


def velocity_label(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the label of an axis that shows a velocity."""
    return f"${name}$ [{velocity_unit(name, rate_unit)}]"


def velocity_unit(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the unit a velocity is shown in."""
    return "m/s" if name in VELOCITIES[:3] else f"{rate_unit}/s"


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


def plain(text: object) -> str:
    r"""Return words that came from a file so that matplotlib prints them as they are."""
    one_line = "".join(each if each.isprintable() else " " for each in str(text))
    return one_line.replace("$", r"\$")


def shortened(text: str, room: int) -> str:
    """Return words cut to a number of letters."""
    return text if len(text) <= room else f"{text[: max(room - 1, 1)]}…"
