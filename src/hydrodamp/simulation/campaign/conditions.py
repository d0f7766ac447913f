"""What troubles the campaign: errors of the sensors, and pushes on the vehicle.

In ``SILENT`` conditions there is nothing of the kind. In ``WHITE`` ones the errors
are as published (see ``sensors``) and nothing pushes the vehicle. ``COLOURED`` ones are
nearer to the field: the errors have the same variances, but are autoregressions of
first order, AR(1), and a wrench of the same kind pushes the vehicle:

===================  ================  ==========================================
what                 correlation time  standard deviation
===================  ================  ==========================================
u v w (DVL)          0.4 s             as published, 0.0133 m/s
p q r (gyro)         0.1 s             as published, 8.7e-4 rad/s
attitude             0.5 s             as published, 7.7e-5 rad
depth                0.4 s             as published, 0.0316 m
wrench X Y Z         2 s               0.5, 0.55, 0.12 N
wrench K M N         2 s               0.0005, 0.08, 0.36 N m
===================  ================  ==========================================

The wrench is 3 % of the root mean square of the vehicle's true damping wrench over
the training runs of the ``sname`` truth, axis by axis: 16.8, 18.5, 3.8 N and 0.016,
2.6, 12.0 N m. The correlation times and the 3 % are assumptions. The wrench is held
over each tenth of a second, as commands are; no estimator is told of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import PERIOD
from hydrodamp.simulation.campaign.sensors import CHANNELS, VARIANCES


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
    """

    scale: float = 1.0
    correlation_times: tuple[float, ...] = (0.0,) * len(CHANNELS)
    push: tuple[float, ...] = (0.0,) * 6
    push_time: float = 2.0

    def draw_errors(self, seed: int, n_runs: int, n_samples: int) -> FloatArray:
        """Return the errors of every sensor in every run.

        Parameters
        ----------
        seed : int
            Seed of the campaign, 0 or more.
        n_runs, n_samples : int
            How many runs and samples.

        Returns
        -------
        errors : ndarray, shape (n_samples, n_runs, 10)
            In the order of ``sensors.CHANNELS`` [m/s, rad/s, rad, m].

        Examples
        --------
        >>> WHITE.draw_errors(0, n_runs=6, n_samples=50).shape
        (50, 6, 10)
        """
        streams = np.random.SeedSequence(seed).spawn(n_runs)
        normal = _draw(streams, n_samples, len(CHANNELS))
        deviations = self.scale * np.sqrt(VARIANCES)
        errors: FloatArray = autoregression(normal, self.correlation_times) * deviations
        return errors

    def draw_pushes(self, seed: int, n_runs: int, n_samples: int) -> FloatArray:
        """Return the wrench that pushes the vehicle in every run.

        Parameters
        ----------
        seed : int
            Seed of the campaign, 0 or more.
        n_runs, n_samples : int
            How many runs and samples.

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
        streams = [run.spawn(1)[0] for run in np.random.SeedSequence(seed).spawn(n_runs)]
        normal = _draw(streams, n_samples, 6)
        pushes: FloatArray = autoregression(normal, (self.push_time,) * 6) * self.push
        return pushes


def _draw(streams: list[np.random.SeedSequence], n_samples: int, n_columns: int) -> FloatArray:
    draws = [np.random.default_rng(one).standard_normal((n_samples, n_columns)) for one in streams]
    return np.stack(draws, axis=1)


def autoregression(normal: FloatArray, correlation_times: tuple[float, ...]) -> FloatArray:
    """Return stationary AR(1) series of unit variance, ten samples a second.

    Parameters
    ----------
    normal : ndarray, shape (n_samples, n_runs, n_columns)
        Independent standard normal numbers.
    correlation_times : tuple of n_columns floats
        When the correlation has fallen to 1/e [s]; 0 leaves a column as it is.

    Returns
    -------
    series : ndarray, shape (n_samples, n_runs, n_columns)
        ``x_k = a x_(k-1) + sqrt(1 - a^2) e_k`` with ``a = exp(-0.1 s / time)``.

    Examples
    --------
    >>> autoregression(np.ones((3, 1, 1)), (0.2,)).ravel().round(3)
    array([1.   , 1.402, 1.645])
    """
    series = np.empty_like(normal)
    for column, time in enumerate(correlation_times):
        kept = np.exp(-PERIOD / time) if time else 0.0
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
