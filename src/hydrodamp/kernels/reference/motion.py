"""The right-hand side of eq. 1: momentum, damping and known wrenches."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.kernels.arguments import coefficients
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.reference.atoms import atoms
from hydrodamp.kernels.reference.products import products


def coriolis(mass_matrix: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench H(M nu) nu of the moving frame.

    With p = M nu it is [p1 x w ; p1 x v + p2 x w]: eq. 1, second term. It does
    no work: nu . H(M nu) nu = 0.

    Parameters
    ----------
    mass_matrix : ndarray, shape (6, 6)
        Rigid body plus added mass, body frame.
    velocity : ndarray, shape (n, 6)
        u v w [m/s], p q r [rad/s], body frame.

    Returns
    -------
    wrench : ndarray, shape (n, 6)
        Force [N] and moment [N m], body frame, on the right-hand side.

    Examples
    --------
    >>> coriolis(np.eye(6), np.array([[1.0, 0, 0, 0, 0, 2.0]]))[0, :3]
    array([ 0., -2.,  0.])
    """
    nu = velocity.T
    p = momentum(mass_matrix, nu)
    force = cross(p[:3], nu[3:])
    moment = cross(p[:3], nu[:3]) + cross(p[3:], nu[3:])
    return np.ascontiguousarray(np.concatenate([force, moment]).T)


def momentum(mass_matrix: FloatArray, nu: FloatArray) -> FloatArray:
    """Return M nu, summed column by column so that a batch gives a sample's bits.

    Parameters
    ----------
    mass_matrix : ndarray, shape (6, 6)
        Rigid body plus added mass.
    nu : ndarray, shape (6,) or (6, n)
        Velocity, components first.

    Returns
    -------
    p : ndarray, shape of nu
        Momentum [kg m/s, kg m^2/s]. In the paper this is p.
    """
    columns = mass_matrix.T.reshape(6, 6, *[1] * (nu.ndim - 1))
    p: FloatArray = columns[0] * nu[0]
    for k in range(1, 6):
        p = p + columns[k] * nu[k]
    return p


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return a x b for components first; quicker than ``np.cross`` on one sample.

    Parameters
    ----------
    a, b : ndarray, shape (3,) or (3, n)
        Vectors.

    Returns
    -------
    product : ndarray, same shape
        Their vector product.
    """
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def wrench_of(
    plant: Plant,
    matrix: FloatArray,
    velocity: FloatArray,
    down: FloatArray,
    wrench: FloatArray,
    channels: FloatArray,
    propulsion_speed: float,
) -> FloatArray:
    """Return the whole right-hand side of eq. 1 on the free axes, zero on the locked ones.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients, one row a term.
    velocity, down, wrench, channels, propulsion_speed
        One sample; see :func:`acceleration`.

    Returns
    -------
    wrench : ndarray, shape (6,)
        Force [N] and moment [N m], body frame.
    """
    xi = products(plant.factors, atoms(velocity, down, channels, propulsion_speed))
    p = plant.mass_matrix @ velocity
    gyroscopic = np.concatenate(
        [cross(p[:3], velocity[3:]), cross(p[:3], velocity[:3]) + cross(p[3:], velocity[3:])]
    )
    total: FloatArray = np.where(plant.free, gyroscopic + xi @ matrix + wrench, 0.0)
    return total


def acceleration(
    plant: Plant,
    matrix: FloatArray,
    velocity: FloatArray,
    down: FloatArray,
    wrench: FloatArray,
    channels: FloatArray,
    propulsion_speed: float,
) -> FloatArray:
    """Return the body-frame acceleration of eq. 1 at one sample.

    M d(nu)/dt = H(M nu) nu + K xi + wrench, solved on the free axes; locked
    axes neither move nor accelerate.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    matrix : ndarray, shape (n_terms, 6)
        Coefficients, one row a term; the transpose of the paper's K.
    velocity : ndarray, shape (6,)
        u v w [m/s], p q r [rad/s], body frame; locked ones count as zero.
    down : ndarray, shape (3,)
        The world's down direction in the body frame.
    wrench : ndarray, shape (6,)
        Further force [N] and moment [N m], body frame.
    channels : ndarray, shape (m,)
        Command channels.
    propulsion_speed : float
        Surge speed u_c [m/s].

    Returns
    -------
    acceleration : ndarray, shape (6,)
        Derivative of the velocity [m/s^2, rad/s^2].

    Examples
    --------
    >>> drag = Plant(2.0 * np.eye(6), [True] * 6, [[1, 7, 0, 0]], 0)
    >>> surge, down = np.array([3.0, 0, 0, 0, 0, 0]), np.array([0.0, 0, 1])
    >>> matrix = np.array([[-4.0, 0, 0, 0, 0, 0]])
    >>> acceleration(drag, matrix, surge, down, np.zeros(6), np.zeros(0), 0.0)[0]
    np.float64(-18.0)
    """
    nu = np.where(plant.free, velocity, 0.0)
    table = coefficients(plant, matrix)
    total = wrench_of(plant, table, nu, down, wrench, channels, propulsion_speed)
    return np.asarray(np.linalg.solve(plant.effective_mass, total), dtype=np.float64)
