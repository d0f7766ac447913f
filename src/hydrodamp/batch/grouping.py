"""Groups: assign a log to a group and a vehicle, and order the groups."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime
from pathlib import PurePosixPath

from hydrodamp.errors import MethodError
from hydrodamp.vehicle.vehicle import Vehicle

#: Grouping keys that are dates.
DATES = frozenset({"day", "month"})

DATE_PATTERN = re.compile(r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)(?!\d)")
MIN_UNIX_TIME = 1e8  # s since 1970 (in 1973); a smaller clock counts from boot

Group = tuple[str, ...]


def assign_group(by: Sequence[str], address: str, vehicle: str, start: float) -> Group:
    """Return the group of a log that begins at ``start`` [s]; raise ``MethodError`` if none."""
    return tuple(_label(key, address, vehicle, start) for key in by)


def _label(key: str, address: str, vehicle: str, start: float) -> str:
    if key == "vehicle":
        return vehicle
    if key == "folder":
        return PurePosixPath(address).parent.name
    if key in DATES:
        day = _clock_day(start) if start > MIN_UNIX_TIME else _path_day(address)
        if not day:
            raise MethodError(
                "neither its clock nor its path has a date: group by `folder` or by a pattern."
            )
        return day if key == "day" else day[:7]
    match = re.search(key, address)
    label = None if match is None else match[1] if match.re.groups else match[0]
    if not label:
        reason = "its group matches nothing in" if match else "it is not in"
        raise MethodError(f"the pattern '{key}' gives no group: {reason} the path.")
    return label


def _clock_day(start: float) -> str:
    try:
        return datetime.fromtimestamp(start, UTC).strftime("%Y-%m-%d")
    except (OverflowError, ValueError, OSError) as error:
        raise MethodError(
            f"its clock begins at {start:.4g} s since 1970, which is no date: set its unit in a "
            "mapping."
        ) from error


def _path_day(address: str) -> str:
    """Return the first valid date of a path, or nothing."""
    for match in DATE_PATTERN.finditer(address):
        try:
            return date(*map(int, match.groups())).isoformat()
        except ValueError:
            continue
    return ""


def group_order(by: Sequence[str], starts: Sequence[float]) -> str:
    """Return the key that orders groups: `date`, `clock`, or `name` if clocks count from boot."""
    if not DATES.isdisjoint(by):
        return "date"
    return "clock" if all(start > MIN_UNIX_TIME for start in starts) else "name"


def sort_groups(by: Sequence[str], starts: Mapping[Group, float]) -> list[Group]:
    """Return groups in the order of their dates, then of their clocks if all count from 1970.

    ``starts`` are the clock times of the first samples [s].
    """
    has_unix_time = group_order((), [*starts.values()]) == "clock"

    def sort_key(group: Group) -> tuple[Group, float, Group]:
        dates = tuple(label for key, label in zip(by, group, strict=True) if key in DATES)
        return dates, starts[group] if has_unix_time else 0.0, group

    return sorted(starts, key=sort_key)


def assign_vehicle(address: str, names: Sequence[str]) -> str:
    """Return the only vehicle, or the one whose name is a word of the path."""
    if len(names) == 1:
        return names[0]
    spans = {
        match.span(): name
        for name in names
        for match in re.finditer(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", address)
    }
    matches = {
        name
        for (start, stop), name in spans.items()
        if not any(a <= start and stop <= b and (a, b) != (start, stop) for a, b in spans)
    }
    if len(matches) != 1:
        matched = ", ".join(sorted(matches)) if matches else f"none of {', '.join(names)}"
        raise MethodError(f"its path has the name of {matched}: it must name one vehicle.")
    return matches.pop()


def check_grouping(by: Sequence[str], vehicles: Sequence[Vehicle]) -> None:
    """Refuse an unknown grouping key, and logs of several vehicles in one group."""
    if len(names := {each.name for each in vehicles}) < len(vehicles):
        raise MethodError(f"vehicles must have different names; got {', '.join(sorted(names))}.")
    if len(vehicles) > 1 and "vehicle" not in by:
        raise MethodError("`by` must hold `vehicle` for several vehicles: they share no fit.")
    for key in by:
        try:
            re.compile(key)
        except re.error as error:
            raise MethodError(
                f"`by` takes vehicle, day, month, folder and patterns of the path; '{key}' is "
                f"invalid: {error}."
            ) from error
    if not by:
        raise MethodError("`by` must name at least one of vehicle, day, month, folder, a pattern.")
