"""Coloured errors, pushes and accelerometers: what the studies sail with beside white noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.derivatives import GRAVITY
from hydrodamp.simulation.campaign.conditions import (
    COMMAND_PERIOD,
    SENSOR_CHANNELS,
    Conditions,
    sample_normal,
)
from hydrodamp.simulation.campaign.reenact import Campaign
from hydrodamp.simulation.closed_loop import stack_runs

SPECIFIC_FORCE_VARIANCE = 3.847e-6
"""Noise variance of each accelerometer of the attitude sensor [(m/s^2)^2], of the same source."""


@dataclass(frozen=True)
class Coloured(Conditions):
    """Errors with a memory, and a wrench that pushes the vehicle.

    ``correlation_times`` [s] are those of the sensors' errors, in the order of ``CHANNELS``, 0 for
    white; ``push`` the standard deviation of the wrench X Y Z [N], K M N [N m], ``push_time`` its
    correlation time [s]. The errors are the same whether something pushes or not.
    """

    correlation_times: tuple[float, ...] = (0.0,) * len(SENSOR_CHANNELS)
    push: tuple[float, ...] = (0.0,) * 6
    push_time: float = 2.0

    def push_times(self, level: float) -> Coloured:
        """Return conditions with pushes that are so many times as strong."""
        return replace(self, push=tuple(level * each for each in self.push))

    def sample_sensor_errors(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
    ) -> FloatArray:
        white = super().sample_sensor_errors(seed, n_runs, n_samples, period)
        return autoregression(white, self.correlation_times, period)

    def sample_disturbances(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
    ) -> FloatArray:
        normal = sample_normal(seed, n_runs, n_samples, 6, 0)
        return autoregression(normal, (self.push_time,) * 6, period) * self.push


def autoregression(
    normal: FloatArray, correlation_times: tuple[float, ...], period: float
) -> FloatArray:
    """Return stationary AR(1) series of the variance of the white ones they are made of."""
    series = np.empty_like(normal)
    for column, time in enumerate(correlation_times):
        kept = np.exp(-period / time) if time else 0.0
        fresh = normal[:, :, column] * np.sqrt(1.0 - kept**2)
        fresh[0] = normal[0, :, column]
        series[:, :, column] = lfilter([1.0], [1.0, -kept], fresh, axis=0)
    return series


COLOURED = Coloured(
    correlation_times=(0.4,) * 3 + (0.1,) * 3 + (0.5,) * 3 + (0.4,),
    push=(0.5, 0.55, 0.12, 0.0005, 0.08, 0.36),
)
"""Coloured errors of the published variances, and a wrench that pushes."""

SILENT = Conditions(scale=0.0)
"""No error, no push: what the autopilot does when it sees the truth."""


def training_pushes(campaign: Campaign, seed: int, conditions: Conditions) -> FloatArray:
    """Return the wrench that pushed the vehicle from each training sample to the next."""
    n_train, n_test = len(campaign.train.segments), len(campaign.test.segments)
    drawn = conditions.sample_disturbances(seed, n_train + n_test, campaign.train.n // n_train)
    return stack_runs(drawn[:, :n_train])


def accelerated(campaign: Campaign, seed: int, scale: float) -> Campaign:
    """Return a campaign whose attitude sensor's specific force is recorded, as in the paper."""
    n_train, n_test = len(campaign.train.segments), len(campaign.test.segments)
    normal = sample_normal(seed, n_train + n_test, campaign.train.n // n_train, 3, 1)
    errors = scale * float(np.sqrt(SPECIFIC_FORCE_VARIANCE)) * normal
    train = _felt(campaign.train, campaign.exact_train, stack_runs(errors[:, :n_train]))
    test = _felt(campaign.test, campaign.exact_test, stack_runs(errors[:, n_train:]))
    return replace(campaign, train=train, test=test)


def _felt(log: hd.Log, exact: hd.Log, errors: FloatArray) -> hd.Log:
    """Return a log with a specific force, and the acceleration that it tells."""
    assert exact.acceleration is not None
    felt = exact.acceleration[:, :3] + _turning(exact) + errors
    linear = felt - _turning(log)
    both = np.hstack([linear, np.full_like(linear, np.nan)])
    return replace(log, specific_force=felt, acceleration=both)


def _turning(log: hd.Log) -> FloatArray:
    """Return what a specific force holds beside the change of the velocity's components."""
    return np.cross(log.velocity[:, 3:], log.velocity[:, :3]) - GRAVITY * log.down
