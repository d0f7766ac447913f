"""The published autopilot of the VT 690: three PID loops at 10 Hz.

Depth gives the pitch wanted, pitch the elevator, heading the rudder. Gains and
limits are those of the vehicle's own configuration (github
ECE-MDE/AUV-Fault-Detection), radians and metres:

=======  ======  ======  ======  ==================  ==================
loop     P       I       D       limit of I term     limit of output
=======  ======  ======  ======  ==================  ==================
depth    -0.07   -0.001  0.095   5 deg               20 deg
pitch    4.5     0.2     7.0     5 deg               20 deg
yaw      3.0     0.005   3.0     5 deg               20 deg
=======  ======  ======  ======  ==================  ==================

Every loop is ``P error + I integral - D rate``: the derivative acts on the
measured rate, never on the reference, and the integral stands still while its
term or the output is at a limit. The rates are q, r and, for depth, the mean
over the last 5 s of the measured depth's differences: with the published signs
that last D leads a little where one would expect it to damp, to little effect.

There a positive rudder turns to starboard; here, as in the fleet, to port
(positive rudder, negative N), so the yaw loop's output changes its sign. The
fin mixing that makes up for roll is left out: the roll stays below 6 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray

PERIOD = 0.1
"""Time between two commands, held in between [s]."""


@dataclass(frozen=True)
class Pid:
    """One loop, for any number of vehicles side by side.

    Attributes
    ----------
    proportional, integral, derivative : float
        Gains on the error, its integral and the measured rate.
    integral_limit, output_limit : float
        Largest integral term and output, either sign [rad].
    """

    proportional: float
    integral: float
    derivative: float
    integral_limit: float = float(np.radians(5.0))
    output_limit: float = float(np.radians(20.0))

    def step(
        self, error: FloatArray, rate: FloatArray, total: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the output and the integral of the error after this sample.

        Parameters
        ----------
        error : ndarray, shape (n,)
            Reference less measurement [rad or m].
        rate : ndarray, shape (n,)
            Measured rate of the same quantity [rad/s or m/s].
        total : ndarray, shape (n,)
            Integral of the error so far [rad s or m s].

        Returns
        -------
        output : ndarray, shape (n,)
            Within the output limit [rad].
        total : ndarray, shape (n,)
            The new integral; unchanged where a limit was met.

        Examples
        --------
        >>> output, total = Pid(3.0, 0.0, 3.0).step(np.array([0.1]), np.array([0.05]), np.zeros(1))
        >>> output.round(3), total
        (array([0.15]), array([0.01]))
        """
        grown = total + error * PERIOD
        term = self.integral * grown
        held = np.clip(term, -self.integral_limit, self.integral_limit)
        wanted = self.proportional * error + held - self.derivative * rate
        output = np.clip(wanted, -self.output_limit, self.output_limit)
        free = (term == held) & (wanted == output)
        return output, np.where(free, grown, total)


DEPTH_LOOP = Pid(-0.07, -0.001, 0.095)
"""From the error of depth [m] to the pitch wanted [rad]."""

PITCH_LOOP = Pid(4.5, 0.2, 7.0)
"""From the error of pitch [rad] to the elevator [rad]."""

YAW_LOOP = Pid(3.0, 0.005, 3.0)
"""From the error of heading [rad] to the opposite of the rudder [rad]."""

N_DEPTHS = 51
"""How many depths the depth rate is taken from: 50 differences, 5 s."""


@dataclass(frozen=True)
class Memory:
    """What the autopilot keeps from one sample to the next.

    Attributes
    ----------
    totals : ndarray, shape (3, n)
        Integrals of the errors of depth [m s], pitch and heading [rad s].
    depths : ndarray, shape (k, n)
        The last measured depths, at most 51, the newest last [m].
    """

    totals: FloatArray
    depths: FloatArray

    @classmethod
    def blank(cls, n_vehicles: int) -> Memory:
        """Return the memory before the first sample.

        Parameters
        ----------
        n_vehicles : int
            How many vehicles are steered side by side.

        Returns
        -------
        memory : Memory
            Nothing integrated, no depth seen.
        """
        return cls(np.zeros((3, n_vehicles)), np.empty((0, n_vehicles)))

    @property
    def depth_rate(self) -> FloatArray:
        """Mean rate of the depths remembered, shape (n,) [m/s]."""
        spans = max(len(self.depths) - 1, 1)
        rate: FloatArray = (self.depths[-1] - self.depths[0]) / (spans * PERIOD)
        return rate


def steer(
    measured: FloatArray, heading: FloatArray, depth: FloatArray, memory: Memory
) -> tuple[FloatArray, Memory]:
    """Return the fin commands for one sample.

    Parameters
    ----------
    measured : ndarray, shape (n, 10)
        Measured u v w [m/s], p q r [rad/s], roll pitch yaw [rad], depth [m].
    heading : ndarray, shape (n,)
        Wanted heading [rad]; counts on through full turns, like the yaw.
    depth : ndarray, shape (n,)
        Wanted depth [m].
    memory : Memory
        Of the sample before.

    Returns
    -------
    commands : ndarray, shape (n, 2)
        Rudder and elevator, within 20 degrees [rad].
    memory : Memory
        For the sample to come.
    """
    (q, r), (pitch, yaw), sunk = measured[:, 4:6].T, measured[:, 7:9].T, measured[:, 9]
    depths = np.concatenate((memory.depths, sunk[np.newaxis]))[-N_DEPTHS:]
    rate = Memory(memory.totals, depths).depth_rate
    wanted, sinking = DEPTH_LOOP.step(depth - sunk, rate, memory.totals[0])
    elevator, pitching = PITCH_LOOP.step(wanted - pitch, q, memory.totals[1])
    starboard, turning = YAW_LOOP.step(heading - yaw, r, memory.totals[2])
    totals = np.array((sinking, pitching, turning))
    return np.array((-starboard, elevator)).T, Memory(totals, depths)
