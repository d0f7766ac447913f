"""Drag of the crossflow, strip by strip along the hull.

A strip at ``x`` meets the crossflow ``v + x r`` (sideways) and ``w - x q``
(downwards) and answers with a force against it::

    dY = -c_y(x) (v + x r)|v + x r| dx        dN =  x dY
    dZ = -c_z(x) (w - x q)|w - x q| dx        dM = -x dZ

``c`` is a uniform hull from ``-L/2`` to ``L/2`` in 40 equal strips, and the tail
fins as one more strip at ``x_f``. Two numbers a plane follow from the published
set, so that drift without turning gives the published force and moment:

=========================  ==============================  =======================
what                       sideways                        downwards
=========================  ==============================  =======================
``L``                      2.194 m                         2.194 m
``x_f = N_u|u|d/Y_u|u|d``  -1.0121 m                       -1.0121 m
sum of all strips          -Y_v|v| = 171.825               -Z_w|w| = 72.497
first moment               -N_v|v| = -34.1192              M_w|w| = -3.68259
fins = moment / x_f        33.711 kg/m                     3.639 kg/m
hull = sum - fins          138.114 kg/m                    68.858 kg/m
=========================  ==============================  =======================

That is a drag coefficient of 0.72 and 0.36 on the hull's diameter of 0.1753 m in
water of 1000 kg/m^3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen

HULL_LENGTH = 2.194
"""Length of the hull ``L``, centred on the origin [m]."""

N_STRIPS = 40
"""How many equal strips the hull is cut into."""


@dataclass(frozen=True)
class Strips:
    """Strips along the hull: how they meet the crossflow and how much they resist.

    Attributes
    ----------
    arms : ndarray, shape (6, n_strips)
        The crossflow at each strip per velocity: ``(0, 1, 0, 0, 0, x)`` sideways,
        ``(0, 0, 1, 0, -x, 0)`` downwards. The same arms carry its force home.
    drag : ndarray, shape (n_strips,)
        Force per squared crossflow, ``c dx`` [N/(m/s)^2].
    """

    arms: FloatArray
    drag: FloatArray

    @classmethod
    def calibrated(
        cls, totals: tuple[float, float], moments: tuple[float, float], fins_at: float
    ) -> Strips:
        """Return a uniform hull and tail fins with the sums asked for.

        Parameters
        ----------
        totals : tuple of float
            Sum of the drag of all strips, sideways and downwards [N/(m/s)^2].
        moments : tuple of float
            Sum of place times drag, likewise [N m/(m/s)^2].
        fins_at : float
            Position of the tail fins [m].

        Returns
        -------
        strips : Strips
            Sideways from the tail to the nose, then the fins; downwards likewise.

        Examples
        --------
        >>> strips = Strips.calibrated((171.825, 72.497), (-34.1192, -3.68259), -1.0121)
        >>> strips.drag.reshape(2, -1)[:, -1].round(3)
        array([33.711,  3.639])
        """
        edges = np.linspace(-HULL_LENGTH / 2, HULL_LENGTH / 2, N_STRIPS + 1)
        place = np.append((edges[:-1] + edges[1:]) / 2, fins_at)
        fins = np.array(moments) / fins_at
        hull = (np.array(totals) - fins) / N_STRIPS
        drag = np.column_stack((np.repeat(hull[:, np.newaxis], N_STRIPS, axis=1), fins))
        return cls(frozen(_arms(place)), frozen(drag.ravel()))

    def wrench(self, velocity: FloatArray) -> FloatArray:
        """Return the drag of all strips, about the origin.

        Parameters
        ----------
        velocity : ndarray, shape (n, 6)
            Body velocity [m/s, rad/s].

        Returns
        -------
        wrench : ndarray, shape (n, 6)
            Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand
            side: it never drives the vehicle. X and K are zero.
        """
        crossflow = velocity @ self.arms
        wrench: FloatArray = (-self.drag * crossflow * np.abs(crossflow)) @ self.arms.T
        return wrench


def _arms(place: FloatArray) -> FloatArray:
    none, one = np.zeros_like(place), np.ones_like(place)
    sideways = np.array((none, one, none, none, none, place))
    downwards = np.array((none, none, one, none, -place, none))
    return np.hstack((sideways, downwards))
