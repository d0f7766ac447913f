"""Errors of the sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import COMMAND_PERIOD

SENSOR_CHANNELS = ("u", "v", "w", "p", "q", "r", "roll", "pitch", "yaw", "depth")
"""What is measured, in the order of the noise's last axis."""

SENSOR_VARIANCES = (1.764e-4,) * 3 + (7.615e-7,) * 3 + (5.898e-9,) * 3 + (1e-3,)
"""Noise variance of each channel [(m/s)^2, (rad/s)^2, rad^2, m^2]."""


@dataclass(frozen=True)
class Conditions:
    """White errors of the sensors, and nothing that pushes the vehicle.

    Every run has its own streams, spawned from the seed, so neither the number of runs
    nor their length changes the beginning of any of them.

    Attributes
    ----------
    scale : float
        Standard deviation of the sensors' errors, in published ones; 0 for none.
    """

    scale: float = 1.0

    def sample_sensor_errors(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
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
            In the order of ``CHANNELS`` [m/s, rad/s, rad, m].

        Examples
        --------
        >>> WHITE_NOISE.sample_sensor_errors(0, n_runs=6, n_samples=50).shape
        (50, 6, 10)
        """
        return sample_normal(seed, n_runs, n_samples, len(SENSOR_CHANNELS)) * (
            self.scale * np.sqrt(SENSOR_VARIANCES)
        )

    def sample_disturbances(
        self, seed: int, n_runs: int, n_samples: int, period: float = COMMAND_PERIOD
    ) -> FloatArray:
        """Return the wrench that pushes the vehicle in every run, shape (n_samples, n_runs, 6)."""
        return np.zeros((n_samples, n_runs, 6))


def sample_normal(
    seed: int, n_runs: int, n_samples: int, n_columns: int, *stream: int
) -> FloatArray:
    """Return normal numbers of a stream of each run, shape (n_samples, n_runs, n_columns)."""
    keys = [np.random.SeedSequence(seed, spawn_key=(run, *stream)) for run in range(n_runs)]
    draws = [np.random.default_rng(one).standard_normal((n_samples, n_columns)) for one in keys]
    return np.stack(draws, axis=1)


WHITE_NOISE = Conditions()
"""The published noise; nothing pushes the vehicle."""
