"""The text of a vehicle file to fill in."""

from __future__ import annotations

import json
import re

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.vehicle import Vehicle

WATER_DENSITY = 1025.0
"""Of the sea [kg/m^3]."""

UNLIKELY = 3.0
"""Ratio of mass and displaced mass beyond which a size is taken for a mistake."""

_TEXT = """\
# A vehicle for hydrodamp. Frame: x forward, y starboard, z down; SI units, angles in rad.
# All positions are seen from one origin, which is also where velocities are recorded.
name: {name}
source: {source}

# Free axes. A surface craft or a planar model has fewer, such as [X, Y, N]: what belongs to
# the others alone (inertia, added mass) may then stay empty.
axes: [X, Y, Z, K, M, N]

rigid_body:
  mass: {mass} # kg, flooded spaces included
  inertia: {inertia} # kg m^2: Ixx, Iyy, Izz
  inertia_about: {about} # origin or center_of_gravity

# Added mass, positive: minus the derivatives X_udot, Y_vdot ... N_rdot on the diagonal, and
# minus the mean of each pair such as Y_rdot and N_vdot in both places off it.
added_mass:
{added}

# Instead of rigid_body: mass_matrix, 6 x 6, the sum of rigid body and added mass.

# Where none of Z, K, M is free, these four may stay empty; r_G is then the origin.
weight: {weight} # N, positive
buoyancy: {buoyancy} # N, positive
center_of_gravity: {gravity} # m
center_of_buoyancy: {lift} # m
# These two make the righting moment: gravity must lie below buoyancy, its z larger by the
# metacentric height, mostly millimetres to centimetres, or nothing turns the vehicle upright. Where
# a weight of m kg, moved d m aside, heels the vehicle by phi, it is m*d/(mass*tan(phi)). Or it is
# fitted, by the terms down_y on K and down_x on M in a model file.
# A craft that floats has its metacenter in place of center_of_buoyancy.

"""

_ACTUATORS = """\
# What is known of the actuation, in newtons. Leave out what is not: a log with commands of
# unknown gain is fitted with terms such as u|u|*rudder or ch_forward. Examples:
#
#   - {kind: fin, command: rudder, force: {Y: 9.0, N: -9.0}, drag: {X: -4.7}, limit: 0.35}
#       force per u|u|*angle, drag per u|u|*angle^2, limit in rad; dead_zone: [-0.01, 0.01]
#       is optional, as for a propeller
#   - {kind: propeller, command: rpm, thrust: 3.2e-6, speed_slope: 0.001}
#       thrust per rpm*|rpm|; steady speed u_c = 0.001*rpm [m/s]
#   - {kind: thruster, command: port, position: [-0.2, -0.1, 0], direction: [1, 0, 0], gain: 40}
#       or, instead of the gain, curve: [[-1, -40], [0, 0], [1, 50]] of command and newtons
#       (pulse widths will do); dead_zone: [-0.1, 0.1] and limit: 1 are optional
#   - {kind: matrix, commands: [ch_forward], wrench: [[35, 0, 0, 0, 0, 0]]}
#       X Y Z K M N per unit of each command
actuators: []
"""


_NOTHING = {
    **dict.fromkeys(("mass", "weight", "buoyancy", "gravity", "lift"), ""),
    "source": '""',
    "inertia": "[null, null, null]",
    "about": "origin",
    "added": "\n".join(
        f"  - [{', '.join('null' if i == j else '0' for i in range(6))}]" for j in range(6)
    ),
}


def vehicle_template(
    name: str = "my-vehicle",
    *,
    length: float | None = None,
    diameter: float | None = None,
    mass: float | None = None,
) -> str:
    """Return the text of a vehicle file."""
    numbers = _NOTHING
    if length is not None and diameter is not None and mass is not None:
        numbers = _estimate(length, diameter, mass)
    elif (length, diameter, mass) != (None, None, None):
        raise VehicleError("an estimate needs `length`, `diameter` and `mass` together, or none")
    return _TEXT.format(name=json.dumps(name), **numbers) + _ACTUATORS


def copied(text: str, name: str) -> str:
    r"""Return the text of a vehicle file under another name, with room for actuators."""
    renamed = re.sub(r"(?m)^name:.*$", lambda _: f"name: {json.dumps(name)}", text, count=1)
    if re.search(r"(?m)^actuators:", text):
        return renamed
    return f"{renamed.rstrip()}\n\n{_ACTUATORS}"


def _estimate(length: float, diameter: float, mass: float) -> dict[str, str]:
    """Return the numbers of a hull of this size, refused in other units: what dives floats."""
    vehicle = Vehicle.from_hull(length, diameter, mass)
    cylinder = WATER_DENSITY * np.pi / 4.0 * diameter**2 * length
    spheroid = cylinder * 2.0 / 3.0
    if not spheroid / UNLIKELY <= mass <= cylinder * UNLIKELY:
        raise VehicleError(
            f"a hull {length:g} m long and {diameter:g} m across displaces {spheroid:.3g} to "
            f"{cylinder:.3g} kg of water, which does not fit a `mass` of {mass:g} kg: give metres "
            "and kilograms, flooded spaces included"
        )
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    return {
        "source": json.dumps(f"{vehicle.source}: {vehicle.note}"),
        "mass": repr(float(mass)),
        "inertia": _list((vehicle.mass_matrix - added).diagonal()[3:]),
        "about": "center_of_gravity",
        "added": "\n".join(f"  - {_list(row)}" for row in added),
        "weight": f"{vehicle.weight:.6g}",
        "buoyancy": f"{vehicle.buoyancy:.6g}",
        "gravity": _list(vehicle.center_of_gravity),
        "lift": _list(vehicle.center_of_buoyancy),
    }


def _list(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"
