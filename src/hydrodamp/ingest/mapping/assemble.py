"""From a recording to a record: channels found, brought to one clock, turned into our axes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.attitude import (
    quaternion_from_euler,
    quaternion_product,
    rotate_to_body,
    rotation_matrices,
)
from hydrodamp.data.canonical import is_in_degrees, record_of_columns
from hydrodamp.data.channels import ACCELERATION, ATTITUDE, EULER, POSITION, SPECIFIC_FORCE, WRENCH
from hydrodamp.data.record import Record, split_segments, stack_columns
from hydrodamp.data.recording import Recording
from hydrodamp.data.units import unit_factor
from hydrodamp.errors import ClockWarning, LogError, warn
from hydrodamp.ingest.formats.files import LEFT_OUT
from hydrodamp.ingest.irregularity import Oddity, sentences
from hydrodamp.ingest.mapping.columns import find, locate, meant, renamed
from hydrodamp.ingest.mapping.resampling import Sampler
from hydrodamp.ingest.mapping.schema import RECORDED, SINGLE, Entry, MappingFile, Source
from hydrodamp.ingest.mapping.streams import streams_of

_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]
_FLIPPED = np.array([1.0, -1.0, -1.0])
# Vectors along the axes of a sensor, and the group of each.
_SENSED = (
    ("velocity", "velocity", _LINEAR),
    ("rates", "velocity", _ANGULAR),
    ("specific_force", "specific_force", SPECIFIC_FORCE.columns),
)
_NORTH_OF_EAST = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])  # a quarter turn, down now
_EXPECTED = (Oddity.DROPOUT, Oddity.EMPTY)  # in any log; no more than a note


def record_of(mapping: MappingFile, recording: Recording) -> Record:
    """Return the record that a mapping makes of a recording."""
    try:
        sampler = sampler_of(mapping, recording)
    except LogError as error:
        raise LogError(error.faults, source=recording.source) from error
    made = Assembly(mapping, sampler)
    record, faults = record_of_columns(
        made.numbers,
        tuple(name for name in mapping.commands if name in made.numbers),
        sampler.labels(),
        sampler.lines(),
        recording.source,
        sampler.ticks.run,
    )
    faults = [*made.faults, *faults]
    if faults or record is None:
        raise LogError(faults or ["there are no samples"], source=recording.source)
    first = float(record.time[np.argmax(split_segments(record)[0])])
    odd = [*sentences(sampler.irregularities, first)]
    if told := [sentence for oddity, sentence in odd if oddity not in _EXPECTED]:
        warn(f"{recording.source}: {'; '.join(told)}", ClockWarning, stacklevel=3)
    notes = (*recording.notes, *_summary(mapping, sampler), *(sentence for _, sentence in odd))
    return dataclasses.replace(record, notes=notes)


def sampler_of(mapping: MappingFile, recording: Recording) -> Sampler:
    """Find all channels and set their clocks right, or tell every fault."""
    names = meant(mapping.topics, recording)
    wanted = [entry for entry in mapping.entries if entry.group != "time"]
    segment = None if mapping.segment is None else renamed(mapping.segment, names)
    labelled = None if segment is None else locate(segment, recording)
    if segment is not None and labelled is None:
        wanted.append(Entry("segment", "segment", (Source(column=segment),)))
    is_table = all(not one.name and one.time is None for one in recording.topics)
    if is_table and not any(one.rate or one.column == RECORDED for one in mapping.time):
        wanted.insert(0, Entry("time", "time", mapping.time, "time"))
    found, faults = find(wanted, recording, mapping.name, mapping.topics)
    found = [one for one in found if one.entry.group != "time"]
    streams, untimed = streams_of(found, mapping.time, labelled)
    if faults := [*faults, *(() if is_table and faults else untimed)]:
        raise LogError([*faults, *(one for one in recording.notes if one.startswith(LEFT_OUT))])
    clock = mapping.clock.topic
    return Sampler(found, streams, names.get(clock or "", clock), mapping.clock.rate)


def _summary(mapping: MappingFile, sampler: Sampler) -> Iterator[str]:
    """Yield notes: whose clock the log follows, where there was a choice; what is constant."""
    base, rate = sampler.base.topic.name, mapping.clock.rate
    others = len({stream.topic.name for stream in sampler.streams} - {base})
    if rate is not None:
        yield f"brought to {rate:g} Hz over the messages of `{base}`"
    elif others:
        yield f"{others} topic{'s' if others > 1 else ''} brought to the clock of `{base}`"
    for place, value in sampler.constants.items():
        name = place.partition(".")[2]
        yield f"`{name}` was not recorded; the mapping takes it as {value:g} throughout"


class Assembly:
    """The columns of the canonical form, made from channels at the ticks of one clock."""

    def __init__(self, mapping: MappingFile, sampler: Sampler) -> None:
        self.mapping, self.sampler = mapping, sampler
        self.numbers: dict[str, FloatArray] = {"time": sampler.ticks.time}
        self.faults: list[str] = []
        self._attitude()
        self._vectors()
        for block, axes in (
            (ACCELERATION, mapping.frame),
            (WRENCH, mapping.frame),
            (POSITION, "FRD"),
        ):
            self._put(block.name, block.columns, axes)
        for block in (POSITION, SPECIFIC_FORCE):
            if any(name in self.numbers for name in block.columns):  # zero along what is absent
                self._replace(block.columns, self._columns(block.columns))
        for name in SINGLE:
            self._put(name, (name,), "FRD")
        for name in mapping.commands:
            if sampler.has(f"commands.{name}"):
                self.numbers[name] = sampler.number(f"commands.{name}", is_command=True)

    def _put(self, group: str, names: Sequence[str], axes: str) -> None:
        """Put components along or about body axes among the columns, those that are there."""
        for index, name in enumerate(names):
            if self.sampler.has(place := f"{group}.{name}"):
                values = self.sampler.number(place)
                # Taken from zero, so that zero does not become minus zero.
                self.numbers[name] = 0.0 - values if axes == "FLU" and index % 3 else values

    def _columns(self, names: Sequence[str]) -> FloatArray:
        """Return columns put so far side by side; zero where there is none."""
        return stack_columns(self.numbers, names, self.sampler.n)

    def _replace(self, names: Sequence[str], columns: FloatArray) -> None:
        self.numbers |= dict(zip(names, columns.T, strict=True))

    def _turned_sensor(self, group: str) -> FloatArray | None:
        """Return what turns components of a sensor into those of our body; None for nothing."""
        turn = getattr(self.mapping.sensors, group).rotation
        sign = -1.0 if self.mapping.frame == "FLU" else 1.0
        angles = np.array([(turn.roll, sign * turn.pitch, sign * turn.yaw)])
        return quaternion_from_euler(angles * unit_factor(turn.unit)) if angles.any() else None

    def _attitude(self) -> None:
        names = [name for name in (*EULER, "heading") if self.sampler.has(f"attitude.{name}")]
        parts = [name for name in ATTITUDE.columns if self.sampler.has(f"attitude.{name}")]
        if faults := [
            f"`attitude.{name}` must be in rad; it runs as an angle in degrees does. Say"
            " `unit: deg`"
            for name in names
            if is_in_degrees(name, self.sampler.raw(f"attitude.{name}"))
        ]:
            self.faults += faults
        elif names:
            self._euler({"yaw" if name == "heading" else name: name for name in names})
        elif parts:
            self._quaternion([f"attitude.{name}" for name in parts])

    def _euler(self, given: dict[str, str]) -> None:
        places = {short: f"attitude.{name}" for short, name in given.items()}
        is_whole = set(given) == set(EULER)
        is_together = is_whole and self.sampler.together([*places.values()])
        sample = self.sampler.raw if is_together else self.sampler.angle
        angles = {short: self._in_ned(given[short], sample(places[short])) for short in given}
        if is_whole:
            turned = quaternion_from_euler(np.column_stack([angles[name] for name in EULER]))
            self._put_attitude(turned, places["yaw"] if is_together else "")
        else:
            self.numbers |= angles

    def _in_ned(self, name: str, angle: FloatArray) -> FloatArray:
        """Return an Euler angle against north-east-down."""
        if self.mapping.world == "NED" or name in ("roll", "heading"):
            return angle
        return math.pi / 2 - angle if name == "yaw" and self.mapping.world == "ENU" else -angle

    def _quaternion(self, places: list[str]) -> None:
        if len(places) < 4 or not self.sampler.together(places):
            self.faults.append(
                "a quaternion needs `qw qx qy qz`, all of one topic; got"
                f" `{' '.join(place.partition('.')[2] for place in places)}`. Map all four from the"
                " same messages"
            )
            return
        recorded = np.column_stack([self.sampler.raw(place) for place in places])
        if self.mapping.world != "NED":
            recorded *= (1.0, 1.0, -1.0, -1.0)
        if self.mapping.world == "ENU":
            recorded = quaternion_product(_NORTH_OF_EAST, recorded)
        self._put_attitude(recorded, places[0])

    def _put_attitude(self, attitude: FloatArray, place: str) -> None:
        """Put the attitude of a sensor among the columns; at the messages of a place, or ticks."""
        if (turn := self._turned_sensor("attitude")) is not None:
            attitude = quaternion_product(attitude, turn * (1.0, -1.0, -1.0, -1.0))
        if place:
            attitude = self.sampler.turned(attitude, place)
        self._replace(ATTITUDE.columns, attitude)

    def _at_ticks(self) -> FloatArray | None:
        """Return the attitude put so far as quaternions; level where only yaw is known."""
        if ATTITUDE.columns[0] in self.numbers:
            return self._columns(ATTITUDE.columns)
        return quaternion_from_euler(self._columns(EULER)) if "yaw" in self.numbers else None

    def _vectors(self) -> None:
        sensors, frame = self.mapping.sensors, self.mapping.frame
        for sensor, group, names in _SENSED:
            self._put(group, names, getattr(sensors, sensor).axes or frame)
            turn = self._turned_sensor(sensor)
            if turn is not None and all(name in self.numbers for name in names):
                self._replace(names, self._columns(names) @ rotation_matrices(turn)[0].T)
        if self.sampler.has("velocity.north"):
            self._from_world()
        there = [name for name in _LINEAR if name in self.numbers]
        if any(sensors.velocity.position) and there:
            arm = np.array(sensors.velocity.position) * (_FLIPPED if frame == "FLU" else 1.0)
            moved = self._columns(_LINEAR) - np.cross(self._columns(_ANGULAR), arm)
            self.numbers |= {name: moved[:, _LINEAR.index(name)] for name in there}

    def _from_world(self) -> None:
        """Turn velocities along north, east, down into those along body axes."""
        attitude = self._at_ticks()
        if attitude is None:
            if not self.faults:
                self.faults = ["a velocity along north and east needs a heading, which is missing"]
            return
        known = 3 if self.sampler.has("velocity.down") else 2
        given = [self.sampler.number(f"velocity.{name}") for name in POSITION.columns[:known]]
        body = rotate_to_body(attitude, np.column_stack(given))
        self._replace(_LINEAR[:known], body[:, :known])
