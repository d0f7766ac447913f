"""Whether averages of the residuals of windows are at the level of the white sensor noise.

White noise of variance σ² gives averages of n residuals the variance σ²/n. Forces that a model
lacks, and coloured sensor errors, last longer than a sample: √n times such an average has a larger
variance. For a model in the truth the ratio of the variances has at most Fisher's F distribution,
because estimated parameters only reduce the residuals. σ² is that of the residuals' own third
differences: velocities have fast motion that is not noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import fdtri

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.velocity_smoother import white_noise_std
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.initial_iterate import MIN_RELATIVE_RESIDUAL

#: Probability of a false alarm for a model in the truth, over all outputs and window lengths.
FALSE_ALARMS = 0.01

#: Degrees of freedom of the white-noise variance over the number of residuals (simulated).
NOISE_FREEDOM = 0.22


class ResidualLevel(NamedTuple):
    """Standard deviation of averages of an output over that of white noise, and its bound."""

    output: str
    ratio: float
    bound: float

    @property
    def is_excessive(self) -> bool:
        """Whether the residuals are above white noise."""
        return self.ratio > self.bound

    def __str__(self) -> str:
        """Return both in a clause."""
        return (
            f"Averages of the residuals of {self.output} are {self.ratio:.3g} times the sensor "
            f"noise (white noise: at most {self.bound:.3g})"
        )


def highest_residual_level(
    objective: ShootingObjective, result: Iterate, outputs: Sequence[str]
) -> ResidualLevel:
    """Return the level furthest above its bound, over named outputs and window lengths."""
    noise, freedom = _white_noise(objective, result)
    confidence = 1.0 - FALSE_ALARMS / (len(noise) * len(result.linearisations))
    levels: list[tuple[str, float, float]] = []
    for windows, *_ in result.linearisations:
        square, count = windows.average_squares(result.coefficients, noise)
        bound = fdtri(np.maximum(count, 1.0), freedom, confidence)
        levels += zip(outputs, np.sqrt(square).tolist(), np.sqrt(bound).tolist(), strict=True)
    return max((ResidualLevel(*each) for each in levels), key=lambda each: each.ratio / each.bound)


def _white_noise(objective: ShootingObjective, result: Iterate) -> tuple[FloatArray, FloatArray]:
    """Return the white noise of each output, at least rounding, and its degrees of freedom."""
    windows, problem = result.linearisations[-1].windows, objective.problem
    columns = [
        (column, each.window)
        for each in windows.outputs.residuals(windows, result.coefficients)
        for column in each.residuals.T
    ]
    noise = np.array([white_noise_std(*each) for each in columns])
    if problem.sensor_log is None:
        spread = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
        noise = np.maximum(noise, MIN_RELATIVE_RESIDUAL * spread)
    sizes = np.array([len(column) for column, _ in columns])
    return noise, np.maximum(NOISE_FREEDOM * sizes, 1.0)
