"""Simulators that take coefficients by their names, and cannot be run here."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.export.body import Body, numbers_of, symmetric, to_point
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import Engine
from hydrodamp.export.printer import said_of
from hydrodamp.export.target import Files, InWater, diagonal, rendered
from hydrodamp.files import load_text, parse_yaml
from hydrodamp.models.model import spell_label
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

#: Labels of linear terms, of those times u, of quadratic drag: as matrices and a row.
LINEAR = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
FORWARD = [[spell_label(axis, Term(("u", name))) for name in VELOCITIES] for axis in AXES]
QUADRATIC = [spell_label(axis, diagonal(axis)[1]) for axis in AXES]

Parsed = tuple[Body, FloatArray, FloatArray, FloatArray]

_GRAVITY = 9.8  # in MarineGym's buoyancy [m/s^2]

#: Degrees a radian: eq. 24 adds rates in deg/s to velocities in m/s.
_SCORED = np.array([1.0] * 3 + [np.degrees(1.0)] * 3)

_LAG = ", and in the replay the lag of added mass that acts on a filtered acceleration"


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
        linear, forward, quadratic = (
            np.vectorize(lambda label: values.get(label, 0.0))(labels)
            for labels in (LINEAR, FORWARD, QUADRATIC)
        )
        said = {
            **said_of(craft),
            **self.more(craft, body, quadratic),
            "body": body,
            "linear": linear,
            "forward": forward,
            "quadratic": quadratic,
            "point": self.point(craft),
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

    @contextmanager
    def read(self, folder: Path, craft: Craft) -> Iterator[Engine]:
        """Read the file, and hold what equation 1 makes of its numbers."""
        body, *found = self.parsed(load_text(folder / self.file), self.body(craft))
        labels = np.concatenate([np.ravel(each) for each in (LINEAR, FORWARD, QUADRATIC)])
        numbers = np.concatenate([np.ravel(each) for each in found])
        acting = {x: y for x, y in zip(labels.tolist(), numbers.tolist(), strict=True) if y}
        there, turn = body.craft(acting), to_point(self.point(craft))
        back = np.linalg.inv(turn)

        def rates(at: States) -> FloatArray:
            none, push = np.empty((len(at.velocity), 0)), craft.pushed(at) @ back
            moved = States(at.velocity @ turn.T, at.down, none, push)
            return np.asarray(there.acceleration(moved) @ back.T)

        not_run = f"{self.meant} is in no registry of packages"
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
    meant: ClassVar[str] = "uuv_simulator, DAVE or Plankton"
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
    """A URDF with the ``<hydrodynamics>`` of auv_controllers.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    """

    key: ClassVar[str] = "urdf"
    meant: ClassVar[str] = "auv_controllers"
    file: ClassVar[str] = "hydrodynamics.urdf"
    left_out: ClassVar[str] = ", products of inertia and coupled added mass"

    def parsed(self, text: str, own: Body) -> Parsed:
        """Return what the URDF says."""
        said = numbers_of(text)

        def row(tag: str, *names: str) -> FloatArray:
            return np.array([said[f"{tag}.{name}"][0] for name in names])

        body = replace(
            own,
            mass=said["mass"][0],
            center=row("center_of_gravity", "x", "y", "z"),
            inertia=np.diag(row("inertia", "ixx", "iyy", "izz")),
            volume=said["buoyancy"][0] / (self.density * STANDARD_GRAVITY),
            lifted=row("center_of_buoyancy", "x", "y", "z"),
            added=-np.diag(row("added_mass", "Xdu", "Ydv", "Zdw", "Kdp", "Mdq", "Ndr")),
        )
        linear = row("linear_damping", "Xu", "Yv", "Zw", "Kp", "Mq", "Nr")
        quadratic = row("quadratic_damping", "Xuu", "Yvv", "Zww", "Kpp", "Mqq", "Nrr")
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


@dataclass(frozen=True)
class Stonefish(Coefficients):
    """A scenario with a box, whose form drag and skin friction are scaled along x, y and z.

    Parameters
    ----------
    density : float
        Of the water [kg/m^3].
    length, width, height : float
        Proportions of the box; its volume is the displaced one.
    """

    key: ClassVar[str] = "stonefish"
    meant: ClassVar[str] = "Stonefish 1.3 to 1.5"
    file: ClassVar[str] = "stonefish.scn"
    left_out: ClassVar[str] = (
        ", what its mesh makes of motion on several axes at once, and that it estimates added mass "
        "itself"
    )
    length: float = 1.0
    width: float = 1.0
    height: float = 1.0

    def point(self, craft: Craft) -> FloatArray:
        """Return the centre of buoyancy: the middle of the box."""
        return craft.vehicle.center_of_buoyancy

    def body(self, craft: Craft) -> Body:
        """Return the body of a craft about the middle of the box."""
        return Body.of(craft, self.key, self.density).about(self.point(craft))

    def allowed(self, axis: str) -> Iterable[Term]:
        """Return quadratic drag of an axis along itself."""
        return diagonal(axis)[1:]

    def more(self, craft: Craft, body: Body, quadratic: FloatArray) -> dict[str, Any]:
        """Return the sides of the box, and the multipliers that come nearest to the drag."""
        sides = np.array([self.length, self.width, self.height])
        sides = sides * np.cbrt(body.volume / sides.prod())
        weight = _SCORED * craft.inverse.diagonal() * craft.box.extent**2
        shares = 0.5 * self.density * box_drag(sides) * weight[:, None]
        wanted = -quadratic * weight
        found = [nnls(shares[[i, i + 3]], wanted[[i, i + 3]])[0] for i in range(3)]
        return {"sides": sides, "multipliers": np.array(found).T}

    def parsed(self, text: str, own: Body) -> Parsed:
        """Return what the scenario says, each axis moving by itself."""
        said, none = numbers_of(text), np.zeros((6, 6))
        names = "quadratic_drag", "viscous_drag"
        scale = np.array([said[f"hydrodynamics.{name}"] for name in names]).T
        drag = box_drag(said["dimensions.xyz"]) * np.tile(scale, (2, 1))
        body = replace(
            own,
            mass=said["mass.value"][0],
            center=said["cg.xyz"],
            inertia=np.diag(said["inertia.xyz"]),
            volume=float(said["dimensions.xyz"].prod()),
            lifted=said["origin.xyz"],
        )
        return body, none, none, -0.5 * self.density * drag.sum(axis=1)


def box_drag(sides: FloatArray) -> FloatArray:
    """Return what Stonefish sums over the triangles of a box that moves or turns by one.

    Shape (6, 2): on each axis along itself, squared speed times area of form drag, which is on the
    faces ahead, and of skin friction.
    """
    found, unit = np.zeros((6, 2)), np.eye(3)
    for axis, ahead, corner in product(range(3), (1.0, -1.0), (1.0, -1.0)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        area = sides[first] * sides[second] / 2.0
        middle = corner / 6.0 * (sides[first] * unit[first] - sides[second] * unit[second])
        point = ahead * sides[axis] / 2.0 * unit[axis] + middle
        for motion in range(6):
            turns, along = motion > 2, unit[motion % 3]
            velocity = np.cross(along, point) if turns else along
            normal = (velocity @ unit[axis]) * unit[axis]
            form = normal if ahead * velocity[axis] > 0.0 else 0.0 * normal
            for kind, part in enumerate((form, velocity - normal)):
                force = area * np.linalg.norm(part) * part
                found[motion, kind] += along @ (np.cross(point, force) if turns else force)
    return found
