"""Gazebo: SDF for the Hydrodynamics system of gz-sim and the SimpleHydrodynamics of VRX."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations_with_replacement, product
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np

from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.export.body import DRIVEN, Body, checked_positive, diagonal, terms_for
from hydrodamp.export.craft import Craft
from hydrodamp.export.dart import dart
from hydrodamp.export.fidelity import mass_ratio
from hydrodamp.export.frames import FLU, term_sign
from hydrodamp.export.printer import number
from hydrodamp.export.target import Engine, Files, NotRun, Target, rendered
from hydrodamp.export.words import said_of
from hydrodamp.files import load_text
from hydrodamp.models.model import DampingModel, spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

_TERMS = (
    *(Term((name,)) for name in VELOCITIES),
    *(Term((name, f"|{other}|")) for name, other in product(VELOCITIES, repeat=2)),
    *(Term(pair) for pair in combinations_with_replacement(VELOCITIES, 2)),
)
_PAIRS = [(i, j) for i in range(6) for j in range(i, 6)]
_DRAG = [axis.lower() + name.upper() for axis, name in zip(AXES, VELOCITIES, strict=True)]
_EXPLICIT = [f"{axis.lower()}Dot{name.upper()}" for axis, name in product(AXES, VELOCITIES)]


@dataclass(frozen=True)
class Gazebo(Target):
    """A model of one link in SDF, a world with it, and the block to paste into another model."""

    plugin: ClassVar[tuple[str, str]]
    sign: ClassVar[float]
    """Of the coefficients: negative where positive ones drag."""
    speed: ClassVar[str]
    """What stands in a tag before a velocity whose absolute value is meant."""
    density: float = 1000.0
    step: float = 0.001

    def __post_init__(self) -> None:
        """Refuse water without weight, and time that stands."""
        checked_positive(self, "density", "step")

    @property
    def ignores(self) -> str:
        """The actuators."""
        return DRIVEN

    @property
    def explicit(self) -> bool:
        """Whether the plugin adds the mass, not the link."""
        return False

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return the terms that the plugin has on an axis."""
        return _TERMS

    def holds(self, craft: Craft) -> DampingModel:
        """Return the terms of the craft that the plugin has."""
        return terms_for(craft, self.key, self.allowed)

    def numbers(self, craft: Craft, body: Body) -> dict[str, float]:
        """Return the numbers of the plugin by their tags."""
        values = craft.damping.as_dict()
        return {
            tag: sign * values[label]
            for tag, (label, sign) in self._tags().items()
            if label in values
        }

    def write(self, craft: Craft) -> Files:
        """Return the model, a world with it, and the block."""
        body = Body.of(craft, self.key, self.density).turned
        said = {
            **said_of(craft, ""),
            "body": body,
            "added": []
            if self.explicit
            else [(_place(*pair), body.added[pair]) for pair in _PAIRS],
            "tags": self.numbers(craft, body),
            "plugin": self.plugin,
            "side": body.volume ** (1.0 / 3.0),
            "density": self.density,
            "step": self.step,
            "gravity": STANDARD_GRAVITY,
            "number": number,
        }
        names = "model.config", "model.sdf", "world.sdf", "hydrodynamics.xml"
        return {name: rendered(f"{name}.j2", **said) for name in names}

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Read the model, and return DART with the forces of gz-sim's systems."""
        root = ElementTree.fromstring(load_text(folder / "model.sdf"))
        found = {each.tag: each.text or "" for each in root.iter()}
        poses = [pose.text or "" for pose in root.iter("pose")]
        center, lifted = (np.array(pose.split()[:3], dtype=float) for pose in poses[:2])
        added, inertia = np.zeros((6, 6)), np.zeros((3, 3))
        for i, j in _PAIRS:
            added[i, j] = added[j, i] = float(found[_place(i, j)])
            if j < 3:
                inertia[i, j] = inertia[j, i] = float(found[f"i{_place(i, j)}"])
        volume = float(found["size"].split()[0]) ** 3
        body = Body(float(found["mass"]), center, inertia, added, volume, lifted).turned
        values = {
            label: sign * float(found[tag])
            for tag, (label, sign) in self._tags().items()
            if tag in found
        }
        return dart(body.craft(craft, values, self.density), body, self.step)

    def _tags(self) -> dict[str, tuple[str, float]]:
        """Return the coefficient and the sign that each tag of the plugin stands for."""
        tags = {}
        for axis, turn in zip(AXES, FLU.tolist(), strict=True):
            for term in self.allowed(axis):
                names = [factor.strip("|").upper() for factor in term.factors]
                between = self.speed if "|" in str(term) else ""
                sign = self.sign * turn * term_sign(term)
                tags[axis.lower() + between.join(names)] = (spell_label(axis, term), sign)
        return tags


