"""Splits of measured logs in ``measured_splits.toml``: files by checksum, and intervals."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import hydrodamp as hd
from benchmark_campaign import Campaign, Logs
from benchmark_campaigns import EXAMPLES, field_vehicle, load_module
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.errors import FileError

STUDIES = Path(__file__).parent
TABLE = STUDIES / "measured_splits.toml"
BELUGA = Path(hd.__file__).parent / "beluga"
"""Vehicle and mapping of ``demo --measured``."""
LABORATORY_MASS = 42.2, 233.0, 94.9
"""Added mass of the 3 m Esso Osaka in the simulator of its laboratory [kg, kg m²]."""


class Split(NamedTuple):
    """Files relative to the folder of data, intervals [s] of their clocks, or none for all."""

    name: str
    vehicle: str
    train: tuple[str, ...]
    test: tuple[str, ...]
    velocities: tuple[str, ...]
    models: tuple[str, ...]
    terms: tuple[str, ...]
    train_intervals: tuple[tuple[float, float], ...] = ()
    test_intervals: tuple[tuple[float, float], ...] = ()


def read_splits(path: Path = TABLE) -> tuple[dict[str, str], list[Split]]:
    """Return the SHA-256 of every file, and the splits."""
    table = tomllib.loads(path.read_text("utf-8"))
    splits = [_split(row, table["vehicle"][row["vehicle"]]) for row in table["split"]]
    return table["files"], splits


def _split(row: Mapping[str, Any], vehicle: Mapping[str, str]) -> Split:
    files = (tuple(row[key]) for key in ("train", "test"))
    words = (tuple(vehicle[key].split()) for key in ("velocities", "models", "terms"))
    intervals = (
        tuple((start, stop) for start, stop in row.get(key, ()))
        for key in ("train_intervals", "test_intervals")
    )
    return Split(row["name"], row["vehicle"], *files, *words, *intervals)


def check_file(folder: Path, name: str, expected: str) -> Path:
    """Return the path of a file; raise if it is absent or has another checksum."""
    path = folder / name
    if not path.is_file():
        raise FileError(f"{path}: no such file; the split has it with SHA-256 {expected}")
    actual = hashlib.sha256(path.read_bytes()).hexdigest()
    if actual != expected:
        raise FileError(
            f"{path}: SHA-256 {actual}, expected {expected}; get the file of the commit that "
            "docs/evidence/measured-logs.md names"
        )
    return path


def read_logs(folder: Path, split: Split, checksums: Mapping[str, str]) -> Logs:
    """Return the vehicle with the logs of a split."""
    parts = []
    for names, intervals in (
        (split.train, split.train_intervals),
        (split.test, split.test_intervals),
    ):
        paths = [check_file(folder, name, checksums[name]) for name in names]
        log = READERS[split.vehicle](paths)
        cut = [log.between(start - log.time[0], stop - log.time[0]) for start, stop in intervals]
        parts.append(hd.concatenate(cut) if cut else log)
    train, test = parts
    return Logs(_vehicle(split.vehicle), train, test)


def models(split: Split) -> Iterator[hd.DampingModel]:
    """Yield the models of the example."""
    if split.models:
        found = hd.read_models(EXAMPLES / split.vehicle / "models.yaml")
        yield from (model for model in found if model.key in split.models)


def measured(folder: Path) -> Iterator[Campaign]:
    """Yield the splits with models of an example whose files are in a folder, as campaigns."""
    checksums, splits = read_splits()
    for split in splits:
        if split.models and (folder / split.test[0]).is_file():
            make = partial(read_logs, folder, split, checksums)
            yield Campaign(f"measured/{split.name}", tuple(models(split)), make, "measured")


def _vehicle(name: str) -> hd.Vehicle:
    if name == "vt690":
        return field_vehicle()
    if name == "beluga":
        return hd.read_vehicle(BELUGA / "vehicle.yaml")
    vehicle = hd.read_vehicle(EXAMPLES / name / "vehicle.yaml")
    if name != "esso_osaka":
        return vehicle
    assert vehicle.added_mass is not None
    added = np.zeros((6, 6))
    added[[0, 1, 5], [0, 1, 5]] = LABORATORY_MASS
    mass = vehicle.mass_matrix - vehicle.added_mass + added
    return replace(vehicle, mass_matrix=mass, added_mass=added)


def _read_example(name: str, paths: list[Path]) -> hd.Log:
    return hd.read_logs(paths, EXAMPLES / name / "mapping.yaml")


def _read_pond(paths: list[Path]) -> hd.Log:
    """Return runs with the true wind, turned by the heading, in place of the relative wind."""
    log: hd.Log = load_module(EXAMPLES / "esso_osaka" / "compare.py").read(paths)
    assert log.attitude is not None
    true = hd.read_logs(paths, STUDIES / "true_wind_mapping.yaml")
    heading = euler_from_quaternion(log.attitude)[:, 2]
    speed, direction = (true.command(f"wind_{each}") for each in ("speed", "direction"))
    ahead, starboard = turn_wind(speed, direction, heading)
    commands = log.commands.copy()
    for name, values in (("wind_x", ahead), ("wind_y", starboard), ("wind", speed)):
        commands[:, log.command_names.index(name)] = values
    return replace(log, commands=commands)


def turn_wind(speed: Any, direction: Any, heading: Any) -> tuple[Any, Any]:
    """Return the wind from ahead and from starboard of a ship at rest.

    A ship with the velocities u and v has the relative wind of these plus u and v.
    """
    return speed * np.cos(direction - heading), speed * np.sin(direction - heading)


@cache
def _read_field(folder: Path) -> hd.Log:
    example = EXAMPLES / "vt690"
    log: hd.Log = load_module(example / "turns.py").with_speed(
        load_module(example / "roll.py").read_field_log(folder)
    )
    return log


READERS: dict[str, Callable[[list[Path]], hd.Log]] = {
    "bluerov2": lambda paths: _read_example("bluerov2", paths),
    "kvlcc2": lambda paths: _read_example("kvlcc2", paths),
    "esso_osaka": _read_pond,
    "vt690": lambda paths: _read_field(paths[0].parent),
    "beluga": lambda paths: hd.read_logs(paths, BELUGA / "mapping.yaml"),
}
