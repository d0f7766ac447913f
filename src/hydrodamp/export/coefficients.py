"""Simulators that take coefficients by their names, and cannot be run here."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.export.body import FORWARD, LINEAR, Body, InWater, diagonal
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.frames import to_point
from hydrodamp.export.printer import number, said_of
from hydrodamp.export.target import Engine, Files, by_rate, rendered
from hydrodamp.files import load_text, parse_yaml
from hydrodamp.models.model import spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

_GRAVITY = 9.8  # in MarineGym's buoyancy [m/s^2]

_LAG = ", and in the replay the lag of added mass that acts on a filtered acceleration"

_QUADRATIC = [spell_label(axis, diagonal(axis)[1]) for axis in AXES]


@dataclass(frozen=True)
class Coefficients(InWater):
    """One file: body, added mass, linear and quadratic drag.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    file: ClassVar[str]

    def write(self, craft: Craft) -> Files:
        """Return the file."""
        body, values = self.body(craft), craft.damping.as_dict()
        linear, forward = (
            np.array([[values.get(label, 0.0) for label in row] for row in labels])
            for labels in (LINEAR, FORWARD)
        )
        quadratic = np.array([values.get(label, 0.0) for label in _QUADRATIC])
        said = {
            **said_of(craft, ""),
            **self.more(craft, body, quadratic),
            "body": body,
            "added": body.added,
            "linear": linear,
            "forward": forward,
            "quadratic": quadratic,
            "point": self.point(craft),
            "density": self.density,
            "gravity": STANDARD_GRAVITY,
            "number": number,
            "numbers": lambda array: " ".join(map(number, np.ravel(array).tolist())),
        }
        return {self.file: rendered(f"{self.file}.j2", **said)}

    def body(self, craft: Craft) -> Body:
        """Return the body of a craft with its centre of mass where its coefficients are about.

        These simulators let the wrench of the water act there.
        """
        return Body.of(craft, self.key, self.density).balanced

    def more(self, craft: Craft, body: Body, quadratic: FloatArray) -> dict[str, Any]:
        """Return what else the file takes."""
        return {}

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Read the file, and return what equation 1 makes of its numbers."""
        text, turn = load_text(folder / self.file), to_point(self.point(craft))
        body, linear, forward, quadratic = self.parsed(text, self.body(craft))
        labels = (*np.ravel(LINEAR), *np.ravel(FORWARD), *_QUADRATIC)
        found = np.concatenate([np.ravel(linear), np.ravel(forward), quadratic])
        values = {str(label): value for label, value in zip(labels, found.tolist(), strict=True)}
        acting = {label: value for label, value in values.items() if value != 0.0}
        found_there, back = body.craft(craft, acting, self.density), np.linalg.inv(turn)
        bare = replace(found_there, vehicle=replace(found_there.vehicle, actuators=()))

        def rates(at: States) -> FloatArray:
            none = np.empty((len(at.velocity), 0))
            there = States(at.velocity @ turn.T, at.down, none, craft.pushed(at) @ back)
            return np.asarray(bare.acceleration(there) @ back.T)

        def rate(*given: FloatArray) -> FloatArray:
            return np.asarray(rates(States(*(each[None] for each in given)))[0])

        engine = by_rate("hydrodamp with the numbers of the file", rate, rates)
        return replace(engine, not_run=f"{self.meant} is in no registry of packages")

    @abstractmethod
    def parsed(self, text: str, own: Body) -> tuple[Body, FloatArray, FloatArray, FloatArray]:
        """Return body, linear drag, that times forward speed, quadratic drag, as a file says them.

        What it does not say of the body is its ``own``.
        """


@dataclass(frozen=True)
class UUV(Coefficients):
    """A URDF with the hydrodynamic model ``fossen`` of uuv_simulator, DAVE and Plankton.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    key: ClassVar[str] = "uuv"
    meant: ClassVar[str] = "uuv_simulator, DAVE or Plankton"
    file: ClassVar[str] = "uuv.urdf"
    lost: ClassVar[str] = _LAG

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return all linear terms, those times u, and quadratic drag of the axis along itself."""
        linear = (Term((name,)) for name in VELOCITIES)
        forward = (Term(("u", name)) for name in VELOCITIES)
        return *linear, *forward, diagonal(axis)[1]

    def parsed(self, text: str, own: Body) -> tuple[Body, FloatArray, FloatArray, FloatArray]:
        """Return what the URDF says."""
        said = numbers_of(text)
        xx, xy, xz, yy, yz, zz = (
            said[f"inertia.i{name}"][0] for name in ("xx", "xy", "xz", "yy", "yz", "zz")
        )
        turned = replace(
            own.turned,
            mass=said["mass.value"][0],
            center=said["origin.xyz"],
            inertia=np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
            volume=said["volume"][0],
            lifted=said["center_of_buoyancy"],
        )
        return (
            replace(turned.turned, added=said["added_mass"].reshape(6, 6)),
            said["linear_damping"],
            said["linear_damping_forward_speed"],
            said["quadratic_damping"],
        )


@dataclass(frozen=True)
class URDF(Coefficients):
    """A URDF with the ``<hydrodynamics>`` of auv_controllers.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    key: ClassVar[str] = "urdf"
    meant: ClassVar[str] = "auv_controllers"
    file: ClassVar[str] = "hydrodynamics.urdf"
    lost: ClassVar[str] = ", products of inertia and coupled added mass"

    def parsed(self, text: str, own: Body) -> tuple[Body, FloatArray, FloatArray, FloatArray]:
        """Return what the URDF says."""
        said = numbers_of(text)

        def row(tag: str, *names: str) -> FloatArray:
            return np.array([said[f"{tag}.{name}"][0] for name in names])

        force = said["buoyancy.value"][0]
        body = replace(
            own,
            mass=said["mass.value"][0],
            center=row("center_of_gravity", "x", "y", "z"),
            inertia=np.diag(row("inertia", "ixx", "iyy", "izz")),
            volume=force / (self.density * STANDARD_GRAVITY),
            lifted=row("center_of_buoyancy", "x", "y", "z"),
            added=-np.diag(row("added_mass", "Xdu", "Ydv", "Zdw", "Kdp", "Mdq", "Ndr")),
        )
        linear = row("linear", "Xu", "Yv", "Zw", "Kp", "Mq", "Nr")
        quadratic = row("quadratic", "Xuu", "Yvv", "Zww", "Kpp", "Mqq", "Nrr")
        return body, np.diag(linear), np.zeros((6, 6)), quadratic


