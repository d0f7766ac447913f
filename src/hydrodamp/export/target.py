"""What a target is: what it holds of a damping, how its files are written, read back and run."""

from __future__ import annotations

import subprocess
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError, ModelError, demand
from hydrodamp.export.codegen import number
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.projection import diagonal, projected
from hydrodamp.export.rigid_body import check_body
from hydrodamp.export.verification import Engine
from hydrodamp.models.model import DampingModel, read_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

_ODD = {**dict(zip("vwpqr", "vwpqr", strict=True)), "V_v": "v", "V_w": "w"}

if TYPE_CHECKING:
    from jinja2 import Environment

#: The files of an export by their paths in its folder.
Files = Mapping[str, str | bytes]


class NotRun(Exception):  # noqa: N818 - an outcome, caught where the card is made
    """Why what was written could not be run here, as the rest of a sentence."""


class RunError(NotRun):
    """The compiler or interpreter that is here failed on what was written."""


def require(package: str, what: str = "") -> None:
    """Say that nothing runs what was written where a package of the extra is not there."""
    if find_spec(package) is None:
        raise NotRun(f'{what or package} is not installed (pip install "hydrodamp[export]")')


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
    description: ClassVar[str]
    """The program and version that is meant."""

    @property
    def ignores(self) -> str:
        """What of equation 1 it leaves out; empty where nothing."""
        return ""

    def representable_model(self, craft: ExportedPlant) -> DampingModel:
        """Return the terms it can hold: all."""
        return craft.damping.model

    def point(self, craft: ExportedPlant) -> FloatArray:
        """Return the point that its coefficients are about, from the vehicle's origin [m]."""
        return np.zeros(3)

    def unrepresented_effects(self, craft: ExportedPlant) -> tuple[str, ...]:
        """Return the coefficients of a craft that it has not as they are."""
        model, about = self.representable_model(craft), self.point(craft).any()
        return tuple(
            label
            for label in craft.damping.model.labels
            if label not in model.labels or (about and not read_label(label)[1].commands)
        )

    def project(self, craft: ExportedPlant, at: States) -> ExportedPlant:
        """Return a craft as the target holds it: in its terms, about its point."""
        if not self.unrepresented_effects(craft):
            return craft
        return projected(craft, self.representable_model(craft), at, self.point(craft))

    @abstractmethod
    def write(self, craft: ExportedPlant) -> Files:
        """Return its files. The craft has no other terms than it can hold, about its point."""

    @abstractmethod
    def read(self, folder: Path, craft: ExportedPlant) -> AbstractContextManager[Engine]:
        """Read the files back, and hold what runs them; NotRun where nothing can here."""


@dataclass(frozen=True)
class HydrodynamicTarget(Target):
    """A target that holds a body in water and terms of its velocities; a wrench drives it."""

    left_out: ClassVar[str] = ""
    """What else it leaves out."""
    density: float = 1000.0

    def __post_init__(self) -> None:
        """Refuse water without weight, time that stands, a shape without volume."""
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, float):
                demand(0.0 < value < np.inf, each.name, "positive", f"{value:g}.")

    @property
    def ignores(self) -> str:
        """What makes a wrench of commands, and what else."""
        return "what makes a wrench of commands (a wrench drives what is written)" + self.left_out

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return the terms it has on an axis."""
        return diagonal(axis)

    def representable_model(self, craft: ExportedPlant) -> DampingModel:
        """Return the terms of the craft that it has, and what takes the place of others."""
        check_body(craft, self.key)
        return terms_for(craft, self.key, self.allowed)


def version_of(command: str) -> str:
    """Return the first line of what a program says of itself."""
    call = [command, "--version"]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[0]


def rendered(template: str, /, **values: object) -> str:
    """Return the text of a template."""
    return _environment().get_template(template).render(values, gravity=STANDARD_GRAVITY)


def _printed(value: object) -> object:
    """Return numbers as they are read back the same; an array's with blanks between them."""
    if isinstance(value, np.ndarray):
        return " ".join(map(number, value.ravel().tolist()))
    return number(value) if isinstance(value, float) else value


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
        finalize=_printed,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def terms_for(
    craft: ExportedPlant, key: str, allowed: Callable[[str], Iterable[Term]]
) -> DampingModel:
    """Return the terms of a craft that a target allows on each axis.

    Where it has others, those allowed of the same velocities and symmetry take their place. Terms
    of commands stay: they drive it from outside, as actuators do.
    """
    model = craft.damping.model
    if foreign := [x for x in model.labels if read_label(x)[1].needs_attitude]:
        raise ModelError(
            f"'{key}' has no terms of attitude such as {', '.join(foreign)}: give the vehicle's "
            "centres and weights these numbers, or identify a model without."
        )
    rows = []
    for axis, row in zip(AXES, model.terms, strict=True):
        able = (*allowed(axis), *(term for term in row if term.commands))
        lost = [term for term in row if term not in able]
        own = VELOCITY_OF[axis]
        moving = {own, *(name for term in lost for name in term.velocities)}
        odd = [_odd(term) for term in lost]
        rows.append(
            tuple(
                term
                for term in able
                if term in row
                or (
                    _odd(term) in odd
                    and moving.issuperset(term.velocities)
                    and term.factors != (own, own)  # it drives one way as it damps the other
                )
            )
        )
    return replace(model, terms=tuple(rows))


def _odd(term: Term) -> set[str]:
    """Return the velocities across the bow that turn the sign of a term by turning theirs."""
    names = [_ODD[factor] for factor in term.factors if factor in _ODD]
    return {name for name in names if names.count(name) % 2}