def _place(row: int, column: int) -> str:
    return f"{'xyzpqr'[row]}{'xyzpqr'[column]}"


@dataclass(frozen=True)
class GzSim(Gazebo):
    """A model, a world and a block for the Hydrodynamics system of gz-sim.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3]; the volume is such that it lifts as the vehicle's buoyancy does.
    step : float
        Of the world and of the replay [s].
    legacy : bool
        Whether the system adds the mass, explicitly and about its diagonal, as gz-sim did before
        ``<fluid_added_mass>``.
    """

    key: ClassVar[str] = "gz-sim"
    meant: ClassVar[str] = "gz-sim 7 to 10 (with `legacy`: 8.12, 9.6 or newer), SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = (
        "gz-sim-hydrodynamics-system",
        "gz::sim::systems::Hydrodynamics",
    )
    sign: ClassVar[float] = 1.0
    speed: ClassVar[str] = "abs"
    legacy: bool = False

    @property
    def ignores(self) -> str:
        """The actuators, and what the legacy path has not."""
        return f"{DRIVEN}, and moving-frame forces of coupled added mass" if self.legacy else DRIVEN

    @property
    def explicit(self) -> bool:
        """Whether the plugin adds the mass, not the link."""
        return self.legacy

    def numbers(self, craft: Craft, body: Body) -> dict[str, float]:
        """Return the coefficients, and the added mass where the system has it."""
        tags = super().numbers(craft, body)
        if self.legacy:
            _check_explicit(craft)
            tags |= dict(zip(_EXPLICIT, -body.added.ravel(), strict=True))
        return tags

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Read the model; added mass that lags a step behind is not run."""
        if self.legacy:
            raise NotRun("added mass of the step before is none of DART's")
        return super().read(folder, craft)


@dataclass(frozen=True)
class VRX(Gazebo):
    """A model, a world and a block for the SimpleHydrodynamics of VRX.

    Parameters
    ----------
    density, step : float
        As of ``gz-sim``.
    """

    key: ClassVar[str] = "vrx"
    meant: ClassVar[str] = "VRX 2 to 3 on gz-sim, SDF 1.10"
    plugin: ClassVar[tuple[str, str]] = ("libSimpleHydrodynamics.so", "vrx::SimpleHydrodynamics")
    sign: ClassVar[float] = -1.0
    speed: ClassVar[str] = ""

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return the two terms of an axis."""
        return diagonal(axis)

    def numbers(self, craft: Craft, body: Body) -> dict[str, float]:
        """Return the coefficients; what is not said is not zero there."""
        return dict.fromkeys((*_EXPLICIT[::7], *_DRAG), 0.0) | super().numbers(craft, body)


def _check_explicit(craft: Craft) -> None:
    """Refuse added mass that steps one after the other make grow without end."""
    ratios = mass_ratio(craft.vehicle)
    heavy = [f"{axis} {ratio:.3g}" for axis, ratio in ratios.items() if ratio > 1.0]
    if not ratios:
        raise MethodError(
            f"`legacy` needs to know the added mass, and '{craft.vehicle.name}' says the mass "
            "matrix as a whole: give `rigid_body` and `added_mass` in the vehicle file."
        )
    if heavy:
        raise MethodError(
            "added mass on gz-sim's legacy path must be below the rigid body's, or it grows "
            f"without end (gz-sim#1923); '{craft.vehicle.name}' has {', '.join(heavy)} times it. "
            "Leave `legacy` out: <fluid_added_mass> holds any."
        )
