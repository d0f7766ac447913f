"""Columns by their reserved names, put together to a record."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.basis.command_names import check_command_name
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import (
    ACCELERATION,
    ATTITUDE,
    EULER as EULER,
    POSITION as _POSITION,
    SPECIFIC_FORCE as _SPECIFIC_FORCE,
)
from hydrodamp.data.record import Record
from hydrodamp.errors import TermError, did_you_mean

ACCELERATIONS, POSITION, QUATERNION = ACCELERATION.columns, _POSITION.columns, ATTITUDE.columns
SPECIFIC_FORCE = _SPECIFIC_FORCE.columns

_TURN = 2 * np.pi
_CONVERT = "Convert, or give a mapping with unit: deg"


@dataclass(frozen=True, eq=False)
class Columns:
    """Named columns in SI units, forward-starboard-down and north-east-down."""

    numbers: Mapping[str, FloatArray]
    commands: tuple[str, ...] = ()
    labels: tuple[str, ...] | None = None
    lines: Sequence[int] | None = None
    source: str = ""

    def faults(self) -> list[str]:
        """Return what is wrong with the choice and content of the columns."""
        return [
            *_missing_faults(self.numbers),
            *_attitude_faults(self.numbers),
            *_acceleration_faults(self.numbers),
            *_triple_faults(self.numbers),
            *_command_faults(self.commands),
            *_empty_faults(self.numbers),
        ]

    def record(self) -> Record | None:
        """Return the record these columns make."""
        time = self.numbers.get("time")
        if time is None or len(time) == 0 or [*_attitude_faults(self.numbers)]:
            return None
        return Record(
            time=time,
            velocity=_side_by_side(self.numbers, VELOCITIES, len(time)),
            velocity_names=tuple(name for name in VELOCITIES if name in self.numbers),
            attitude=_attitude(self.numbers),
            commands={name: self.numbers[name] for name in self.commands},
            wrench=self._optional(AXES),
            acceleration=self._optional(ACCELERATIONS),
            propulsion_ratio=self.numbers.get("eta"),
            position=self._optional(POSITION),
            specific_force=self._optional(SPECIFIC_FORCE),
            labels=self.labels,
            lines=self.lines,
            source=self.source,
        )

    def _optional(self, names: Sequence[str]) -> FloatArray | None:
        if not any(name in self.numbers for name in names):
            return None
        return _side_by_side(self.numbers, names, len(self.numbers["time"]))


def _side_by_side(numbers: Mapping[str, FloatArray], names: Sequence[str], n: int) -> FloatArray:
    """Stack columns; those that are absent are zero."""
    return np.column_stack([numbers.get(name, np.zeros(n)) for name in names])


def _attitude(numbers: Mapping[str, FloatArray]) -> FloatArray | None:
    if QUATERNION[0] in numbers:
        return np.column_stack([numbers[name] for name in QUATERNION])
    if _heading_alone(numbers):
        return quaternion_from_euler(_side_by_side(numbers, EULER, len(numbers["yaw"])))
    if EULER[0] in numbers:
        return quaternion_from_euler(np.column_stack([numbers[name] for name in EULER]))
    return None


def _heading_alone(numbers: Collection[str]) -> bool:
    """Tell a planar log: of the angles yaw alone, of the velocities none but u v r."""
    upright = not any(name in numbers for name in (*EULER[:2], *QUATERNION, "w", "p", "q"))
    return "yaw" in numbers and upright


def _missing_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    if "time" not in numbers:
        yield (
            f"column `time` is missing.{_nearest('time', numbers)} Rename it, or give a mapping: "
            "`hydrodamp probe LOG --draft mapping.yaml` writes one"
        )
    if not any(name in numbers for name in VELOCITIES):
        listed = " ".join(numbers)
        yield f"there is no velocity column: none of u v w p q r among {listed or 'no columns'}"


def _nearest(name: str, numbers: Collection[str]) -> str:
    by_lower = {other.lower(): other for other in numbers}
    starts = [other for low, other in by_lower.items() if low in ("t", name) or name in low]
    return f" Did you mean '{starts[0]}'?" if starts else did_you_mean(name, numbers)


def _attitude_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    found = [[name for name in group if name in numbers] for group in (EULER, QUATERNION)]
    if all(found):
        both = " ".join(found[0]), " ".join(found[1])
        yield f"attitude must be given once; got both `{both[0]}` and `{both[1]}`. Drop one set"
        return
    if _heading_alone(numbers):
        if _wraps_in_degrees(numbers, "yaw"):
            yield "`yaw` must be in rad; it runs as an angle in degrees does. " + _CONVERT
        return
    for group, there in zip((EULER, QUATERNION), found, strict=True):
        if there and len(there) < len(group):
            absent = [name for name in group if name not in there]
            hints = "".join(_nearest(name, set(numbers) - set(group)) for name in absent)
            all_of, lacking = " ".join(group), " ".join(absent)
            planar = " Only a planar log, of u v r alone, may have yaw by itself"
            yield f"attitude needs all of `{all_of}`; `{lacking}` is missing.{hints}" + (
                planar if there == ["yaw"] and not hints else ""
            )
    if len(found[0]) == len(EULER) and _in_degrees(numbers):
        yield ("`roll pitch yaw` must be in rad; they run as angles in degrees do. " + _CONVERT)


def _in_degrees(numbers: Mapping[str, FloatArray]) -> bool:
    """Tell angles in degrees: a pitch beyond any turn, or a wrap by 360."""
    if len(numbers["pitch"]) == 0:
        return False
    wrapped = any(_wraps_in_degrees(numbers, name) for name in ("roll", "yaw"))
    return wrapped or bool((np.abs(numbers["pitch"]) > _TURN).any())


def _wraps_in_degrees(numbers: Mapping[str, FloatArray], name: str) -> bool:
    wrap = np.abs(np.diff(numbers[name]))
    return bool(((wrap > 340) & (wrap < 380)).any())


def _acceleration_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    there = [name for name in ACCELERATIONS if name in numbers]
    needed = [f"d{name}" for name in VELOCITIES if name in numbers]
    if there and (absent := [name for name in needed if name not in there]):
        yield (
            f"accelerations must be given for every velocity recorded; `{' '.join(absent)}` is"
            f" missing beside `{' '.join(there)}`. Add it, or drop {_surplus(there, absent)}"
        )
    if surplus := [name for name in there if name not in needed]:
        yield f"accelerations `{' '.join(surplus)}` have no velocity column; add it or drop them"


def _triple_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    for group in (POSITION, SPECIFIC_FORCE):
        there = [name for name in group if name in numbers]
        if there and len(there) < len(group):
            absent = " ".join(name for name in group if name not in there)
            yield (
                f"`{' '.join(group)}` belong together; `{absent}` is missing beside "
                f"`{' '.join(there)}`. Add it, drop the others, or rename a command of that name"
            )


def _surplus(there: Sequence[str], absent: Sequence[str]) -> str:
    """Say which columns to drop: the accelerations, or the velocities without one."""
    velocities = " ".join(name.removeprefix("d") for name in absent)
    return (
        f"`{' '.join(there)}` (velocities are then differentiated) or the velocities `{velocities}`"
    )


def _command_faults(commands: tuple[str, ...]) -> Iterator[str]:
    for name in commands:
        try:
            check_command_name(name)
        except TermError as error:
            yield f"column `{name}`: {error}"


def _empty_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    for name, column in numbers.items():
        if name != "time" and len(column) and np.isnan(column).all():
            yield f"column `{name}` holds no number at all; drop it"
