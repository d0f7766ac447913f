"""Export targets: the terms a simulator represents, its files, and the engine that runs them."""

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
from hydrodamp.basis.term import AXES, VELOCITY_OF, Term
from hydrodamp.errors import MethodError, ModelError, demand
from hydrodamp.export.codegen import number
from hydrodamp.export.plant import ExportedPlant, States, check_body
from hydrodamp.export.projection import drag_terms, project_damping
from hydrodamp.export.verification import Engine
from hydrodamp.files import save_all
from hydrodamp.models.model import DampingModel, read_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

if TYPE_CHECKING:
    from jinja2 import Environment

#: The files of an export by their paths in its folder.
Files = Mapping[str, str | bytes]

#: Atoms that change sign under reflection of all velocities but u, and that velocity.
SIGN_ATOMS = {**dict(zip("vwpqr", "vwpqr", strict=True)), "V_v": "v", "V_w": "w"}


class NotRun(Exception):  # noqa: N818 - an outcome, caught where the card is made
    """Why the files could not be run here, as the rest of a sentence."""


class RunError(NotRun):
    """The installed compiler or interpreter failed on the files."""


def require_package(package: str, name: str = "") -> None:
    """Raise NotRun if a package of the extra ``export`` is not installed."""
    if find_spec(package) is None:
        raise NotRun(f'{name or package} is not installed (pip install "hydrodamp[export]")')


@dataclass(frozen=True)
class Target:
    """A program that exported files are written for.

    A frozen dataclass whose fields are the settings of the target: ``dataclasses.replace`` changes
    them. A target of your own defines ``key``, ``description``, ``render_files`` and
    ``open_engine``; pass an instance to :func:`export`. If it cannot represent every term, it also
    defines ``representable_model``.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from hydrodamp.export.export import find_target
    >>> replace(find_target("c"), precision="float")
    C(precision='float')
    """

    key: ClassVar[str]
    description: ClassVar[str]
    """Program and version."""

    @property
    def omitted_effects(self) -> str:
        """Effects of equation 1 that no file of the target has; empty if none."""
        return ""

    def representable_model(self, plant: ExportedPlant) -> DampingModel:
        """Return the damping model that the target can represent: by default all terms."""
        return plant.damping.model

    def reference_point(self, plant: ExportedPlant) -> FloatArray:
        """Return the reference point of its coefficients, from the vehicle's origin (3,) [m]."""
        return np.zeros(3)

    def unrepresented_effects(self, plant: ExportedPlant) -> tuple[str, ...]:
        """Return the labels of coefficients that the target cannot represent unchanged."""
        model, moved = self.representable_model(plant), self.reference_point(plant).any()
        return tuple(
            label
            for label in plant.damping.model.labels
            if label not in model.labels or (moved and not read_label(label)[1].commands)
        )

    def project_plant(self, plant: ExportedPlant, at: States) -> ExportedPlant:
        """Return the plant in the terms of the target, fitted at states, about its point."""
        if not self.unrepresented_effects(plant):
            return plant
        model, point = self.representable_model(plant), self.reference_point(plant)
        return project_damping(plant, model, at, point)

    @abstractmethod
    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the files of a plant that :meth:`project_plant` returned."""

    @abstractmethod
    def open_engine(self, folder: Path, plant: ExportedPlant) -> AbstractContextManager[Engine]:
        """Read the files back and return the engine that runs them; raise NotRun without one."""


@dataclass(frozen=True)
class HydrodynamicTarget(Target):
    """A target with a submerged rigid body and terms of velocities; its input is a wrench."""

    other_omissions: ClassVar[str] = ""
    """Effects that it omits besides the actuators."""
    density: float = 1000.0

    def __post_init__(self) -> None:
        """Refuse settings that are not positive."""
        for setting in fields(self):
            value = getattr(self, setting.name)
            if isinstance(value, float):
                demand(0.0 < value < np.inf, setting.name, "positive", f"{value:g}.")

    @property
    def omitted_effects(self) -> str:
        """The actuators, and what else."""
        return "the actuators (its input is a wrench)" + self.other_omissions

    def allowed_terms(self, axis: str) -> Iterable[Term]:
        """Return the terms that it has on an axis."""
        return drag_terms(axis)

    def representable_model(self, plant: ExportedPlant) -> DampingModel:
        """Return the terms of the plant that it has, and those that replace others."""
        check_body(plant, self.key)
        return select_terms(plant, self.key, self.allowed_terms)


def program_version(command: str) -> str:
    """Return the first line that a program prints for ``--version``."""
    call = [command, "--version"]
    process = subprocess.run(call, capture_output=True, text=True, check=True)
    return process.stdout.splitlines()[0]


def save_files(files: Files, folder: Path) -> dict[str, bytes]:
    """Write the files of an export into a folder, and return them as bytes."""
    contents = {
        path: content.encode("utf-8") if isinstance(content, str) else content
        for path, content in files.items()
    }
    save_all({folder / path: content for path, content in contents.items()})
    return contents


def render_template(template: str, /, **values: object) -> str:
    """Return the text of a template."""
    return _environment().get_template(template).render(values, gravity=STANDARD_GRAVITY)


def _format_value(value: object) -> object:
    """Return floats as their shortest exact decimals; those of an array separated by spaces."""
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
        finalize=_format_value,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def select_terms(
    plant: ExportedPlant, key: str, allowed_terms: Callable[[str], Iterable[Term]]
) -> DampingModel:
    """Return the terms of a plant that a target allows on each axis.

    An unrepresented term is replaced by allowed terms of the same velocities and symmetry. Terms of
    commands remain: they are inputs, as actuators are.
    """
    model = plant.damping.model
    if labels := [label for label in model.labels if read_label(label)[1].needs_attitude]:
        raise ModelError(
            f"'{key}' has no terms of attitude such as {', '.join(labels)}: give the vehicle's "
            "centres and weights these numbers, or identify a model without."
        )
    rows = []
    for axis, row in zip(AXES, model.terms, strict=True):
        candidates = (*allowed_terms(axis), *(term for term in row if term.commands))
        unrepresented = [term for term in row if term not in candidates]
        velocity = VELOCITY_OF[axis]
        velocities = {velocity, *(name for term in unrepresented for name in term.velocities)}
        symmetries = [_odd_velocities(term) for term in unrepresented]
        rows.append(
            tuple(
                term
                for term in candidates
                if term in row
                or (
                    _odd_velocities(term) in symmetries
                    and velocities.issuperset(term.velocities)
                    and term.factors != (velocity, velocity)  # injects energy in one direction
                )
            )
        )
    return replace(model, terms=tuple(rows))


def _odd_velocities(term: Term) -> set[str]:
    """Return the velocities other than u in which a term is odd."""
    names = [SIGN_ATOMS[factor] for factor in term.factors if factor in SIGN_ATOMS]
    return {name for name in names if names.count(name) % 2}