@dataclass(frozen=True)
class MarineGym(Coefficients):
    """The vehicle's YAML file of MarineGym.

    Parameters
    ----------
    density : float
        Of the water, 997 in MarineGym [kg/m^3].
    """

    key: ClassVar[str] = "marinegym"
    meant: ClassVar[str] = "MarineGym"
    file: ClassVar[str] = "marinegym.yaml"
    lost: ClassVar[str] = (
        ", mass and inertia (of the USD file), coupled added mass, a centre of buoyancy beside "
        f"that of gravity{_LAG}"
    )
    density: float = 997.0

    def more(self, craft: Craft, body: Body, quadratic: FloatArray) -> dict[str, Any]:
        """Return the volume that lifts as the buoyancy does by MarineGym's own gravity."""
        return {"volume": body.volume * STANDARD_GRAVITY / _GRAVITY}

    def parsed(self, text: str, own: Body) -> tuple[Body, FloatArray, FloatArray, FloatArray]:
        """Return what the YAML says."""
        said: Any = parse_yaml(text, self.file)
        added, linear, quadratic = (
            np.array(said["hydro_coef"][name], dtype=float)
            for name in ("added_mass", "linear_damping", "quadratic_damping")
        )
        volume = said["volume"] * _GRAVITY / STANDARD_GRAVITY
        lifted = np.array([0.0, 0.0, -said["coBM"]])
        body = replace(own, added=np.diag(added), volume=volume, lifted=lifted)
        return body, -np.diag(linear), np.zeros((6, 6)), -quadratic


def numbers_of(text: str) -> dict[str, FloatArray]:
    """Return the numbers of XML: texts by their tags, attributes by tag and name."""
    said = {}
    for each in ElementTree.fromstring(text).iter():
        texts = {f"{each.tag}.{name}": value for name, value in each.attrib.items()}
        for name, value in ({each.tag: each.text or ""} | texts).items():
            with suppress(ValueError):
                said[name] = np.array(value.split(), dtype=float)
    return said
