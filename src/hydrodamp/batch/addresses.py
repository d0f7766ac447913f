"""Logs by their addresses: files, folders, patterns, URLs; and the group that each belongs to."""

from __future__ import annotations

import glob
import hashlib
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from hydrodamp.errors import FileError, MethodError
from hydrodamp.ingest.formats.files import SUFFIXES, is_bag, suffix_of
from hydrodamp.vehicle.vehicle import Vehicle

_DATE = re.compile(r"(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)(?!\d)")
_EPOCH = 1e8  # s; clocks below begin with the dive, not in 1970


def expanded(addresses: Iterable[str]) -> list[str]:
    """Return the logs that addresses stand for, in their order, each once."""
    found, faults = dict[str, None](), []
    for address in addresses:
        logs = [*_matching(address)]
        found |= dict.fromkeys(logs)
        if not logs:
            faults.append(f"{address}: no log matches it; logs end in {' '.join(sorted(SUFFIXES))}")
    if faults:
        raise FileError("\n".join(faults))
    return [*found]


def _matching(address: str) -> Iterator[str]:
    if "://" in address:
        system, path = _remote(address)
        places = system.glob(path) if "*" in path else [path]
        files = [one for place in places for one in (system.find(place) or [place])]
        yield from (system.unstrip_protocol(one) for one in files if suffix_of(one) in SUFFIXES)
        return
    places = sorted(glob.glob(address, recursive=True)) if "*" in address else [address]
    for place in map(Path, places):
        if not place.is_dir() or is_bag(place):
            yield from [str(place)] if place.exists() else []
            continue
        bags = [one.parent for one in place.rglob("metadata.yaml")]
        files = [one for one in place.rglob("*") if suffix_of(one) in SUFFIXES and one.is_file()]
        yield from map(str, sorted([*bags, *(one for one in files if one.parent not in bags)]))


def _remote(address: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError as error:
        raise FileError(
            f'{address}: addresses need the package fsspec: pip install "hydrodamp[batch]"'
        ) from error
    system, path = url_to_fs(address)
    return system, str(path)


@contextmanager
def here(address: str) -> Iterator[Path]:
    """Hold a log as a file of this machine."""
    if "://" not in address:
        yield Path(address)
        return
    system, path = _remote(address)
    with tempfile.TemporaryDirectory() as place:
        local = Path(place, PurePosixPath(path).name)
        system.get(path, str(local))
        yield local


def token(address: str) -> str:
    """Return what tells whether a log has changed: a digest, or what its store says."""
    if "://" in address:
        system, path = _remote(address)
        return str(system.checksum(path))
    place, seen = Path(address), hashlib.sha256()
    for file in sorted(place.rglob("*")) if place.is_dir() else [place]:
        if file.is_file():
            with file.open("rb") as stream:
                seen.update(hashlib.file_digest(stream, "sha256").digest())
    return seen.hexdigest()


def group_of(by: Sequence[str], address: str, vehicle: str, start: float) -> tuple[str, ...]:
    """Return the group of a log that begins at ``start`` [s]; refuse one without."""
    return tuple(_part(one, address, vehicle, start) for one in by)


def _part(by: str, address: str, vehicle: str, start: float) -> str:
    if by == "vehicle":
        return vehicle
    if by == "folder":
        return PurePosixPath(address).parent.name
    if by in ("day", "month"):
        day = datetime.fromtimestamp(start, UTC).strftime("%Y-%m-%d") if start > _EPOCH else ""
        if not day and (found := _DATE.search(address)):
            day = "-".join(found.groups())
        if not day:
            raise MethodError(
                "neither its clock nor its path has a date: group by `folder` or by a pattern."
            )
        return day if by == "day" else day[:7]
    if found := re.search(by, address):
        return found[1] if found.re.groups else found[0]
    raise MethodError(f"the pattern '{by}' is not in its path.")


def craft_of(address: str, names: Sequence[str]) -> str:
    """Return the vehicle that a log is of: the only one, or that whose name its path holds."""
    if len(names) == 1:
        return names[0]
    held = [name for name in names if name in address]
    longest = [name for name in held if not any(name in other for other in held if other != name)]
    if len(longest) != 1:
        said = f"of {', '.join(held)}" if held else f"of none of {', '.join(names)}"
        raise MethodError(f"its path holds the name {said}: it must tell one vehicle.")
    return longest[0]


def check_by(by: Sequence[str], crafts: Sequence[Vehicle]) -> None:
    """Refuse what is no way to group, and logs of several vehicles in one group."""
    if len(names := {one.name for one in crafts}) < len(crafts):
        raise MethodError(f"vehicles must have different names; got {', '.join(sorted(names))}.")
    if len(crafts) > 1 and "vehicle" not in by:
        raise MethodError("`by` must hold `vehicle` where there are several: they share no fit.")
    for one in by:
        try:
            re.compile(one)
        except re.error as error:
            raise MethodError(
                f"`by` must be of vehicle, day, month, folder and patterns of the path; '{one}' is "
                f"none: {error}."
            ) from error
    if not by:
        raise MethodError("`by` must name at least one of vehicle, day, month, folder, a pattern.")
