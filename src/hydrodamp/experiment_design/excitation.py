"""Excitation signals of a dive: orthogonal multisines, steps, doublets and zigzags.

A multisine is sum_k sin(2 pi k t / T + phi_k); no two inputs share a harmonic k, and the phases
minimise the 8-norm of the sum, from Schroeder's start: low peaks, uncorrelated inputs.
E. A. Morelli, "Flight Test Maneuvers for Efficient Aerodynamic Modeling", J. Aircraft 49 (2012),
doi:10.2514/1.C031699.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.optimize import minimize

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot
from hydrodamp.experiment_design.envelope import Envelope

SHAPES = ("multisine", "steps", "doublets", "zigzag")
"""Shapes of excitation signals."""

MAX_HEADING = float(np.radians(75.0))
"""Largest heading setpoint relative to the course [rad]: less than half a turn between sides."""

DEPTH_AMPLITUDE, MAX_DEPTH = 0.6, 0.48
"""Depth of strength 1, and largest depth from the middle, as shares of the depth band."""

FREQUENCIES, HOLDS = (0.08, 0.5), (20.0, 3.0)
"""Highest multisine frequency [Hz] and time between steps [s], at tempo 0 and 1."""

SETPOINT_FREQUENCY_RATIO = 0.3
"""Highest frequency of setpoints over that of commands: the closed loop is slower."""

N_SETPOINTS = 3
"""Inputs that are setpoints (speed, heading, depth); overlays of commands follow."""

MAX_HARMONICS, MAX_PHASE_ITERATIONS = 16, 60
"""Harmonics of a multisine, and iterations of the minimisation of its peak."""


@dataclass(frozen=True)
class Manoeuvre:
    """Excitation of one segment of a dive.

    Attributes
    ----------
    shape : str
        One of ``SHAPES``.
    level : float
        Mean speed, from 0 to 1 of the speed band.
    tempo : float
        From 0 (slow) to 1 (fast).
    strengths : tuple of float
        Amplitudes of speed, heading, depth and each overlay, from -1 to 1 of their limits.
    """

    shape: str
    level: float
    tempo: float
    strengths: tuple[float, ...]

    @classmethod
    def from_design_vector(cls, vector: FloatArray) -> Manoeuvre:
        """Return the manoeuvre of a vector in [0, 1]: shape, level, tempo, strengths."""
        shape = SHAPES[min(int(vector[0] * len(SHAPES)), len(SHAPES) - 1)]
        strengths = tuple((2.0 * vector[3:] - 1.0).tolist())
        return cls(shape, float(vector[1]), float(vector[2]), strengths)

    @property
    def design_vector(self) -> FloatArray:
        """The manoeuvre as a vector in [0, 1]."""
        shape = (SHAPES.index(self.shape) + 0.5) / len(SHAPES)
        return np.array([shape, self.level, self.tempo, *(0.5 + 0.5 * np.array(self.strengths))])

    def attenuate(self, factor: float) -> Manoeuvre:
        """Return the manoeuvre with all strengths multiplied by a factor."""
        return replace(self, strengths=tuple(factor * value for value in self.strengths))

    @property
    def mirrored(self) -> Manoeuvre:
        """The manoeuvre with all signs reversed."""
        return self.attenuate(-1.0)

    def slow_down(self, factor: float) -> Manoeuvre:
        """Return the manoeuvre at a lower speed that varies less."""
        strengths = (factor * self.strengths[0], *self.strengths[1:])
        level = max(self.level - (1.0 - factor) * 0.5, 0.0)
        return replace(self, level=level, strengths=strengths)

    def setpoints(
        self, autopilot: DesignedAutopilot, envelope: Envelope, n: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return setpoints relative to course and mid-depth, (n, 3), and overlays, (n, k)."""
        signals = _unit_signals(self.shape, self.tempo, len(self.strengths), n, envelope.period)
        signals = signals * np.array(self.strengths)
        low, high = envelope.speed
        setpoints = np.empty((n, N_SETPOINTS))
        setpoints[:, 0] = np.clip(low + (high - low) * (self.level + signals[:, 0]), low, high)
        setpoints[:, 1] = MAX_HEADING * signals[:, 1]
        depth = np.clip(DEPTH_AMPLITUDE * signals[:, 2], -MAX_DEPTH, MAX_DEPTH)
        setpoints[:, 2] = (envelope.max_depth - envelope.depth[0]) * depth
        overlays, indices = np.zeros((n, len(autopilot.names))), autopilot.overlays
        lowest, highest = autopilot.lowest[indices], autopilot.highest[indices]
        amplitude = np.where(signals[:, N_SETPOINTS:] < 0.0, -lowest, highest)
        overlays[:, indices] = signals[:, N_SETPOINTS:] * np.maximum(amplitude, 0.0)
        return setpoints, overlays


