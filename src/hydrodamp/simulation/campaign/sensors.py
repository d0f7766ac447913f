"""The published sensor noise of the VT 690.

White, Gaussian, independent from sample to sample and channel to channel. The
variances are those of the vehicle's own simulation nodes (github
ECE-MDE/AUV-Fault-Detection, ``*_sim_node.config``):

=============  =====================  ======================
channel        variance               standard deviation
=============  =====================  ======================
u v w (DVL)    1.764e-4 (m/s)^2       0.0133 m/s
p q r (gyro)   7.615e-7 (rad/s)^2     8.7e-4 rad/s
attitude       5.898e-9 rad^2         7.7e-5 rad
depth          1e-3 m^2               0.0316 m
=============  =====================  ======================

There the DVL and the depth cell answer at 5 Hz; here everything answers at the
10 Hz of the log. The same noisy numbers reach the autopilot and the log.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray

CHANNELS = ("u", "v", "w", "p", "q", "r", "roll", "pitch", "yaw", "depth")
"""What is measured, in the order of the noise's last axis."""

VARIANCES = (1.764e-4,) * 3 + (7.615e-7,) * 3 + (5.898e-9,) * 3 + (1e-3,)
"""Noise variance of each channel [(m/s)^2, (rad/s)^2, rad^2, m^2]."""


def draw_noise(seed: int, n_runs: int, n_samples: int) -> FloatArray:
    """Return the errors of every sensor in every run.

    Each run has its own stream, spawned from the seed, so neither the number of
    runs nor their length changes the beginning of any of them.

    Parameters
    ----------
    seed : int
        Seed of the campaign, 0 or more.
    n_runs, n_samples : int
        How many runs and samples.

    Returns
    -------
    noise : ndarray, shape (n_samples, n_runs, 10)
        Errors in the order of `CHANNELS` [m/s, rad/s, rad, m].

    Examples
    --------
    >>> draw_noise(0, n_runs=6, n_samples=50).shape
    (50, 6, 10)
    """
    streams = np.random.SeedSequence(seed).spawn(n_runs)
    draws = [
        np.random.default_rng(stream).standard_normal((n_samples, len(CHANNELS)))
        for stream in streams
    ]
    noise: FloatArray = np.stack(draws, axis=1) * np.sqrt(VARIANCES)
    return noise
