"""Manoeuvres of a dive: orthogonal multisines, and the classical steps, doublets and zigzags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import minimize

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.experiment_design.autopilot import Autopilot
from hydrodamp.experiment_design.envelope import Envelope

SHAPES = ("multisine", "steps", "doublets", "zigzag")
"""What a manoeuvre may be."""

#: Largest angle to the course that is told [rad], with room to half a turn from side to side, and
#: the share of the band of depth.
_TURN, _DIVE = float(np.radians(75.0)), 0.6

#: How near to the ends of the band a depth is told, as a share of it from its middle.
_EDGE = 0.48

#: Highest frequency of a multisine [Hz] and time between steps [s], from slow to quick.
_HIGHEST, _HOLDS = (0.08, 0.5), (20.0, 3.0)

#: A setpoint is followed slowly: its harmonics end at this share of those of the commands.
_SLOWER = 0.3

#: Components of a multisine at most, and steps of the search for its phases.
_COMPONENTS, _SEARCH = 16, 60


@dataclass(frozen=True)
class Manoeuvre:
    """One stretch of a dive: a shape, and how strongly it moves what is told.

    Attributes
    ----------
    shape : str
        One of ``SHAPES``.
    level : float
        Speed ahead, 0 to 1 of the band.
    tempo : float
        0 slow to 1 quick.
    strengths : tuple of float
        Of speed, heading, depth and each command that takes overlays, -1 to 1 of what it may do.
    """

    shape: str
    level: float
    tempo: float
    strengths: tuple[float, ...]

    @classmethod
    def from_design_vector(cls, design_vector: FloatArray) -> Manoeuvre:
        """Return the manoeuvre of numbers from 0 to 1: shape, level, tempo, strengths."""
        place = min(int(design_vector[0] * len(SHAPES)), len(SHAPES) - 1)
        strengths = tuple((2.0 * design_vector[3:] - 1.0).tolist())
        return cls(SHAPES[place], float(design_vector[1]), float(design_vector[2]), strengths)

    @property
    def numbers(self) -> FloatArray:
        """The numbers it is made of."""
        shape = (SHAPES.index(self.shape) + 0.5) / len(SHAPES)
        return np.array([shape, self.level, self.tempo, *(0.5 + 0.5 * np.array(self.strengths))])

    def attenuate(self, share: float) -> Manoeuvre:
        """Return the same with all strengths times a share."""
        strengths = tuple(share * one for one in self.strengths)
        return Manoeuvre(self.shape, self.level, self.tempo, strengths)

    @property
    def mirrored(self) -> Manoeuvre:
        """The same to the other side."""
        return self.attenuate(-1.0)

    def slow_down(self, share: float) -> Manoeuvre:
        """Return the same at a speed lower by a share of the band, and with less change of it."""
        strengths = (share * self.strengths[0], *self.strengths[1:])
        level = max(self.level - (1.0 - share) * 0.5, 0.0)
        return Manoeuvre(self.shape, level, self.tempo, strengths)

    def setpoints(
        self, autopilot: Autopilot, envelope: Envelope, n: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return what is told about a base course and depth, (n, 3), and added, (n, k)."""
        waves = _waves(self.shape, self.tempo, len(self.strengths), n, envelope.period)
        moves = waves * np.array(self.strengths)
        low, high = envelope.speed
        setpoints = np.empty((n, 3))
        setpoints[:, 0] = np.clip(low + (high - low) * (self.level + moves[:, 0]), low, high)
        setpoints[:, 1] = _TURN * moves[:, 1]
        room = envelope.max_depth - envelope.depth[0]
        setpoints[:, 2] = room * np.clip(_DIVE * moves[:, 2], -_EDGE, _EDGE)
        overlays, places = np.zeros((n, len(autopilot.names))), autopilot.overlays
        lowest, highest = autopilot.lowest[places], autopilot.highest[places]
        most = np.where(moves[:, 3:] < 0.0, -lowest, highest)
        overlays[:, places] = moves[:, 3:] * np.maximum(most, 0.0)
        return setpoints, overlays


