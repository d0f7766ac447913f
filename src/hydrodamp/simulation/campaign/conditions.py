"""Errors of the sensors and pushes on the vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import PERIOD

CHANNELS = ("u", "v", "w", "p", "q", "r", "roll", "pitch", "yaw", "depth")
"""What is measured, in the order of the noise's last axis."""

VARIANCES = (1.764e-4,) * 3 + (7.615e-7,) * 3 + (5.898e-9,) * 3 + (1e-3,)
"""Noise variance of each channel [(m/s)^2, (rad/s)^2, rad^2, m^2]."""

SPECIFIC_FORCE_VARIANCE = 3.847e-6
"""Noise variance of each accelerometer of the attitude sensor [(m/s^2)^2], of the same source."""


@dataclass(frozen=True)
class Conditions:
    """How strong the errors and the pushes are, and for how long they last.

    Every run has its own streams, spawned from the seed, so neither the number of runs
    nor their length changes the beginning of any of them, and the errors are the same
    whether something pushes or not.

    Attributes
    ----------
    scale : float
        Standard deviation of the sensors' errors, in published ones; 0 for none.
    correlation_times : tuple of 10 floats
        Of the sensors' errors, in the order of ``sensors.CHANNELS`` [s]; 0 is white.
    push : tuple of 6 floats
        Standard deviation of the wrench that pushes the vehicle: force X Y Z [N] and
        moment K M N [N m], body frame.
    push_time : float
        Correlation time of that wrench [s].
    accelerometer : bool
        Whether the attitude sensor's specific force is recorded, and from it the
        translational acceleration, as in the paper; other noise stays the same.
    """

    scale: float = 1.0
    correlation_times: tuple[float, ...] = (0.0,) * len(CHANNELS)
    push: tuple[float, ...] = (0.0,) * 6
    push_time: float = 2.0
    accelerometer: bool = False

    def draw_errors(
        self, seed: int, n_runs: int, n_samples: int, period: float = PERIOD
    ) -> FloatArray:
        """Return the errors of every sensor in every run.

        Parameters
        ----------
        seed : int
            Seed of the campaign, 0 or more.
        n_runs, n_samples : int
            How many runs and samples.
        period : float, optional
            Time from one sample to the next [s].

        Returns
        -------
        errors : ndarray, shape (n_samples, n_runs, 10)
            In the order of ``sensors.CHANNELS`` [m/s, rad/s, rad, m].

        Examples
        --------
        >>> WHITE.draw_errors(0, n_runs=6, n_samples=50).shape
        (50, 6, 10)
        """
        normal = _draw(seed, n_runs, n_samples, len(CHANNELS))
        deviations = self.scale * np.sqrt(VARIANCES)
        return autoregression(normal, self.correlation_times, period) * deviations

    def draw_pushes(
        self, seed: int, n_runs: int, n_samples: int, period: float = PERIOD
    ) -> FloatArray:
        """Return the wrench that pushes the vehicle in every run.

        Parameters
        ----------
        seed : int
            Seed of the campaign, 0 or more.
        n_runs, n_samples : int
            How many runs and samples.
        period : float, optional
            Time from one sample to the next [s].

        Returns
        -------
        pushes : ndarray, shape (n_samples, n_runs, 6)
            Force X Y Z [N] and moment K M N [N m] on the vehicle, body frame, each
            held until the next sample.

        Examples
        --------
        >>> WHITE.draw_pushes(0, n_runs=6, n_samples=50).any()
        np.False_
        """
        normal = _draw(seed, n_runs, n_samples, 6, 0)
        return autoregression(normal, (self.push_time,) * 6, period) * self.push

    def draw_specific_force_errors(self, seed: int, n_runs: int, n_samples: int) -> FloatArray:
        """Return the errors of the accelerometers, white, shape (n_samples, n_runs, 3) [m/s^2]."""
        deviation = self.scale * float(np.sqrt(SPECIFIC_FORCE_VARIANCE))
        return _draw(seed, n_runs, n_samples, 3, 1) * deviation


def _draw(seed: int, n_runs: int, n_samples: int, n_columns: int, *stream: int) -> FloatArray:
    """Return normal numbers of a stream of each run, shape (n_samples, n_runs, n_columns)."""
    keys = [np.random.SeedSequence(seed, spawn_key=(run, *stream)) for run in range(n_runs)]
    draws = [np.random.default_rng(one).standard_normal((n_samples, n_columns)) for one in keys]
    return np.stack(draws, axis=1)


def autoregression(
    normal: FloatArray, correlation_times: tuple[float, ...], period: float
) -> FloatArray:
    """Return stationary AR(1) series of unit variance."""
    series = np.empty_like(normal)
    for column, time in enumerate(correlation_times):
        kept = np.exp(-period / time) if time else 0.0
        fresh = normal[:, :, column] * np.sqrt(1.0 - kept**2)
        fresh[0] = normal[0, :, column]
        series[:, :, column] = lfilter([1.0], [1.0, -kept], fresh, axis=0)
    return series


WHITE = Conditions()
"""The published noise; nothing pushes the vehicle."""

COLOURED = Conditions(
    correlation_times=(0.4,) * 3 + (0.1,) * 3 + (0.5,) * 3 + (0.4,),
    push=(0.5, 0.55, 0.12, 0.0005, 0.08, 0.36),
)
"""Coloured errors of the published variances, and a wrench that pushes."""

SILENT = Conditions(scale=0.0)
"""No error, no push: what the autopilot does when it sees the truth."""
