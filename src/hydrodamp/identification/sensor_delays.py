"""Delays of sensors that their description does not state, by one Gauss-Newton step.

The delay d of a sensor shifts its output to y(t − d). From d = 0 and the coefficients of a fit, one
step with all coefficients, initial states and delays free estimates the delays; their errors are
those of a delete-one-block jackknife. A lag of the actuators delays all sensors by the same time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import factorisation
from hydrodamp.identification.fit import MIN_BLOCKS, critical_value, jackknife
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective, newton_step
from hydrodamp.identification.held_out_replay import leave_one_out, split_pieces
from hydrodamp.identification.sensor_outputs import RECORDED, SensorOutputs

#: Standard errors that a delay must exceed, and share of the interval of the sensor.
MIN_SIGNIFICANCE, RESOLUTION = 3.0, 0.25


class Delay(NamedTuple):
    """Estimated delay [s] of a sensor beyond the stated one, with its standard error."""

    sensor: str
    value: float
    standard_error: float
    stated: float

    def __str__(self) -> str:
        """Return the delay with the keys that account for it."""
        half = critical_value() * self.standard_error
        return (
            f"{self.sensor} {self.value:.2g} ± {half:.2g} s (`delay: "
            f"{self.stated + self.value:.2g}` or `estimate: [delay]` in the mapping)"
        )


@factorisation("normal matrix of the delays")
def significant_delays(objective: ShootingObjective, result: Iterate) -> tuple[Delay, ...]:
    """Return the delays beyond their standard errors and the resolution of the sensors."""
    outputs, sensors = objective.outputs, objective.problem.sensor_log
    finite = [each for each in result.linearisations if np.isfinite(each.windows.length)]
    pieces = split_pieces(objective.problem)
    if sensors is None or not isinstance(outputs, SensorOutputs) or len(pieces) < MIN_BLOCKS:
        return ()
    n, names = len(objective.scale) - objective.n_coefficients, list[str]()
    chosen = []
    for each in outputs.outputs:
        if each.name != RECORDED and "delay" not in each.parameters:
            index = {**each.parameters, "delay": np.array([n + len(names)])}
            chosen.append(replace(each, parameters=index))
            names.append(each.name)
        else:
            chosen.append(each)
    k, delayed = len(names), replace(outputs, outputs=tuple(chosen))
    if not k or not finite:
        return ()
    scale = np.concatenate([objective.scale, np.full(k, sensors.log.time_scale)])
    objective = replace(objective, outputs=delayed, scale=scale)
    last = finite[-1]._replace(windows=replace(finite[-1].windows, outputs=delayed))
    coefficients = np.concatenate([result.coefficients, np.zeros(k)])
    start = objective.move(replace(result, linearisations=(last,)), coefficients)
    values = newton_step(objective, start)[-k:]
    replicates = leave_one_out(objective, start, pieces)[:, -k:]
    errors = jackknife(replicates, objective.problem.duration).standard_errors
    known = {each.measurement.name: each.measurement for each in sensors.sensors}
    steps = [RESOLUTION / known[name].rate for name in names]
    limits = np.maximum(MIN_SIGNIFICANCE * errors, np.maximum(steps, 1.0 / sensors.log.sample_rate))
    return tuple(
        Delay(name, value, error, known[name].delay)
        for name, value, error, limit in zip(
            names, values.tolist(), errors.tolist(), limits.tolist(), strict=True
        )
        if abs(value) > limit
    )
