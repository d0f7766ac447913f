"""Origins and standard deviations of the values of a vehicle: those with one are estimated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np

from hydrodamp.basis.term import AXES
from hydrodamp.errors import VehicleError, no_such

Origin = Literal["measured", "published", "formula", "assumed"]
"""Where a value comes from; a formula takes the sizes of the hull."""

COMPONENTS: Mapping[str, Sequence[str]] = {
    "added_mass": AXES,
    "center_of_gravity": "xyz",
    "buoyancy": ("B",),
    "wrench_gain": AXES,
}
"""Components of each value that can have a standard deviation.

Those of added mass and of the gain of a recorded wrench are of the logarithm, that of buoyancy is a
share of the weight, that of the centre in metres.
"""

HULL_STD = (1.4, 0.3, 0.6, 1.5, 2.1, 2.3)
"""Of the logarithm of the added mass of a spheroid with small fins, by axis.

RMS of ln(published / formula) over the fleet: BlueROV2 (two sets), LAUV, REMUS 100 and VT 690.
"""

NEUTRAL_STD = 0.02
"""Of buoyancy over weight where a vehicle is assumed to be neutral: it was trimmed."""


WRENCH_GAIN_STD = 0.3
"""Of the logarithm of the gain of a recorded wrench: a thrust curve that was not calibrated."""


def checked_std(std: Mapping[str, Any]) -> dict[str, tuple[float, ...]]:
    """Return the standard deviation of each component by value: from numbers or percentages."""
    return {name: _components(name, entry) for name, entry in std.items()}


def checked_origin(origin: Mapping[str, str]) -> dict[str, str]:
    """Return the origins if they are known, of known values."""
    for name, entry in origin.items():
        _check_name("origin", name)
        if entry not in get_args(Origin):
            known = ", ".join(get_args(Origin))
            raise VehicleError(f"`origin`: `{name}` must be of {known}; got {entry!r}")
    return dict(origin)


def format_std(std: Mapping[str, Sequence[float]], origin: Mapping[str, str]) -> str:
    """Return the lines of a vehicle file, in percent."""
    rows = []
    for name, values in std.items():
        pairs = zip(COMPONENTS[name], values, strict=True)
        words = ", ".join(f"{component}: {100.0 * std:.3g} %" for component, std in pairs if std)
        rows.append(f"  {name}: {{{words}}}")
    origins = ", ".join(f"{name}: {word}" for name, word in origin.items())
    return "\n".join(["std:", *rows, f"origin: {{{origins}}}"])


def _check_name(field: str, name: str) -> None:
    if name not in COMPONENTS:
        raise VehicleError(f"`{field}`: {no_such('value', name, COMPONENTS)}")


def _components(name: str, entry: Any) -> tuple[float, ...]:
    _check_name("std", name)
    components = COMPONENTS[name]
    if isinstance(entry, Mapping):
        if unknown := [str(key) for key in entry if key not in components]:
            raise VehicleError(f"`std`: {no_such('component', unknown[0], components)}")
        entry = [entry.get(key, 0.0) for key in components]
    elif isinstance(entry, str | float | int):
        entry = [entry] * len(components)
    try:
        values = tuple(_number(each, name) for each in entry)
    except (TypeError, ValueError):
        values = ()
    if len(values) != len(components) or not all(0.0 <= each < np.inf for each in values):
        unit = "metres" if name == "center_of_gravity" else "a percentage such as '50 %' or a share"
        raise VehicleError(
            f"`std`: `{name}` must be {unit}, zero or positive: once, or for each of "
            f"{' '.join(components)}; got {entry!r}"
        )
    return values


def _number(entry: Any, name: str) -> float:
    if isinstance(entry, bool):
        raise TypeError
    text = str(entry).strip()
    if text.endswith("%") and name != "center_of_gravity":
        return float(text[:-1]) / 100.0
    return float(text)
