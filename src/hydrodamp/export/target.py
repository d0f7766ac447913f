"""What a target is: how its files are written, read back and run."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import LONGEST_STEP, Drive, Rate, RungeKutta, sail
from hydrodamp.export.frames import upright
from hydrodamp.files import load_text
from hydrodamp.models.model import DampingModel

if TYPE_CHECKING:
    from jinja2 import Environment

#: How most targets are stepped: as a replay is.
RUNGE_KUTTA = f"Runge-Kutta, at most {LONGEST_STEP:g} s"

#: The files of an export by their paths in its folder.
Files = Mapping[str, str | bytes]


Rates = Callable[[States], FloatArray]


class NotRun(Exception):  # noqa: N818 - an outcome, caught where the card is made
    """Why what was written could not be run here, as the rest of a sentence."""


def require(package: str, what: str = "") -> None:
    """Say that nothing runs what was written where a package of the extra is not there."""
    if find_spec(package) is None:
        raise NotRun(f'{what or package} is not installed (pip install "hydrodamp[export]")')


@dataclass(frozen=True)
class Engine:
    """What was written, parsed back and ready to run."""

    name: str
    step: str
    rates: Rates
    replay: Callable[[Drive], FloatArray]
    not_run: str = ""
    """Why the program that is meant was not run itself."""


@dataclass(frozen=True)
class Target:
    """A form that another program reads.

    A frozen dataclass whose fields are the target's settings: ``dataclasses.replace`` changes
    them. Those of :data:`TARGETS` are there; one's own has ``write`` and ``read``.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from hydrodamp.export.targets import find_target
    >>> replace(find_target("c"), precision="float")
    C(precision='float')
    """

    key: ClassVar[str]
    meant: ClassVar[str]
    """The program and version that is meant."""

    @property
    def ignores(self) -> str:
        """What of equation 1 it leaves out; empty where nothing."""
        return ""

    def holds(self, craft: Craft) -> DampingModel | None:
        """Return the terms it can hold; None where it can hold all."""
        return None

    def point(self, craft: Craft) -> FloatArray:
        """Return the point that its coefficients are about, from the vehicle's origin [m]."""
        return np.zeros(3)

    def moved(self, craft: Craft) -> Craft:
        """Return the craft with its damping about that point."""
        return craft

    @abstractmethod
    def write(self, craft: Craft) -> Files:
        """Return its files. The craft has no other terms than it can hold, about its point."""

    @abstractmethod
    def read(self, folder: Path, craft: Craft) -> Engine:
        """Read the files back, and return what runs them; NotRun where nothing can here."""


def by_rate(name: str, rate: Rate, rates: Rates | None = None) -> Engine:
    """Return the engine of a target that gives accelerations: the steps are ours."""

    def one_by_one(at: States) -> FloatArray:
        return np.array([rate(*each) for each in zip(*parts(at), strict=True)])

    def replay(drive: Drive) -> FloatArray:
        steps = RungeKutta(rate)
        return sail(drive, "", LONGEST_STEP, steps.place, steps.advance)

    return Engine(name, RUNGE_KUTTA, rates or one_by_one, replay)


class Simulator(Protocol):
    """One vehicle in a simulator; all in hydrodamp's frame."""

    def place(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state, of a quaternion from body to world and a velocity."""

    def rate(self, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the acceleration there."""

    def advance(self, length: float, inputs: FloatArray, wrench: FloatArray) -> FloatArray:
        """Take one step [s], and return the velocity after it."""


def stepped(simulator: Simulator, name: str, step: float, kind: str = "") -> Engine:
    """Return the engine of a simulator, in steps of at most so many seconds and of a kind."""

    def rates(at: States) -> FloatArray:
        found = []
        for attitude, velocity, inputs, wrench in zip(
            upright(at.down), at.velocity, at.inputs, at.wrench, strict=True
        ):
            simulator.place(attitude, velocity)
            found.append(simulator.rate(inputs, wrench))
        return np.array(found)

    def advance(
        length: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        return simulator.advance(length, inputs, 0.5 * (first + last))

    def replay(drive: Drive) -> FloatArray:
        return sail(drive, f" in {name}", step, simulator.place, advance)

    return Engine(name, f"{kind}steps of {step:g} s", rates, replay)


def parts(at: States) -> tuple[FloatArray, ...]:
    """Return the arrays of states in the order in which all targets take them."""
    return at.velocity, at.down, at.inputs, at.wrench


def by_core(name: str, craft: Craft) -> Engine:
    """Return the engine of a target whose numbers were read back, and its formula is equation 1."""

    def replay(drive: Drive) -> FloatArray:
        return Drive.of(craft, drive.log).source().velocity

    return Engine(name, RUNGE_KUTTA, craft.acceleration, replay)


def executed(path: Path) -> ModuleType:
    """Return a written Python file as a module."""
    module = ModuleType(path.stem)
    exec(compile(load_text(path), str(path), "exec"), module.__dict__)
    return module


def rendered(template: str, /, **values: object) -> str:
    """Return the text of a template."""
    return _environment().get_template(template).render(values)


@cache
def _environment() -> Environment:
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ImportError as error:
        raise MethodError(
            'export needs the package jinja2: pip install "hydrodamp[export]"'
        ) from error
    return Environment(
        loader=PackageLoader("hydrodamp.export", "assets"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
