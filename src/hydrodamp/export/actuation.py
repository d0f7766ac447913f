"""Actuators of simulators: where each command acts, x forward, y to port, z up.

MuJoCo takes the force per unit of each command. gz-sim takes thrusters, propellers and fins with a
joint and a system each: Thruster by its force or n|n|, LiftDrag by u|u| times the angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple
from xml.etree.ElementTree import Element, tostring

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.codegen import parse_numbers
from hydrodamp.export.plant import FLU, ExportedPlant, States
from hydrodamp.vehicle.actuators import (
    Actuator,
    Curve,
    Fin,
    Limited,
    Propeller,
    Thruster,
    wrench_of,
)


class CommandForce(NamedTuple):
    """The part of a command's wrench that is proportional to it."""

    command: str
    position: FloatArray  # (3,) [m]
    gear: FloatArray  # (6,), wrench at the position per unit of force
    gain: float  # force per unit of the command; 0 where it is not proportional
    limit: float | None


def command_forces(plant: ExportedPlant) -> Iterator[CommandForce]:
    """Yield the force of each command: at its thruster, or else at the origin."""
    names = [str(term) for term in (*plant.vehicle.known_columns(), *plant.damping.model.basis)]
    terms = plant.damping.model.basis
    curved = {x.command for x in plant.vehicle.actuators if isinstance(x, Curve)}
    actuators = [x for x in plant.vehicle.actuators if not isinstance(x, Curve)]
    for command in plant.commands:
        users = [x for x in actuators if command in x.commands]
        in_terms = any(command in term.commands for term in terms)
        only = users[0] if len(users) == 1 and not in_terms else None
        limit = only.limit if isinstance(only, Limited) else None
        if isinstance(only, Thruster):
            gear = FLU * [*only.direction, 0.0, 0.0, 0.0] + 0.0
            position = FLU[:3] * only.position + 0.0
            gain = 0.0 if command in curved else only.gain or 0.0
            yield CommandForce(command, position, gear, gain, limit)
        else:
            gear = FLU * plant.matrix[[name == command for name in names]].sum(axis=0) + 0.0
            gain = float(gear.any() and command not in curved)
            yield CommandForce(command, np.zeros(3), gear, gain, limit)


UNLIMITED = 1e9  # N or unit of n; the default of Thruster is 1000
ORTHOGONALITY = 1e-9  # cosine between force and moment of a force at a point


class Effector(NamedTuple):
    """A thruster, propeller or fin of gz-sim."""

    actuator: Thruster | Propeller | Fin
    joint: str
    position: FloatArray  # (3,) [m]
    direction: FloatArray  # (3,), of the force of a positive command
    coefficient: float  # N per N, per squared unit of n, or per (m/s)^2 and rad
    lowest: float  # of what its topic takes: thrust [N], n or angle [rad]
    highest: float

    @property
    def kind(self) -> str:
        """Class of the actuator in lower case."""
        return type(self.actuator).__name__.lower()

    @property
    def topic(self) -> str:
        """Topic of its system, below that of its joint."""
        return {"thruster": "cmd_thrust", "propeller": "cmd_vel", "fin": "0/cmd_pos"}[self.kind]

    @property
    def axis(self) -> FloatArray:
        """Axis of its joint."""
        is_fin = isinstance(self.actuator, Fin)
        return np.cross([1.0, 0.0, 0.0], self.direction) + 0.0 if is_fin else self.direction

    def setting(self, commands: Mapping[str, FloatArray]) -> FloatArray:
        """Return what is sent to its topic for commands, (n,)."""
        actuator, value = self.actuator, self.actuator.channels(commands)[self.actuator.channel]
        is_plain = isinstance(actuator, Thruster) and not actuator.derived
        return actuator.acting(value) if is_plain else value


def gazebo_effector(actuator: Actuator, number: int) -> Effector | None:
    """Return an actuator of gz-sim; None if no system has its force."""
    if not isinstance(actuator, Thruster | Propeller | Fin):
        return None
    joint, limit = f"{actuator.command}_{number}", actuator.limit or UNLIMITED
    forward = np.array([1.0, 0.0, 0.0])
    if isinstance(actuator, Thruster):
        bounds = np.array([-limit, limit])
        thrusts = actuator.acting(bounds) if actuator.limit or actuator.curve else bounds
        direction, position = (FLU[:3] * x + 0.0 for x in (actuator.direction, actuator.position))
        lowest, highest = sorted(thrusts.tolist())
        return Effector(actuator, joint, position, direction, 1.0, lowest, highest)
    if isinstance(actuator, Propeller):
        thrust, limits = actuator.thrust, (-limit, limit)
        return Effector(actuator, joint, np.zeros(3), forward, thrust, *limits) if thrust else None
    force, moment = np.split(FLU * wrench_of(actuator.force), 2)
    size, product = float(np.linalg.norm(force)), abs(float(force @ moment))
    if not size or force[0] or product > ORTHOGONALITY * size * float(np.linalg.norm(moment)):
        return None
    position, angle = np.cross(force, moment) / size**2 + 0.0, min(limit, np.pi / 2.0)
    return Effector(actuator, joint, position, force / size + 0.0, size, -angle, angle)


