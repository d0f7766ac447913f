"""Channels at the ticks of one clock, turned into our axes and put together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import ACCELERATION, ATTITUDE, EULER
from hydrodamp.ingest.mapping import frames
from hydrodamp.ingest.mapping.sampler import Sampler, runs_in_degrees

if TYPE_CHECKING:
    from hydrodamp.ingest.mapping.log_mapping import LogMapping

_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]
_WORLD = ("north", "east", "down")


class Assembly:
    """The columns of the canonical form, made from the channels of a mapping."""

    def __init__(self, mapping: LogMapping, sampler: Sampler) -> None:
        self.mapping, self.sampler = mapping, sampler
        self.numbers: dict[str, FloatArray] = {"time": sampler.ticks.time}
        self.faults: list[str] = []
        self._attitude()
        self._velocity()
        for group, names in (("acceleration", ACCELERATION.columns), ("wrench", AXES)):
            for index, name in enumerate(names):
                if sampler.has(f"{group}.{name}"):
                    self._put(name, f"{group}.{name}", index % 3)
        if sampler.has("eta.eta"):
            self.numbers["eta"] = sampler.number("eta.eta")
        for name in mapping.commands:
            if sampler.has(f"commands.{name}"):
                self.numbers[name] = sampler.number(f"commands.{name}", is_command=True)

    @property
    def position(self) -> FloatArray | None:
        """North, east, down at the ticks, shape (n, 3) [m]; zero along what is not given."""
        return self._three("position", _WORLD)

    @property
    def specific_force(self) -> FloatArray | None:
        """What an accelerometer measures, body axes, shape (n, 3) [m/s^2]."""
        given = self._three("accelerometer", ("x", "y", "z"))
        if given is None:
            return None
        mounting = self.mapping.mounting("accelerometer")
        signs = [frames.vector_sign(index, mounting.axes) for index in range(3)]
        return (given * signs) @ mounting.rotation().T

    def _three(self, group: str, names: tuple[str, ...]) -> FloatArray | None:
        there = [self.sampler.has(f"{group}.{name}") for name in names]
        if not any(there):
            return None
        return np.column_stack(
            [
                self.sampler.number(f"{group}.{name}") if has else np.zeros(self.sampler.n)
                for name, has in zip(names, there, strict=True)
            ]
        )

    def _put(self, name: str, place: str, index: int, axes: str | None = None) -> None:
        """Put a component along or about a body axis among the columns."""
        sign = frames.vector_sign(index, axes or self.mapping.frame)
        values = self.sampler.number(place)
        # Taken from zero, so that zero does not become minus zero.
        self.numbers[name] = values if sign == 1.0 else 0.0 - values

    def _attitude(self) -> None:
        angles = [name for name in (*EULER, "heading") if self.sampler.has(f"attitude.{name}")]
        parts = [name for name in ATTITUDE.columns if self.sampler.has(f"attitude.{name}")]
        if angles:
            self.faults += self._degree_faults(angles)
            self._euler(angles)
        elif parts:
            self._quaternion(parts)

    def _degree_faults(self, angles: list[str]) -> Iterator[str]:
        for name in angles:
            if not self.sampler.is_direct(f"attitude.{name}") and runs_in_degrees(
                name, self.sampler.raw(f"attitude.{name}")
            ):
                yield (
                    f"`attitude.{name}` must be in rad; it runs as an angle in degrees does. Say"
                    " `unit: deg`"
                )

    def _euler(self, angles: list[str]) -> None:
        """Put angles among the columns: as angles where nothing was done to them."""
        places = [f"attitude.{name}" for name in angles]
        mounting, world = self.mapping.mounting("attitude"), self.mapping.world
        called = ["yaw" if name == "heading" else name for name in angles]
        whole = set(called) == set(EULER)
        direct = all(map(self.sampler.is_direct, places)) and not mounting.is_turned
        if whole and not direct and self.sampler.together(places):
            recorded = {
                short: frames.euler_angle(name, self.sampler.raw(place), world)
                for short, name, place in zip(called, angles, places, strict=True)
            }
            euler = np.column_stack([recorded[name] for name in EULER])
            turned = frames.unmounted(quaternion_from_euler(euler), mounting)
            self._put_quaternion(self.sampler.turned(turned, places[0]))
            return
        for short, name, place in zip(called, angles, places, strict=True):
            self.numbers[short] = frames.euler_angle(name, self.sampler.angle(place), world)
        if whole and not direct:
            euler = np.column_stack([self.numbers.pop(name) for name in EULER])
            self._put_quaternion(frames.unmounted(quaternion_from_euler(euler), mounting))

    def _quaternion(self, parts: list[str]) -> None:
        places = [f"attitude.{name}" for name in parts]
        if len(parts) < 4 or not self.sampler.together(places):
            self.faults.append(
                "a quaternion needs `qw qx qy qz`, all of one topic; got"
                f" `{' '.join(parts)}`. Map all four from the same messages"
            )
            return
        recorded = np.column_stack([self.sampler.raw(place) for place in places])
        turned = frames.quaternion_in_ned(recorded, self.mapping.world)
        mounting = self.mapping.mounting("attitude")
        if mounting.is_turned:
            turned = frames.unmounted(turned, mounting)
        self._put_quaternion(self.sampler.turned(turned, places[0]))

    def _put_quaternion(self, quaternion: FloatArray) -> None:
        self.numbers |= dict(zip(ATTITUDE.columns, quaternion.T, strict=True))

    def _at_ticks(self) -> FloatArray | None:
        """Return the attitude put so far as quaternions; level where only yaw is known."""
        if ATTITUDE.columns[0] in self.numbers:
            return np.column_stack([self.numbers[name] for name in ATTITUDE.columns])
        if "yaw" not in self.numbers:
            return None
        level = np.zeros(self.sampler.n)
        return quaternion_from_euler(
            np.column_stack([self.numbers.get(name, level) for name in EULER])
        )

    def _velocity(self) -> None:
        for part, group in ((_LINEAR, "velocity"), (_ANGULAR, "rates")):
            mounting = self.mapping.mounting(group)
            for index, name in enumerate(part):
                if self.sampler.has(f"velocity.{name}"):
                    self._put(name, f"velocity.{name}", index, mounting.axes)
            self._unmount(part, mounting)
        if self.sampler.has("velocity.north"):
            self._from_world()
        self._to_reference()

    def _unmount(self, names: tuple[str, ...], mounting: frames.Mounting) -> None:
        """Turn three components from the axes of a sensor into those of the body."""
        if mounting.is_turned and all(name in self.numbers for name in names):
            given = np.column_stack([self.numbers[name] for name in names])
            self.numbers |= dict(zip(names, mounting.rotation() @ given.T, strict=True))

    def _from_world(self) -> None:
        """Turn velocities along north, east, down into those along body axes."""
        attitude = self._at_ticks()
        if attitude is None:
            self.faults.append("a velocity along north and east needs a heading, which is missing")
            return
        tilts = self.sampler.has("velocity.down")
        given = [
            self.sampler.number(f"velocity.{name}") for name in (_WORLD if tilts else _WORLD[:2])
        ]
        if not tilts:
            given.append(np.zeros(self.sampler.n))
        body = frames.into_body(attitude, given).T
        known = _LINEAR if tilts else _LINEAR[:2]
        self.numbers |= dict(zip(known, body, strict=False))

    def _to_reference(self) -> None:
        """Move the velocity from where it is measured to the reference point."""
        position = self.mapping.mounting("velocity").position
        if not any(position) or not any(name in self.numbers for name in _LINEAR):
            return
        zero = np.zeros(self.sampler.n)
        given, rates = (
            np.column_stack([self.numbers.get(name, zero) for name in names])
            for names in (_LINEAR, _ANGULAR)
        )
        moved = frames.at_reference(given, rates, position)
        for index, name in enumerate(_LINEAR):
            if name in self.numbers:
                self.numbers[name] = moved[:, index]
