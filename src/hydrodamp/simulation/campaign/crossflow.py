"""Drag of the crossflow, strip by strip along the hull."""

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
        wrench: FloatArray = (-self.drag * crossflow * np.abs(crossflow)) @ self.arms.T
        return wrench


def _arms(place: FloatArray) -> FloatArray:
    none, one = np.zeros_like(place), np.ones_like(place)
    sideways = np.array((none, one, none, none, none, place))
    downwards = np.array((none, none, one, none, -place, none))
    return np.hstack((sideways, downwards))