@cache
def _waves(shape: str, tempo: float, inputs: int, n: int, period: float) -> FloatArray:
    """Return a wave of largest size one for each input, shape (n, inputs)."""
    time = np.asarray(period * np.arange(n), dtype=np.float64)
    if shape == "multisine":
        highest = _HIGHEST[0] * (_HIGHEST[1] / _HIGHEST[0]) ** tempo
        return frozen(_multisines(round(tempo, 2), highest, inputs, time, n * period))
    hold = _HOLDS[0] * (_HOLDS[1] / _HOLDS[0]) ** tempo
    found = np.zeros((n, inputs))
    for place in range(inputs):
        # Each input begins a while after the one before, so that none does what another does.
        beat = time / hold - place / inputs
        number = np.floor(beat).astype(int)
        if shape == "steps":
            wave = np.array([1.0, 0.0, -1.0, -0.5, 0.5, 0.0])[number % 6]
        elif shape == "zigzag":
            wave = np.where(np.floor(beat / (1.0 + place % 3)).astype(int) % 2, -1.0, 1.0)
        else:
            turn = (number - place) % max(inputs, 3) == 0
            wave = np.where(turn, np.where(beat % 1.0 < 0.5, 1.0, -1.0), 0.0)
        found[:, place] = np.where(beat < 0.0, 0.0, wave)
    return frozen(found)


def _multisines(
    tempo: float, highest: float, inputs: int, time: FloatArray, length: float
) -> FloatArray:
    """Return multisines of harmonics that no two share, of low peaks.

    E. A. Morelli, "Flight Test Maneuvers for Efficient Aerodynamic Modeling", J. Aircraft 49
    (2012), doi:10.2514/1.C031699.
    """
    found = np.zeros((len(time), inputs))
    for place in range(inputs):
        top = highest * (_SLOWER if place < 3 else 1.0)
        count = max(int(top * length), 1)
        harmonics = np.arange(1 + place % inputs, max(count, place + 1) + 1, inputs)
        some = harmonics[np.unique(np.linspace(0, len(harmonics) - 1, _COMPONENTS).astype(int))]
        wave = np.sin(
            2.0 * np.pi * np.outer(time / length, some) + low_peak_phases(tuple(some.tolist()))
        ).sum(axis=1)
        found[:, place] = wave / max(np.abs(wave).max(), 1e-9)
    return found


@cache
def low_peak_phases(harmonics: tuple[int, ...]) -> FloatArray:
    """Return phases that make the sum of these harmonics a low peak for its power.

    From Schroeder's (1970, doi:10.1109/TIT.1970.1054411), a norm that weighs peaks is made small.
    """
    number = np.array(harmonics, dtype=np.float64)
    k = np.arange(1, len(number) + 1)
    start = -np.pi * k * (k - 1) / len(number)
    grid = np.linspace(0.0, 2.0 * np.pi, 16 * int(number.max()) + 1)[:-1]
    turns = np.outer(grid, number)

    def peak(given: FloatArray) -> tuple[float, FloatArray]:
        wave = np.sin(turns + given).sum(axis=1)
        power = np.mean(wave**8)
        slope = 8.0 * np.mean(wave[:, None] ** 7 * np.cos(turns + given), axis=0)
        return float(np.log(power)), slope / power

    return frozen(minimize(peak, start, jac=True, options={"maxiter": _SEARCH}).x)


def join_setpoints(
    several: Sequence[Manoeuvre], autopilot: Autopilot, envelope: Envelope, n: int
) -> tuple[FloatArray, FloatArray]:
    """Return what manoeuvres of so many samples tell one after the other, about half depth."""
    setpoints, overlays = zip(
        *(one.setpoints(autopilot, envelope, n) for one in several), strict=True
    )
    return np.concatenate(setpoints) + np.array([0.0, 0.0, envelope.mid_depth]), np.concatenate(
        overlays
    )


def candidate_manoeuvres(n_overlays: int) -> list[Manoeuvre]:
    """Return manoeuvres to begin from: each shape at three speeds, on setpoints and on commands."""
    found = []
    for number, shape in enumerate(SHAPES):
        for place, level in enumerate((0.9, 0.5, 0.1)):
            tempo = (0.3, 0.5, 0.7)[(place + number) % 3]
            setpoints = (0.0, 0.5, 0.4, *([0.1] * n_overlays))
            added = (0.1, 0.2, 0.2, *([0.8, -0.8] * n_overlays)[:n_overlays])
            found.append(Manoeuvre(shape, level, tempo, setpoints))
            if place != 1:
                found.append(Manoeuvre(shape, level, tempo, added))
    return found


def baseline_manoeuvres(n_overlays: int, hovers: bool) -> list[Manoeuvre]:
    """Return a campaign as it is sailed without a plan: one setpoint at a time.

    Steps of heading and of depth at three speeds; of a vehicle that hovers doublets, stick by
    stick.
    """
    if hovers:
        sticks = (0.0, 0.0, 0.0, *([1.0] * n_overlays))
        return [Manoeuvre("doublets", 0.5, tempo, sticks) for tempo in (0.2, 0.5, 0.8)]
    ways = [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    levels, none = (0.9, 0.5, 0.1), (0.0,) * n_overlays
    return [Manoeuvre("steps", levels[k % 3], 0.1, (*ways[k % 2], *none)) for k in range(6)]
