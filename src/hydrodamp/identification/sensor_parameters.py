"""Parameters of sensors that all windows share: biases, delays, lever arms and a current.

The prior standard deviation of a bias is the spread of its signal, that of a delay the correlation
time of the motion, that of a current the RMS speed, that of a lever arm speed over turn rate.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import IntArray
from hydrodamp.conditioning.sensor_log import Sensor, SensorLog
from hydrodamp.data.measurement import KIND_UNITS, KINDS
from hydrodamp.identification.parameters import Parameter


def assign_parameters(
    sensor_log: SensorLog,
) -> tuple[tuple[Parameter, ...], list[dict[str, IntArray]]]:
    """Return the parameters to estimate, and the indices of those of each sensor by name."""
    parameters: list[Parameter] = []
    current: IntArray | None = None
    indices: list[dict[str, IntArray]] = []
    for sensor in sensor_log.sensors:
        by_name: dict[str, IntArray] = {}
        for name in sensor.measurement.estimate:
            if name == "current" and current is not None:
                by_name[name] = current
                continue
            added = _parameters(name, sensor, sensor_log)
            by_name[name] = np.arange(len(parameters), len(parameters) + len(added))
            parameters += added
            current = by_name[name] if name == "current" else current
        indices.append(by_name)
    return tuple(parameters), indices


def _parameters(name: str, sensor: Sensor, sensor_log: SensorLog) -> list[Parameter]:
    """Return the parameters of a name, with priors from the data."""
    measurement, log = sensor.measurement, sensor_log.log
    speed, rate = (
        float(np.sqrt(np.mean(log.velocity[:, axes] ** 2))) for axes in (slice(3), slice(3, 6))
    )
    if name == "bias":
        spread = np.maximum(np.nanstd(measurement.values, axis=0), sensor.std)
        pairs = zip(measurement.components, spread.tolist(), strict=True)
        unit = KIND_UNITS[sensor.kind]
        return [
            Parameter(f"{measurement.name} bias {axis}", unit, "sensor", std) for axis, std in pairs
        ]
    if name == "delay":
        return [Parameter(f"{measurement.name} delay", "s", "sensor", log.time_scale)]
    if name == "current":
        return [Parameter(f"current {axis}", "m/s", "sensor", speed) for axis in KINDS["position"]]
    length = speed / rate if rate > 0.0 else 1.0
    return [
        Parameter(f"{measurement.name} lever arm {axis}", "m", "sensor", length) for axis in "xyz"
    ]
