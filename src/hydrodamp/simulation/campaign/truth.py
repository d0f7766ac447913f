"""What the water does to the simulated VT 690: two truths.

``sname``
    The published hydrodynamics of the VT 690 (SNAME T&R Bulletin 1-45, 2022; which
    numbers, :mod:`~hydrodamp.simulation.campaign.water` says)::

        X = X_u|u| u|u| + X_vr vr + X_wq wq + X_q^2 q^2 + X_r^2 r^2
        Y = Y_uv uv + Y_v|v| v|v| + Y_ur ur + Y_r|r| r|r|
        Z = Z_uw uw + Z_w|w| w|w| + Z_uq uq + Z_q|q| q|q|
        K = K_up up + K_p|p| p|p|
        M = M_uw uw + M_w|w| w|w| + M_uq uq + M_q|q| q|q|
        N = N_uv uv + N_v|v| v|v| + N_ur ur + N_r|r| r|r|

    That is Prestero's terms plus ``K_up``: none of the paper's eight models to
    the letter, but it favours Prestero's.

``crossflow``
    Farther from all eight. The terms ``v|v| r|r| w|w| q|q|`` give way to the drag
    of the crossflow strip by strip (:mod:`~hydrodamp.simulation.campaign.crossflow`
    has its constants). The fins meet the drift: a rudder angle acts as
    ``rudder - 0.178 atan2(-v, u)``, as published. The fins are alike, so the whole
    may be turned by 90 degrees about x (``v -> w``, ``r -> -q``, ``Y -> Z``,
    ``N -> -M``; a rudder becomes an elevator, sign and all): an elevator angle
    acts as ``elevator - 0.178 atan2(-w, u)``. The fins follow their commands with
    a first-order lag of 0.05 s, an assumption. The estimators know none of this.

Both are the viscous remainder: ``H(M nu) nu`` with the full M stands apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.simulation.campaign.crossflow import Strips

DRIFT_FACTOR = 0.178
"""Share of the drift angle that the fins see; published for the rudder."""

FIN_LAG = 0.05
"""Time constant of the fins of the crossflow truth [s]; assumed."""

CROSSFLOW_DRAG = (
    *("Y_v|v|", "Y_r|r|", "N_v|v|", "N_r|r|"),
    *("Z_w|w|", "Z_q|q|", "M_w|w|", "M_q|q|"),
)
"""Labels that the strips replace."""

SNAME_NOTE = (
    "The published hydrodynamics of the VT 690 (SNAME T&R Bulletin 1-45, 2022; heave and "
    "pitch from the same laboratory's own simulation): Prestero's terms plus K_up, none of "
    "the eight models to the letter, but nearest to Prestero's."
)

CROSSFLOW_NOTE = (
    "The published hydrodynamics of the VT 690 with crossflow drag strip by strip in "
    "place of v|v| r|r| w|w| q|q|, fins that meet the drift, and fin lag: unlike any "
    "of the paper's models."
)


@dataclass(frozen=True)
class Truth:
    """The hydrodynamics that the estimators are to find.

    Attributes
    ----------
    name : str
        ``"sname"`` or ``"crossflow"``.
    note : str
        What it is, in a sentence.
    products : ndarray, shape (36, 6)
        Wrench per product of two velocities; the j-th and k-th in row 6 j + k.
    quadratic : ndarray, shape (6, 6)
        Wrench per velocity times its own size, a row a velocity.
    strips : Strips or None
        Crossflow strips, where they replace quadratic terms.
    drift_factor : float
        Share of the drift angle that the fins see.
    fin_lag : float
        Time constant of the fins [s]; 0 means that they follow at once.
    """

    name: str
    note: str
    products: FloatArray
    quadratic: FloatArray
    strips: Strips | None = None
    drift_factor: float = 0.0
    fin_lag: float = 0.0

    def hull_wrench(self, velocity: FloatArray) -> FloatArray:
        """Return the viscous wrench of the hull, fins and propeller apart.

        Parameters
        ----------
        velocity : ndarray, shape (n, 6)
            Body velocity [m/s, rad/s].

        Returns
        -------
        wrench : ndarray, shape (n, 6)
            Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand
            side: dissipative where its product with the velocity is negative.
        """
        pairs = (velocity[:, :, np.newaxis] * velocity[:, np.newaxis, :]).reshape(-1, 36)
        wrench: FloatArray = pairs @ self.products
        wrench += (velocity * np.abs(velocity)) @ self.quadratic
        if self.strips is not None:
            wrench += self.strips.wrench(velocity)
        return wrench

    def effective_fins(self, velocity: FloatArray, fins: FloatArray) -> FloatArray:
        """Return the fin angles that act, given the drift of the vehicle.

        Parameters
        ----------
        velocity : ndarray, shape (n, 6)
            Body velocity [m/s, rad/s].
        fins : ndarray, shape (n, 2)
            Rudder and elevator angle [rad].

        Returns
        -------
        angles : ndarray, shape (n, 2)
            ``delta - factor atan2(-crossflow, u)`` [rad].
        """
        if self.drift_factor == 0.0:
            return fins
        drift = np.arctan2(-velocity[:, 1:3], velocity[:, :1])
        angles: FloatArray = fins - self.drift_factor * drift
        return angles


def _tables(coefficients: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    products, quadratic = np.zeros((6, 6, 6)), np.zeros((6, 6))
    for label, value in coefficients.items():
        axis, term = label.split("_")
        first, second = Term.parse(term).factors
        if second == f"|{first}|":
            quadratic[VELOCITIES.index(first), AXES.index(axis)] = value
        else:
            place = VELOCITIES.index(first), VELOCITIES.index(second), AXES.index(axis)
            products[place] = value
    return frozen(products.reshape(36, 6)), frozen(quadratic)


def sname(coefficients: Mapping[str, float]) -> Truth:
    """Return the published hydrodynamics as they are.

    Parameters
    ----------
    coefficients : mapping of str to float
        The published coefficients by label, such as ``"Y_v|v|"``.

    Returns
    -------
    truth : Truth
        Without strips, drift or lag.

    Raises
    ------
    ValueError
        If a term is not a product of two velocities or ``v|v|`` and its like.
    """
    return Truth("sname", SNAME_NOTE, *_tables(coefficients))


def crossflow(coefficients: Mapping[str, float], fins_at: float) -> Truth:
    """Return the truth with crossflow strips, drift at the fins, and fin lag.

    Parameters
    ----------
    coefficients : mapping of str to float
        The published coefficients by label, such as ``"Y_v|v|"``.
    fins_at : float
        Position of the tail fins, forward of the origin [m].

    Returns
    -------
    truth : Truth
        Force and moment of pure drift as published.

    Raises
    ------
    KeyError
        If a label that the strips replace is missing.
    """
    known = coefficients
    kept = {label: value for label, value in known.items() if label not in CROSSFLOW_DRAG}
    totals = (-known["Y_v|v|"], -known["Z_w|w|"])
    moments = (-known["N_v|v|"], known["M_w|w|"])
    return Truth(
        "crossflow",
        CROSSFLOW_NOTE,
        *_tables(kept),
        Strips.calibrated(totals, moments, fins_at),
        DRIFT_FACTOR,
        FIN_LAG,
    )
