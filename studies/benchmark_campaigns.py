"""The campaigns of the benchmark: what is sailed or read, and which models make sense on it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import NamedTuple

import hydrodamp as hd

PAPER = tuple(hd.catalog[key] for key in hd.PAPER_MODELS)
"""The eight models of the catalogue, in the paper's order."""

EXAMPLES = Path(__file__).parents[1] / "examples"


class Logs(NamedTuple):
    """What is told of a vehicle, and what was measured."""

    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log


@dataclass(frozen=True, eq=False)
class Campaign:
    """A vehicle, a log to identify from and one to replay; made when first asked for.

    Attributes
    ----------
    name : str
        Such as ``"sname/200s/1x"``: what is sailed, and how.
    models : tuple of DampingModel
        Which make sense: the paper's eight, with more terms where the actuation is unknown.
    make : callable
        Sails or reads the logs.
    group : str
        ``"seen"``, or ``"unseen"`` for those that nobody looks at while making a method.
    """

    name: str
    models: tuple[hd.DampingModel, ...]
    make: Callable[[], Logs]
    group: str = "seen"

    @cached_property
    def logs(self) -> Logs:
        """All three, made once."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hd.HydrodampWarning)
            return self.make()

    @property
    def vehicle(self) -> hd.Vehicle:
        """All that a method is told of the vehicle."""
        return self.logs.vehicle

    @property
    def train(self) -> hd.Log:
        """What a method identifies from."""
        return self.logs.train

    @property
    def test(self) -> hd.Log:
        """What its results replay."""
        return self.logs.test


def campaigns() -> Iterator[Campaign]:
    """Yield every campaign; those on files only where ``HYDRODAMP_DATA`` has them."""
    yield from sailed()
    if folder := os.environ.get("HYDRODAMP_DATA"):
        yield from recorded(Path(folder))


@dataclass(frozen=True)
class Sail:
    """A campaign of the 690, as :func:`hydrodamp.reenact` sails it."""

    truth: str
    seed: int
    duration: float
    scale: float = 1.0
    coloured: bool = False
    exact_acceleration: bool = False

    def __call__(self) -> Logs:
        conditions = replace(hd.COLOURED if self.coloured else hd.WHITE, scale=self.scale)
        found = hd.reenact(self.seed, self.truth, self.duration, conditions)
        train = found.train
        if self.exact_acceleration:
            train = replace(train, acceleration=found.exact_train.acceleration)
        return Logs(found.vehicle, train, found.test)


def sailed() -> Iterator[Campaign]:
    """Yield the campaigns of simulated vehicles."""
    yield Campaign("sname/200s/1x", PAPER, Sail("sname", 100, 200.0))
    yield Campaign("sname/60s/3x", PAPER, Sail("sname", 101, 60.0, 3.0))
    yield Campaign("sname/60s/1x/accelerations", PAPER, Sail("sname", 102, 60.0, 1.0, False, True))
    yield Campaign("sname/120s/coloured", PAPER, Sail("sname", 103, 120.0, 1.0, True))
    yield Campaign("crossflow/200s/1x", PAPER, Sail("crossflow", 104, 200.0))
    yield Campaign("crossflow/45s/0.3x", PAPER, Sail("crossflow", 105, 45.0, 0.3))


def recorded(folder: Path) -> Iterator[Campaign]:
    """Yield the campaigns on files."""
    for place in sorted((folder / "campaigns").glob("*/vehicle.yaml")):
        yield Campaign(f"oracle/{place.parent.name}", PAPER, partial(_oracle, place.parent))
    if (folder / "bluerov2_kth").is_dir():
        yield from _left_out("bluerov2", folder / "bluerov2_kth", "run_*.csv")
    if (folder / "kvlcc2_hsva").is_dir():
        yield from _left_out("kvlcc2", folder / "kvlcc2_hsva", "HSVA_CPMC_KVLCC2_Z_*.dat")


def _oracle(folder: Path) -> Logs:
    train, test = (hd.read_log(folder / f"{name}.csv") for name in ("estimation", "validation"))
    return Logs(hd.read_vehicle(folder / "vehicle.yaml"), train, test)


def _left_out(example: str, folder: Path, pattern: str) -> Iterator[Campaign]:
    """Yield a campaign for every run: it is held out, and all others are to identify from."""
    models = hd.read_models(EXAMPLES / example / "models.yaml")
    runs = sorted(folder.glob(pattern))
    for held in runs:
        others = [run for run in runs if run != held]
        name = f"{example}/{held.stem.removeprefix('HSVA_CPMC_KVLCC2_Z_').removeprefix('run_')}"
        yield Campaign(name, models, partial(_read, EXAMPLES / example, others, held))


def _read(example: Path, train: Sequence[Path], test: Path) -> Logs:
    mapping = example / "mapping.yaml"
    vehicle = hd.read_vehicle(example / "vehicle.yaml")
    return Logs(vehicle, hd.read_logs(list(train), mapping), hd.read_logs([test], mapping))
