"""Assembly of a record: find channels, resample to one clock, rotate to FRD axes and NED world.

Lever arm of a velocity sensor: v = v_sensor - omega x r. World velocity: nu = R(q)^T v_world.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import (
    quaternion_from_euler,
    quaternion_product,
    rotate_to_body,
    rotation_matrices,
)
from hydrodamp.data.channels import (
    ACCELERATION,
    ATTITUDE,
    EULER,
    POSITION,
    SPECIFIC_FORCE,
    WRENCH,
    unit_factor,
)
from hydrodamp.data.columns import is_in_degrees, record_of_columns
from hydrodamp.data.record import Record, split_segments, stack_columns
from hydrodamp.data.recording import Recording
from hydrodamp.errors import ClockWarning, LogError, warn
from hydrodamp.ingest.clock import IrregularityKind, describe_irregularities
from hydrodamp.ingest.formats.files import SKIPPED
from hydrodamp.ingest.mapping.channel_schema import (
    COORDINATES,
    RECORDED_TIME,
    SINGLE_CHANNELS,
    Entry,
    Source,
)
from hydrodamp.ingest.mapping.columns import (
    find_columns,
    locate_column,
    rename_topic,
    resolve_topics,
)
from hydrodamp.ingest.mapping.geodesy import tangent_plane
from hydrodamp.ingest.mapping.resampling import Resampler, build_streams
from hydrodamp.ingest.mapping.schema import MappingFile

_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]
_FLU_TO_FRD = np.array([1.0, -1.0, -1.0])
# Vectors in sensor axes: sensor, channel group, names.
_SENSOR_VECTORS = (
    ("velocity", "velocity", _LINEAR),
    ("rates", "velocity", _ANGULAR),
    ("specific_force", "specific_force", SPECIFIC_FORCE.columns),
)
_ENU_TO_NED = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])  # quaternion: yaw by 90 deg
# Occur in any log: a note, no warning.
_NOTE_ONLY = (IrregularityKind.WRAPPED, IrregularityKind.DROPOUT, IrregularityKind.INVALID)


def build_record(
    mapping: MappingFile, recording: Recording, resampler: Resampler | None = None
) -> Record:
    """Return the record of a recording by a mapping."""
    resampler = resampler or build_resampler(mapping, recording)
    assembly = Assembly(mapping, resampler)
    record, faults = record_of_columns(
        assembly.numbers,
        tuple(name for name in mapping.commands if name in assembly.numbers),
        resampler.labels(),
        resampler.lines(),
        recording.source,
        resampler.ticks.run,
    )
    faults = [*assembly.faults, *faults]
    if faults or record is None:
        raise LogError(faults or ["the recording has no samples"])
    first = float(record.time[np.argmax(split_segments(record)[0])])
    irregularities = [*describe_irregularities(resampler.irregularities, first)]
    if warnings := [sentence for kind, sentence in irregularities if kind not in _NOTE_ONLY]:
        warn(f"{recording.source}: {'; '.join(warnings)}", ClockWarning, stacklevel=3)
    notes = [*recording.notes, *_describe_resampling(mapping, resampler)]
    notes += [*assembly.notes, *(sentence for _, sentence in irregularities)]
    return dataclasses.replace(record, notes=tuple(notes))


def build_resampler(mapping: MappingFile, recording: Recording) -> Resampler:
    """Find all channels and clean their timestamps; raise all faults."""
    names = resolve_topics(mapping.topics, recording)
    entries = [entry for entry in mapping.entries if entry.group != "time"]
    segment = rename_topic(mapping.segment or "", names)
    label_column = locate_column(segment, recording) if segment else None
    if segment and label_column is None:
        entries.append(Entry("segment", "segment", (Source(column=segment),)))
    is_table = all(not topic.name and topic.time is None for topic in recording.topics)
    if is_table and not any(it.rate or it.column == RECORDED_TIME for it in mapping.time):
        entries.insert(0, Entry("time", "time", mapping.time, "time"))
    columns, faults = find_columns(entries, recording, mapping.name, mapping.topics)
    columns = [column for column in columns if column.entry.group != "time"]
    streams, untimed = build_streams(columns, mapping.time, label_column)
    if faults := [*faults, *(() if is_table and faults else untimed)]:
        raise LogError([*faults, *(note for note in recording.notes if note.startswith(SKIPPED))])
    clock = mapping.clock.topic
    return Resampler(columns, streams, names.get(clock or "", clock), mapping.clock.rate)


def _describe_resampling(mapping: MappingFile, resampler: Resampler) -> Iterator[str]:
    """Yield notes on the reference clock and on constant channels."""
    base, rate = resampler.base.topic.name, mapping.clock.rate
    n_others = len({stream.topic.name for stream in resampler.streams} - {base})
    if rate is not None:
        yield f"resampled to {rate:g} Hz over the messages of `{base}`"
    elif n_others:
        yield f"{n_others} topic{'s' if n_others > 1 else ''} resampled to the clock of `{base}`"
    for channel, value in resampler.constants.items():
        name = channel.partition(".")[2]
        yield f"`{name}` was not recorded; the mapping sets it to the constant {value:g}"


class Assembly:
    """Columns of the canonical form, assembled from resampled channels."""

    def __init__(self, mapping: MappingFile, resampler: Resampler) -> None:
        self.mapping, self.resampler = mapping, resampler
        self.numbers: dict[str, FloatArray] = {"time": resampler.ticks.time}
        self.faults: list[str] = []
        self.notes: list[str] = []
        self._add_attitude()
        self._add_vectors()
        for block in (ACCELERATION, WRENCH, POSITION):
            axes = "FRD" if block is POSITION else mapping.frame
            self._add_components(block.name, block.columns, axes)
        if resampler.has("position.latitude"):
            self._add_geographic_position()
        for block in (POSITION, SPECIFIC_FORCE):
            if any(name in self.numbers for name in block.columns):  # missing components are zero
                self._set_columns(block.columns, self._stack_columns(block.columns))
        for name in SINGLE_CHANNELS:
            self._add_components(name, (name,), "FRD")
        for name in mapping.commands:
            if resampler.has(f"commands.{name}"):
                self.numbers[name] = resampler.number(f"commands.{name}", is_command=True)

    def _add_components(self, group: str, names: Sequence[str], axes: str) -> None:
        """Add the available components of a vector in body axes as columns."""
        for index, name in enumerate(names):
            if self.resampler.has(channel := f"{group}.{name}"):
                values = self.resampler.number(channel)
                # 0 - x instead of -x, so that zero does not become -0.0.
                self.numbers[name] = 0.0 - values if axes == "FLU" and index % 3 else values

    def _stack_columns(self, names: Sequence[str]) -> FloatArray:
        """Return columns as a matrix; missing ones are zero."""
        return stack_columns(self.numbers, names, self.resampler.n)

    def _set_columns(self, names: Sequence[str], columns: FloatArray) -> None:
        self.numbers |= dict(zip(names, columns.T, strict=True))

    def _sensor_rotation(self, group: str) -> FloatArray | None:
        """Return the quaternion from sensor axes to body axes; None for no rotation."""
        mounting = getattr(self.mapping.sensors, group).rotation
        sign = -1.0 if self.mapping.frame == "FLU" else 1.0
        angles = np.array([(mounting.roll, sign * mounting.pitch, sign * mounting.yaw)])
        return quaternion_from_euler(angles * unit_factor(mounting.unit)) if angles.any() else None

    def _add_attitude(self) -> None:
        names = [name for name in (*EULER, "heading") if self.resampler.has(f"attitude.{name}")]
        components = [name for name in ATTITUDE.columns if self.resampler.has(f"attitude.{name}")]
        self.faults += [
            f"`attitude.{name}` must be in rad; its values look like degrees. Set `unit: deg`"
            for name in names
            if is_in_degrees(name, self.resampler.raw(f"attitude.{name}"))
        ]
        if names and not self.faults:
            self._add_euler({"yaw" if name == "heading" else name: name for name in names})
        elif components and not names:
            self._add_quaternion([f"attitude.{name}" for name in components])

    def _add_euler(self, names: dict[str, str]) -> None:
        channels = {short: f"attitude.{name}" for short, name in names.items()}
        is_complete = set(names) == set(EULER)
        is_one_message = is_complete and self.resampler.share_clock([*channels.values()])
        sample = self.resampler.raw if is_one_message else self.resampler.angle
        angles = {short: self._in_ned(names[short], sample(channels[short])) for short in names}
        if is_complete:
            attitude = quaternion_from_euler(np.column_stack([angles[name] for name in EULER]))
            self._set_attitude(attitude, channels["yaw"] if is_one_message else "")
        else:
            self.numbers |= angles

    def _in_ned(self, name: str, angle: FloatArray) -> FloatArray:
        """Return an Euler angle relative to north-east-down."""
        if self.mapping.world == "NED" or name in ("roll", "heading"):
            return angle
        return math.pi / 2 - angle if name == "yaw" and self.mapping.world == "ENU" else -angle

    def _add_quaternion(self, channels: list[str]) -> None:
        if len(channels) < 4 or not self.resampler.share_clock(channels):
            self.faults.append(
                "a quaternion needs `qw qx qy qz` of one topic; got"
                f" `{' '.join(channel.partition('.')[2] for channel in channels)}`. Map all four"
                " from the same messages"
            )
            return
        recorded = np.column_stack([self.resampler.raw(channel) for channel in channels])
        if self.mapping.world != "NED":
            recorded *= (1.0, 1.0, -1.0, -1.0)
        if self.mapping.world == "ENU":
            recorded = quaternion_product(_ENU_TO_NED, recorded)
        self._set_attitude(recorded, channels[0])

    def _set_attitude(self, attitude: FloatArray, channel: str) -> None:
        """Add the attitude of a sensor; at the messages of a channel, or at the ticks if empty."""
        if (rotation_of_sensor := self._sensor_rotation("attitude")) is not None:
            attitude = quaternion_product(attitude, rotation_of_sensor * (1.0, -1.0, -1.0, -1.0))
        if channel:
            attitude = self.resampler.attitude(attitude, channel)
        self._set_columns(ATTITUDE.columns, attitude)

    def _attitude_at_ticks(self) -> FloatArray | None:
        """Return the attitude as quaternions; level if only yaw is known, None without yaw."""
        if ATTITUDE.columns[0] in self.numbers:
            return self._stack_columns(ATTITUDE.columns)
        return quaternion_from_euler(self._stack_columns(EULER)) if "yaw" in self.numbers else None

    def _add_vectors(self) -> None:
        sensors, frame = self.mapping.sensors, self.mapping.frame
        for sensor, group, names in _SENSOR_VECTORS:
            self._add_components(group, names, getattr(sensors, sensor).axes or frame)
            rotation = self._sensor_rotation(sensor)
            if rotation is not None and all(name in self.numbers for name in names):
                rotated = self._stack_columns(names) @ rotation_matrices(rotation)[0].T
                self._set_columns(names, rotated)
        if self.resampler.has("velocity.north") or self.resampler.has("velocity.course"):
            self._rotate_from_world()
        elif self.resampler.has("velocity.speed"):
            self.numbers["u"] = self.resampler.number("velocity.speed")
            self.notes.append("the speed along the path is used as u: sway is not separated")
        names_present = [name for name in _LINEAR if name in self.numbers]
        if any(sensors.velocity.position) and names_present:
            sign = _FLU_TO_FRD if frame == "FLU" else 1.0
            lever_arm, rates = (
                np.array(sensors.velocity.position) * sign,
                self._stack_columns(_ANGULAR),
            )
            corrected = self._stack_columns(_LINEAR) - np.cross(rates, lever_arm)
            self.numbers |= {name: corrected[:, _LINEAR.index(name)] for name in names_present}

    def _rotate_from_world(self) -> None:
        """Rotate velocities along north, east, down to body axes."""
        attitude = self._attitude_at_ticks()
        if attitude is None:
            if not self.faults:
                self.faults = ["a velocity along north and east needs a heading; map `attitude`"]
            return
        if self.resampler.has("velocity.course"):
            course = self.resampler.angle("velocity.course")
            speed = self.resampler.number("velocity.speed")
            components = [speed * np.cos(course), speed * np.sin(course)]
        else:
            components = [self.resampler.number(f"velocity.{name}") for name in ("north", "east")]
        if self.resampler.has("velocity.down"):
            components.append(self.resampler.number("velocity.down"))
        body = rotate_to_body(attitude, np.column_stack(components))
        self._set_columns(_LINEAR[: len(components)], body[:, : len(components)])

    def _add_geographic_position(self) -> None:
        """Add north and east of the first position."""
        angles = map(self.resampler.angle, COORDINATES)
        north, east, (latitude, longitude) = tangent_plane(*angles)
        self.numbers |= {"north": north, "east": east}
        self.notes.append(
            f"north and east count from latitude {latitude:.7f} and longitude {longitude:.7f} deg"
        )
