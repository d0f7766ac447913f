"""Simulators that take coefficients by their names, and cannot be run here."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.export.codegen import said_of
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.projection import diagonal
from hydrodamp.export.rigid_body import Body, numbers_of, symmetric, to_point
from hydrodamp.export.target import Files, HydrodynamicTarget, rendered
from hydrodamp.export.verification import Engine
from hydrodamp.files import load_text, parse_yaml
from hydrodamp.models.model import spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

#: Labels of linear terms, of those times u, of quadratic drag: as matrices and a row.
LINEAR = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
FORWARD = [[spell_label(axis, Term(("u", name))) for name in VELOCITIES] for axis in AXES]
QUADRATIC = [spell_label(axis, diagonal(axis)[1]) for axis in AXES]

Parsed = tuple[Body, FloatArray, FloatArray, FloatArray]

_GRAVITY = 9.8  # in MarineGym's buoyancy [m/s^2]
_URDF_GRAVITY = 9.81  # in the library hydrodynamics, parse_model_from_xml [m/s^2]

_LAG = ", and in the replay the lag of added mass that acts on a filtered acceleration"


@dataclass(frozen=True)
class Coefficients(HydrodynamicTarget):
    """One file: body, added mass, linear and quadratic drag.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    file: ClassVar[str]

    def write(self, craft: ExportedPlant) -> Files:
        """Return the file."""
        body, values = self.body(craft), craft.damping.as_dict()
        linear, forward, quadratic = (
            np.vectorize(lambda label: values.get(label, 0.0))(labels)
            for labels in (LINEAR, FORWARD, QUADRATIC)
        )
        said = {
            **said_of(craft),
            **self.more(craft, body),
            "body": body,
            "linear": linear,
            "forward": forward,
            "quadratic": quadratic,
            "point": self.point(craft),
            "density": self.density,
        }
        return {self.file: rendered(f"{self.file}.j2", **said)}

    def body(self, craft: ExportedPlant) -> Body:
        """Return the body of a craft with its centre of mass where its coefficients are about.

        These simulators let the wrench of the water act there.
        """
        return Body.of(craft, self.key, self.density).balanced

    def more(self, craft: ExportedPlant, body: Body) -> dict[str, Any]:
        """Return what else the file takes."""
        return {}

    def drag(self, text: str, body: Body, velocity: FloatArray) -> FloatArray:
        """Return drag of a file that is no product of a coefficient and velocities, (n, 6)."""
        return np.zeros_like(velocity)

    @contextmanager
    def read(self, folder: Path, craft: ExportedPlant) -> Iterator[Engine]:
        """Read the file, and hold what equation 1 makes of its numbers."""
        text = load_text(folder / self.file)
        body, *found = self.parsed(text, self.body(craft))
        labels = np.concatenate([np.ravel(each) for each in (LINEAR, FORWARD, QUADRATIC)])
        numbers = np.concatenate([np.ravel(each) for each in found])
        acting = {x: y for x, y in zip(labels.tolist(), numbers.tolist(), strict=True) if y}
        there, turn = body.craft(acting), to_point(self.point(craft))
        back = np.linalg.inv(turn)

        def rates(at: States) -> FloatArray:
            none, velocity = np.empty((len(at.velocity), 0)), at.velocity @ turn.T
            push = craft.pushed(at) @ back + self.drag(text, body, velocity)
            return np.asarray(there.acceleration(States(velocity, at.down, none, push)) @ back.T)

        not_run = f"{self.description} is in no registry of packages"
        yield Engine("hydrodamp with the numbers of the file", rates, not_run=not_run)

    @abstractmethod
    def parsed(self, text: str, own: Body) -> Parsed:
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
    description: ClassVar[str] = "uuv_simulator, DAVE or Plankton"
    file: ClassVar[str] = "uuv.urdf"
    left_out: ClassVar[str] = _LAG

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return all linear terms, those times u, and quadratic drag of the axis along itself."""
        linear = (Term((name,)) for name in VELOCITIES)
        forward = (Term(("u", name)) for name in VELOCITIES)
        return *linear, *forward, diagonal(axis)[1]

    def parsed(self, text: str, own: Body) -> Parsed:
        """Return what the URDF says."""
        said = numbers_of(text)
        inertia = [said[f"inertia.i{name}"][0] for name in ("xx", "xy", "xz", "yy", "yz", "zz")]
        turned = replace(
            own.turned,
            mass=said["mass.value"][0],
            center=said["origin.xyz"],
            inertia=symmetric(inertia),
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
    """A URDF with the ``<hydrodynamics>`` that the library ``hydrodynamics`` reads.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    key: ClassVar[str] = "urdf"
    description: ClassVar[str] = "the library hydrodynamics of auv_controllers (commit 3c4db4e)"
    file: ClassVar[str] = "hydrodynamics.urdf"
    left_out: ClassVar[str] = ", products of inertia and coupled added mass"

    def body(self, craft: ExportedPlant) -> Body:
        """Return the body of a craft whose mass has its weight in the library."""
        body = super().body(craft)
        return _with_mass(body, body.mass * STANDARD_GRAVITY / _URDF_GRAVITY)

    def parsed(self, text: str, own: Body) -> Parsed:
        """Return what the URDF says."""
        said = numbers_of(text)

        def row(tag: str, *names: str) -> FloatArray:
            return np.array([said[f"{tag}.{name}"][0] for name in names])

        body = replace(
            own,
            mass=said["mass.value"][0],
            center=row("center_of_gravity", "x", "y", "z"),
            inertia=np.diag(row("inertia", "ixx", "iyy", "izz")),
            volume=said["buoyancy.value"][0] / (self.density * STANDARD_GRAVITY),
            lifted=row("center_of_buoyancy", "x", "y", "z"),
            added=-np.diag(row("added_mass", "Xdu", "Ydv", "Zdw", "Kdp", "Mdq", "Ndr")),
        )
        linear = row("linear", "Xu", "Yv", "Zw", "Kp", "Mq", "Nr")
        quadratic = row("quadratic", "Xuu", "Yvv", "Zww", "Kpp", "Mqq", "Nrr")
        body = _with_mass(body, body.mass * _URDF_GRAVITY / STANDARD_GRAVITY)
        return body, np.diag(linear), np.zeros((6, 6)), quadratic


def _with_mass(body: Body, mass: float) -> Body:
    """Return a body of another mass, the difference counted to the added mass."""
    difference = np.diag([body.mass - mass] * 3 + [0.0] * 3)
    return replace(body, mass=mass, added=body.added + difference)


@dataclass(frozen=True)
class MarineGym(Coefficients):
    """The vehicle's YAML file of MarineGym.

    Parameters
    ----------
    density : float
        Of the water, 997 in MarineGym [kg/m^3].
    """

    key: ClassVar[str] = "marinegym"
    description: ClassVar[str] = "MarineGym"
    file: ClassVar[str] = "marinegym.yaml"
    left_out: ClassVar[str] = (
        ", mass and inertia (of the USD file), coupled added mass, a centre of buoyancy beside "
        f"that of gravity{_LAG}"
    )
    density: float = 997.0

    def parsed(self, text: str, own: Body) -> Parsed:
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
