"""True hydrodynamics of the campaign: published coefficients, or strip theory for the crossflow.

With strips at x_k, crossflow velocities v + x_k r and w - x_k q, the drag of strip k is
-d_k |v + x_k r| (v + x_k r), and likewise for heave; its moments are about the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.models.damping import Damping
from hydrodamp.models.published import published
from hydrodamp.vehicle.vehicle import Vehicle

DRIFT_FACTOR = 0.178
"""Ratio of a fin's inflow angle to the drift angle; published for the rudder."""

FIN_LAG = 0.05
"""Time constant of the fins of the crossflow truth [s]; assumed."""

CROSSFLOW_DRAG = (
    *("Y_v|v|", "Y_r|r|", "N_v|v|", "N_r|r|"),
    *("Z_w|w|", "Z_q|q|", "M_w|w|", "M_q|q|"),
)
"""Coefficients that the strips replace."""

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
    """Hydrodynamics from which logs are simulated; fin lag is a time constant [s]."""

    name: str
    note: str
    damping: Damping
    strips: Strips | None = None
    drift_factor: float = 0.0
    fin_lag: float = 0.0

    def effective_fins(self, velocity: FloatArray, fins: FloatArray) -> FloatArray:
        """Return the fin angles relative to the inflow."""
        if self.drift_factor == 0.0:
            return fins
        drift = np.arctan2(-velocity[:, 1:3], velocity[:, :1])
        return fins - self.drift_factor * drift


def sname_truth(damping: Damping) -> Truth:
    """Return the published hydrodynamics."""
    return Truth("sname", SNAME_NOTE, damping)


def crossflow_truth(damping: Damping, fin_x: float) -> Truth:
    """Return hydrodynamics with crossflow strips, inflow angle and lag of the fins."""
    known = damping.as_dict()
    remaining = {label: value for label, value in known.items() if label not in CROSSFLOW_DRAG}
    totals = (-known["Y_v|v|"], -known["Z_w|w|"])
    moments = (-known["N_v|v|"], known["M_w|w|"])
    return Truth(
        "crossflow",
        CROSSFLOW_NOTE,
        Damping.from_dict(None, remaining),
        Strips.calibrated(totals, moments, fin_x),
        DRIFT_FACTOR,
        FIN_LAG,
    )


HULL_LENGTH = 2.194
"""Length of the hull ``L``, centred on the origin [m]."""

N_STRIPS = 40
"""Number of strips of equal length."""


@dataclass(frozen=True)
class Strips:
    """Lever arms (6, n) from velocity to crossflow, and drag coefficients (n,) of the strips."""

    arms: FloatArray
    drag: FloatArray

    @classmethod
    def calibrated(
        cls, totals: tuple[float, float], moments: tuple[float, float], fin_x: float
    ) -> Strips:
        """Return strips of a uniform hull and tail fins that sum to total drag and moments."""
        edges = np.linspace(-HULL_LENGTH / 2, HULL_LENGTH / 2, N_STRIPS + 1)
        x = np.append((edges[:-1] + edges[1:]) / 2, fin_x)
        fin_drag = np.array(moments) / fin_x
        strip_drag = (np.array(totals) - fin_drag) / N_STRIPS
        drag = np.column_stack((np.repeat(strip_drag[:, np.newaxis], N_STRIPS, axis=1), fin_drag))
        return cls(frozen(_arms(x)), frozen(drag.ravel()))

    def wrench(self, velocity: FloatArray) -> FloatArray:
        """Return the drag of all strips about the origin, shape (n, 6)."""
        crossflow = velocity @ self.arms
        return (-self.drag * crossflow * np.abs(crossflow)) @ self.arms.T


def _arms(x: FloatArray) -> FloatArray:
    zero, unit = np.zeros_like(x), np.ones_like(x)
    sway = np.array((zero, unit, zero, zero, zero, x))
    heave = np.array((zero, zero, unit, zero, -x, zero))
    return np.hstack((sway, heave))


HORIZONTAL = "vt690-sname2022"
"""The published set of the axes X Y K N."""

VERTICAL = "vt690-field"
"""The published set of the axes Z M."""


@cache
def true_damping() -> Damping:
    """Return the hydrodynamics of the campaign's vehicle."""
    horizontal, vertical = published[HORIZONTAL], published[VERTICAL]
    values = {
        label: (vertical if label[0] in "ZM" else horizontal)[label]
        for label in horizontal.model.labels
    }
    return Damping.from_dict(
        horizontal.model, values, source=f"{HORIZONTAL} on X Y K N, {VERTICAL} on Z M"
    )


def fin_position(vehicle: Vehicle) -> float:
    """Return the longitudinal position of the rudders, positive forward [m]."""
    rudder = next(item for item in vehicle.actuators if "rudder" in item.commands)
    wrench = rudder.regressor_terms()[0][1]
    return float(wrench[5] / wrench[1])
