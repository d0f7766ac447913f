"""Values of all atoms at given motions, and their derivatives."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.kernels.plant import FIXED_ATOMS

SLOWEST = 1e-6
"""Speed [m/s] below which the propulsion ratio divides by this number."""


def atoms(
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray | float,
) -> FloatArray:
    """Return every atom at one sample or at n of them, atoms first.

    Parameters
    ----------
    velocity : ndarray, shape (6,) or (n, 6)
        u v w [m/s], p q r [rad/s], body frame. In the paper this is nu.
    down : ndarray, shape (3,) or (n, 3)
        The world's down direction in the body frame.
    channels : ndarray, shape (m,) or (n, m)
        Command channels.
    propulsion_speed : float or ndarray, shape (n,)
        Surge speed u_c of the present propeller speed [m/s].

    Returns
    -------
    table : ndarray, shape (21 + 2 m,) or (21 + 2 m, n)
        In the order that :class:`hydrodamp.kernels.plant.Plant` lists.

    Examples
    --------
    >>> still = np.zeros(6)
    >>> atoms(still, np.array([0.0, 0.0, 1.0]), np.zeros(0), 0.0)[20]
    np.float64(1.0)
    """
    nu, held = velocity.T, channels.T
    m = len(held)
    table = np.empty((FIXED_ATOMS + 2 * m, *nu.shape[1:]))
    speed = np.sqrt(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2])
    crossflow = np.sqrt(nu[1] * nu[1] + nu[2] * nu[2])
    table[0] = 1.0
    table[1:7] = nu
    table[7:13] = np.abs(nu)
    table[13] = speed
    table[14] = crossflow
    table[15] = np.sign(nu[1]) * crossflow
    table[16] = np.sign(nu[2]) * crossflow
    table[17] = propulsion_speed / np.maximum(speed, SLOWEST) - 1.0
    table[18:21] = down.T
    table[21 : 21 + m] = held
    table[21 + m :] = np.abs(held)
    return table


def atom_slopes(velocity: FloatArray, propulsion_speed: float, n_channels: int) -> FloatArray:
    """Return the derivative of every atom on the velocity at one sample.

    At a kink (a zero velocity, U = 0 or V = 0) the derivative is taken as 0.
    The down vector and the channels do not depend on the velocity.

    Parameters
    ----------
    velocity : ndarray, shape (6,)
        u v w [m/s], p q r [rad/s], body frame.
    propulsion_speed : float
        Surge speed u_c of the present propeller speed [m/s].
    n_channels : int
        How many channels follow the fixed atoms.

    Returns
    -------
    slopes : ndarray, shape (21 + 2 m, 6)
        Rows are atoms, columns velocities.
    """
    slopes = np.zeros((FIXED_ATOMS + 2 * n_channels, 6))
    sign = np.sign(velocity)
    speed = float(np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2))
    crossflow = float(np.sqrt(velocity[1] ** 2 + velocity[2] ** 2))
    slopes[1:7] = np.eye(6)
    slopes[7:13] = np.diag(sign)
    if speed > 0.0:
        slopes[13, :3] = velocity[:3] / speed
    if crossflow > 0.0:
        slopes[14, 1:3] = velocity[1:3] / crossflow
    slopes[15] = sign[1] * slopes[14]
    slopes[16] = sign[2] * slopes[14]
    if speed > SLOWEST:
        slopes[17] = -propulsion_speed / speed**2 * slopes[13]
    return slopes