class Actuation:
    """Actuators of a plant in gz-sim, and the rest of its wrench, which no system has."""

    def __init__(self, plant: ExportedPlant) -> None:
        self.plant = plant
        actuators = enumerate(plant.vehicle.actuators, start=1)
        pairs = [(each, gazebo_effector(each, number)) for number, each in actuators]
        self.effectors = [effector for _, effector in pairs if effector]
        remainders = (_without_effector(each) if effector else each for each, effector in pairs)
        vehicle = replace(plant.vehicle, actuators=tuple(filter(None, remainders)))
        self.remainder = replace(plant, vehicle=vehicle)

    @cached_property
    def omitted(self) -> str:
        """Actuators of which no system has the force, or part of it."""
        if not self.plant.commands:
            return "the actuators (its input is a wrench)"
        commands = [
            name
            for actuator in self.remainder.vehicle.actuators
            if any(wrench.any() for _, wrench in actuator.regressor_terms())
            for name in actuator.commands
        ]
        names = ", ".join(dict.fromkeys((*commands, *self.plant.damping.model.commands)))
        return f"forces of {names} that no system of gz-sim has (apply them)" if names else ""

    def wrench(self, at: States, model: Element) -> FloatArray:
        """Return the wrench of inputs (n, 6), with that of the effectors in a model of SDF."""
        plant, velocity = self.plant, at.velocity * FLU
        commands = dict(zip(plant.commands, at.inputs.T, strict=False))
        named = plant.vehicle.shape_commands(commands)
        columns = [plant.inputs.index(name) for name in self.remainder.inputs]
        total = self.remainder.applied_wrench(at._replace(inputs=at.inputs[:, columns]))
        for effector in self.effectors:
            total = total + FLU * _file_wrench(model, effector, effector.setting(named), velocity)
        return total


def _without_effector(actuator: Actuator) -> Actuator | None:
    """Return what an effector does not represent of an actuator."""
    if isinstance(actuator, Propeller):  # it also gives u_c
        return replace(actuator, thrust=0.0)
    return replace(actuator, force=()) if isinstance(actuator, Fin) and actuator.drag else None


def _file_wrench(
    model: Element, effector: Effector, setting: FloatArray, velocity: FloatArray
) -> FloatArray:
    """Return the wrench that a system of gz-sim applies by the numbers in a file, (n, 6)."""
    tag = "control_joint_name" if effector.kind == "fin" else "thrust_coefficient/../joint_name"
    numbers = _numbers(model, f"plugin/{tag}[.='{effector.joint}']/..")
    if effector.kind == "fin":
        position, forward, upward = (numbers[name] for name in ("cp", "forward", "upward"))
        span = np.cross(forward, upward)
        flow = velocity[:, :3] + np.cross(velocity[:, 3:], position)
        plane = flow - np.outer(flow @ span, span)
        pressure = 0.5 * numbers["air_density"] * np.linalg.norm(plane, axis=1)
        lift = numbers["control_joint_rad_to_cl"] * numbers["area"] * setting * pressure
        force = lift[:, None] * np.cross(span, plane)
    else:
        [link] = model.iterfind(f"link[@name='{effector.joint}_link']")
        position = read_position(link)
        axis = _numbers(model, f"joint[@name='{effector.joint}']")["xyz"]
        size = np.clip(setting, numbers["min_thrust_cmd"], numbers["max_thrust_cmd"])
        if effector.kind == "propeller":
            scale = numbers["thrust_coefficient"] * numbers["propeller_diameter"] ** 4
            size = numbers["fluid_density"] * scale * size * np.abs(size)
        force = np.outer(size, axis)
    return np.concatenate([force, np.cross(position, force)], axis=1)


def read_position(link: Element) -> FloatArray:
    """Return the position of a link, (3,)."""
    return np.array((link.findtext("pose") or "").split()[:3], dtype=float)


def _numbers(model: Element, path: str) -> dict[str, FloatArray]:
    """Return the numbers of an element of a model."""
    element = model.find(path)
    return {} if element is None else parse_numbers(tostring(element, "unicode"))
