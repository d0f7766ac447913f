"""Measurements of the sensors that a mapping lists, each at the times of its topic."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import KINDS, Measurement
from hydrodamp.ingest.mapping.resampling import Resampler
from hydrodamp.ingest.mapping.schema import MappingFile
from hydrodamp.ingest.mapping.sensor_schema import MeasuredSensor, sensor_group

_BODY_KINDS = ("velocity", "ground_velocity", "rates", "specific_force")
_FLU_TO_FRD = np.array([1.0, -1.0, -1.0])


def build_measurements(
    mapping: MappingFile, resampler: Resampler, log: Log
) -> tuple[Measurement, ...]:
    """Return the measurements of all sensors of a mapping."""
    return tuple(
        measurement
        for name, sensor in mapping.sensors.measured.items()
        for measurement in _measurements(name, sensor, mapping, resampler, log)
    )


def _measurements(
    name: str, sensor: MeasuredSensor, mapping: MappingFile, resampler: Resampler, log: Log
) -> Iterator[Measurement]:
    """Yield one measurement for each clock of a sensor, numbered if there are several."""
    group, known = sensor_group(name), KINDS[sensor.kind]
    is_flu = mapping.frame == "FLU" and sensor.kind in _BODY_KINDS
    streams = [
        (stream, [channel for channel in stream.channels if channel.startswith(f"{group}.")])
        for stream in resampler.streams
    ]
    streams = [(stream, channels) for stream, channels in streams if channels]
    for number, (stream, channels) in enumerate(streams, start=1):
        components = tuple(
            sorted((channel.partition(".")[2] for channel in channels), key=known.index)
        )
        signs = _FLU_TO_FRD[[known.index(each) for each in components]] if is_flu else 1.0
        values = np.column_stack([stream.values(f"{group}.{each}") for each in components]) * signs
        segment = _segments_of(stream.stamps.time, stream.stamps.run, resampler, log)
        rows = np.flatnonzero((segment >= 0) & np.isfinite(values).any(axis=1))
        if not len(rows):
            continue
        arm = np.array(sensor.lever_arm) * (_FLU_TO_FRD if mapping.frame == "FLU" else 1.0)
        yield Measurement(
            name if len(streams) == 1 else f"{name}-{number}",
            sensor.kind,
            stream.stamps.time[rows],
            values[rows],
            components,
            _standard_deviations(sensor, components),
            segment[rows],
            sensor.delay,
            arm,
            tuple(sensor.estimate),
        )


def _standard_deviations(sensor: MeasuredSensor, components: tuple[str, ...]) -> FloatArray | None:
    if sensor.std is None:
        return None
    if isinstance(sensor.std, dict):
        return np.array([sensor.std[name] for name in components])
    return np.full(len(components), sensor.std)


def _segments_of(time: FloatArray, run: IntArray, resampler: Resampler, log: Log) -> IntArray:
    """Return the segment of the log in which each time of a run of the clock lies, -1 for none."""
    segment = np.full(len(time), -1)
    ticks, first = resampler.ticks, 0
    for number, (start, stop) in enumerate(log.bounds.tolist()):
        first += int(np.argmax(ticks.time[first:] == log.time[start]))
        inside = (run == ticks.run[first]) & (time >= log.time[start])
        segment[inside & (time <= log.time[stop - 1])] = number
    return segment