@cache
def _unit_signals(shape: str, tempo: float, n_inputs: int, n: int, period: float) -> FloatArray:
    """Return a signal of peak 1 for each input, shape (n, n_inputs)."""
    time = np.asarray(period * np.arange(n), dtype=np.float64)
    if shape == "multisine":
        highest = FREQUENCIES[0] * (FREQUENCIES[1] / FREQUENCIES[0]) ** tempo
        return frozen(_multisines(highest, n_inputs, time, n * period))
    hold = HOLDS[0] * (HOLDS[1] / HOLDS[0]) ** tempo
    signals = np.zeros((n, n_inputs))
    for index in range(n_inputs):
        # Inputs start one after the other so that they are not correlated.
        phase = time / hold - index / n_inputs
        count = np.floor(phase).astype(int)
        if shape == "steps":
            signal = np.array([1.0, 0.0, -1.0, -0.5, 0.5, 0.0])[count % 6]
        elif shape == "zigzag":
            signal = np.where(np.floor(phase / (1.0 + index % 3)).astype(int) % 2, -1.0, 1.0)
        else:
            active = (count - index) % max(n_inputs, 3) == 0
            signal = np.where(active, np.where(phase % 1.0 < 0.5, 1.0, -1.0), 0.0)
        signals[:, index] = np.where(phase < 0.0, 0.0, signal)
    return frozen(signals)


def _multisines(highest: float, n_inputs: int, time: FloatArray, duration: float) -> FloatArray:
    """Return multisines up to a frequency [Hz] with no common harmonic and with low peaks."""
    signals = np.zeros((len(time), n_inputs))
    for index in range(n_inputs):
        top = highest * (SETPOINT_FREQUENCY_RATIO if index < N_SETPOINTS else 1.0)
        last = max(int(top * duration), index + 1, 1)
        harmonics = np.arange(1 + index, last + 1, n_inputs)
        spaced = np.linspace(0, len(harmonics) - 1, MAX_HARMONICS).astype(int)
        harmonics = harmonics[np.unique(spaced)]
        angles = 2.0 * np.pi * np.outer(time / duration, harmonics)
        signal = np.sin(angles + low_peak_phases(tuple(harmonics.tolist()))).sum(axis=1)
        signals[:, index] = signal / max(np.abs(signal).max(), 1e-9)
    return signals


@cache
def low_peak_phases(harmonics: tuple[int, ...]) -> FloatArray:
    """Return the phases that minimise the 8-norm of the sum of these harmonics.

    The start is of M. R. Schroeder (1970), doi:10.1109/TIT.1970.1054411.
    """
    number = np.array(harmonics, dtype=np.float64)
    k = np.arange(1, len(number) + 1)
    start = -np.pi * k * (k - 1) / len(number)
    grid = np.linspace(0.0, 2.0 * np.pi, 16 * int(number.max()) + 1)[:-1]
    angles = np.outer(grid, number)

    def log_norm(phases: FloatArray) -> tuple[float, FloatArray]:
        signal = np.sin(angles + phases).sum(axis=1)
        power = np.mean(signal**8)
        gradient = 8.0 * np.mean(signal[:, None] ** 7 * np.cos(angles + phases), axis=0)
        return float(np.log(power)), gradient / power

    result = minimize(log_norm, start, jac=True, options={"maxiter": MAX_PHASE_ITERATIONS})
    return frozen(result.x)


def join_setpoints(
    manoeuvres: Sequence[Manoeuvre], autopilot: DesignedAutopilot, envelope: Envelope, n: int
) -> tuple[FloatArray, FloatArray]:
    """Return setpoints and overlays of consecutive manoeuvres of n samples each."""
    pairs = [manoeuvre.setpoints(autopilot, envelope, n) for manoeuvre in manoeuvres]
    setpoints, overlays = (np.concatenate(arrays) for arrays in zip(*pairs, strict=True))
    setpoints[:, 2] += envelope.mid_depth
    return setpoints, overlays


def candidate_manoeuvres(n_overlays: int) -> list[Manoeuvre]:
    """Return initial candidates: each shape at three speeds, on setpoints and on commands."""
    candidates = []
    for number, shape in enumerate(SHAPES):
        for index, level in enumerate((0.9, 0.5, 0.1)):
            tempo = (0.3, 0.5, 0.7)[(index + number) % 3]
            by_setpoints = (0.0, 0.5, 0.4, *([0.1] * n_overlays))
            by_overlays = (0.1, 0.2, 0.2, *([0.8, -0.8] * n_overlays)[:n_overlays])
            candidates.append(Manoeuvre(shape, level, tempo, by_setpoints))
            if index != 1:
                candidates.append(Manoeuvre(shape, level, tempo, by_overlays))
    return candidates


def baseline_manoeuvres(n_overlays: int, hovers: bool) -> list[Manoeuvre]:
    """Return a conventional campaign: steps of heading and depth in turn at three speeds.

    Of a vehicle that hovers: doublets of one command after another.
    """
    if hovers:
        strengths = (0.0, 0.0, 0.0, *([1.0] * n_overlays))
        return [Manoeuvre("doublets", 0.5, tempo, strengths) for tempo in (0.2, 0.5, 0.8)]
    directions = [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    levels, no_overlays = (0.9, 0.5, 0.1), (0.0,) * n_overlays
    return [
        Manoeuvre("steps", levels[k % 3], 0.1, (*directions[k % 2], *no_overlays)) for k in range(6)
    ]
