"""What the campaign's water does to a hull: published coefficients, and strip-theory crossflow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.models.damping import Damping
from hydrodamp.models.published import published
from hydrodamp.vehicle.vehicle import Vehicle

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
    """The hydrodynamics that the estimators are to find."""

    name: str
    note: str
    damping: Damping
    strips: Strips | None = None
    drift_factor: float = 0.0
    fin_lag: float = 0.0

    def effective_fins(self, velocity: FloatArray, fins: FloatArray) -> FloatArray:
        """Return the fin angles that act, given the drift of the vehicle."""
        if self.drift_factor == 0.0:
            return fins
        drift = np.arctan2(-velocity[:, 1:3], velocity[:, :1])
        return fins - self.drift_factor * drift


def sname_truth(damping: Damping) -> Truth:
    """Return published hydrodynamics as they are."""
    return Truth("sname", SNAME_NOTE, damping)


def crossflow_truth(damping: Damping, fins_at: float) -> Truth:
    """Return the truth with crossflow strips, drift at the fins, and fin lag."""
    known = damping.as_dict()
    kept = {label: value for label, value in known.items() if label not in CROSSFLOW_DRAG}
    totals = (-known["Y_v|v|"], -known["Z_w|w|"])
    moments = (-known["N_v|v|"], known["M_w|w|"])
    return Truth(
        "crossflow",
        CROSSFLOW_NOTE,
        Damping.from_dict(None, kept),
        Strips.calibrated(totals, moments, fins_at),
        DRIFT_FACTOR,
        FIN_LAG,
    )


HULL_LENGTH = 2.194
"""Length of the hull ``L``, centred on the origin [m]."""

N_STRIPS = 40
"""How many equal strips the hull is cut into."""


@dataclass(frozen=True)
class Strips:
    """Strips along the hull: how they meet the crossflow and how much they resist."""

    arms: FloatArray
    drag: FloatArray

    @classmethod
    def calibrated(
        cls, totals: tuple[float, float], moments: tuple[float, float], fins_at: float
    ) -> Strips:
        """Return a uniform hull and tail fins with the sums asked for."""
        edges = np.linspace(-HULL_LENGTH / 2, HULL_LENGTH / 2, N_STRIPS + 1)
        place = np.append((edges[:-1] + edges[1:]) / 2, fins_at)
        fins = np.array(moments) / fins_at
        hull = (np.array(totals) - fins) / N_STRIPS
        drag = np.column_stack((np.repeat(hull[:, np.newaxis], N_STRIPS, axis=1), fins))
        return cls(frozen(_arms(place)), frozen(drag.ravel()))

    def wrench(self, velocity: FloatArray) -> FloatArray:
        """Return the drag of all strips, about the origin."""
        crossflow = velocity @ self.arms
        return (-self.drag * crossflow * np.abs(crossflow)) @ self.arms.T


def _arms(place: FloatArray) -> FloatArray:
    none, one = np.zeros_like(place), np.ones_like(place)
    sideways = np.array((none, one, none, none, none, place))
    downwards = np.array((none, none, one, none, -place, none))
    return np.hstack((sideways, downwards))


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
    """Return the position of the rudders, forward of the origin [m]."""
    rudder = next(one for one in vehicle.actuators if "rudder" in one.commands)
    wrench = rudder.regressor_terms()[0][1]
    return float(wrench[5] / wrench[1])
