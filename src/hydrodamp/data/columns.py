"""Named columns in SI units, of a file or a data frame, as the record of a log, and back."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import ACCELERATION, ATTITUDE, BLOCKS, EULER, RESERVED, SEGMENT
from hydrodamp.data.plausibility import FULL_TURN, find_absurd, mask_absurd
from hydrodamp.data.record import Record, command_faults, stack_columns
from hydrodamp.errors import HydrodampError, LogError, did_you_mean

_CONVERT_ADVICE = "Convert, or give a mapping with unit: deg"


def record_of_columns(
    numbers: Mapping[str, FloatArray],
    commands: Sequence[str] = (),
    labels: tuple[str, ...] | None = None,
    lines: Sequence[int] | None = None,
    source: str = "",
    run: IntArray | None = None,
) -> tuple[Record | None, list[str]]:
    """Return the record of named columns in SI units and canonical axes, and its faults."""
    numbers = mask_absurd(numbers, numbers.get("time", np.empty(0)), source)
    faults = [
        *_attitude_faults(numbers),
        *_incomplete_group_faults(numbers),
        *_column_faults(numbers),
        *command_faults(commands),
    ]
    if (time := numbers.get("time")) is None:
        missing = f"column `time` is missing.{_suggest_name('time', numbers)} Rename it, or give a"
        draft = "mapping: `hydrodamp probe LOG --draft mapping.yaml` writes one"
        return None, [f"{missing} {draft}", *faults]
    if len(time) == 0:
        return None, faults
    blocks = {}
    absent = {f"d{name}": np.full(len(time), np.nan) for name in VELOCITIES if name in numbers}
    for block in BLOCKS:
        present = [name in numbers for name in block.columns]
        if block.name == "velocity" or (all(present) if block.is_whole else any(present)):
            stacked = stack_columns({**absent, **numbers}, block.columns, len(time))
            blocks[block.name] = stacked if block.shape else stacked[:, 0]
    if "attitude" not in blocks and "yaw" in numbers:
        blocks["attitude"] = quaternion_from_euler(stack_columns(numbers, EULER, len(time)))
    blocks["commands"] = stack_columns(numbers, commands, len(time))
    names = tuple(name for name in VELOCITIES if name in numbers)
    return Record(blocks, names, tuple(commands), labels, run, lines, source), faults


def record_of_dataframe(frame: Any, source: str) -> Record:
    """Return the record of a pandas DataFrame; raise LogError with all faults."""
    columns, numbers, faults = dict(frame.items()), dict[str, FloatArray](), list[str]()
    if len(columns) < frame.shape[1]:
        faults.append("columns must have different names; rename or drop those that repeat")
    if "time" not in columns and (frame.index.name == "time" or frame.index.dtype.kind in "mMf"):
        columns["time"] = frame.index.to_series()
    labels = columns.pop(SEGMENT, None)
    for name, column in columns.items():
        try:
            numbers[str(name)] = _numbers(column, is_time=name == "time")
        except (TypeError, ValueError):
            wanted = f"column `{name}` must hold numbers{' or datetimes' * (name == 'time')}"
            faults.append(f"{wanted}; got {column.dtype}. Convert or drop it")
    if numbers.keys().isdisjoint(VELOCITIES):
        faults.append(f"no velocity: a column of the names {' '.join(VELOCITIES)} is missing")
    commands = [name for name in numbers if name not in RESERVED]
    names = None if labels is None else tuple(map(str, labels))
    record, more = record_of_columns(numbers, commands, names, source=source)
    if faults or more or record is None:
        raise LogError([*faults, *more] or ["the data frame has no rows"], source=source)
    return record


def _numbers(column: Any, is_time: bool) -> FloatArray:
    """Return the numbers of a column; of times seconds, of datetimes since 1970 in UTC."""
    kind = column.dtype.kind
    if kind not in "mM":
        return np.asarray(column.to_numpy(np.float64, na_value=np.nan))
    if not is_time:
        raise TypeError("dates are no numbers")
    zero = np.datetime64(0, "ns") if kind == "M" else np.timedelta64(0, "ns")
    return np.asarray((column.to_numpy(zero.dtype) - zero) / np.timedelta64(1, "s"))


def make_dataframe(columns: Mapping[str, Any]) -> Any:
    """Return a pandas DataFrame of columns."""
    try:
        import pandas
    except ImportError as error:
        advice = 'Install it by `pip install "hydrodamp[pandas]"`'
        raise HydrodampError(f"a data frame needs pandas. {advice}") from error
    return pandas.DataFrame(columns)


def _suggest_name(name: str, numbers: Collection[str]) -> str:
    by_lower = {column.lower(): column for column in numbers}
    matches = [column for low, column in by_lower.items() if low in ("t", name) or name in low]
    return f" Did you mean '{matches[0]}'?" if matches else did_you_mean(name, numbers)


def _attitude_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    angles = [name for name in EULER if name in numbers]
    quaternion = [name for name in ATTITUDE.columns if name in numbers]
    if angles and quaternion:
        both = f"`{' '.join(angles)}` and `{' '.join(quaternion)}`"
        yield f"attitude must be given once; got both {both}. Drop one set"
    if any(is_in_degrees(name, numbers[name]) for name in angles):
        yield f"`{' '.join(angles)}` must be in rad; its range indicates degrees. {_CONVERT_ADVICE}"


def _incomplete_group_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    planar = not any(name in numbers for name in (*EULER[:2], "w", "p", "q"))
    wrench = ("X", "Y", "N") if planar else AXES
    for group in (EULER, wrench, *(block.columns for block in BLOCKS if block.is_whole)):
        present = [name for name in group if name in numbers]
        absent = [name for name in group if name not in numbers]
        if present and absent and not (group == EULER and planar):
            hints = "".join(_suggest_name(name, set(numbers) - set(group)) for name in absent)
            remark = " Only a planar log, of u v r alone, may have yaw by itself"
            yield (
                f"`{' '.join(group)}` belong together; `{' '.join(absent)}` is missing next to "
                f"`{' '.join(present)}`.{hints} Add it, drop the others, or rename a command of"
                f" this name.{remark if present == ['yaw'] else ''}"
            )


def is_in_degrees(name: str, angle: FloatArray) -> bool:
    """Return whether an angle is in degrees: a pitch beyond a full turn, or a wrap by 360."""
    angle = angle[~find_absurd(angle, FULL_TURN)] if name == "pitch" else angle
    wrap = np.abs(np.diff(angle))
    exceeds = np.abs(angle) > FULL_TURN if name == "pitch" else (wrap > 340) & (wrap < 380)
    return bool(exceeds.any())


def _column_faults(numbers: Mapping[str, FloatArray]) -> Iterator[str]:
    moving = {f"d{name}" for name in VELOCITIES if name in numbers}
    if surplus := [name for name in ACCELERATION.columns if name in numbers and name not in moving]:
        yield f"accelerations `{' '.join(surplus)}` have no velocity column; add it or drop them"
    for name, column in numbers.items():
        if name != "time" and len(column) and np.isnan(column).all():
            yield f"column `{name}` holds no number; drop it"
