"""How long a test function is, chosen by what the sensors leave of the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.identification.rows.velocity_noise import median_step, signal_to_noise
from hydrodamp.identification.rows.weak_functions import bumps
from hydrodamp.simulation.problem import Problem

_NOISE = 0.1
"""Share of noise in the mean square of what the test functions see, averaged over the
velocities: noise then adds some 5 % to the root mean square. Set with the re-enacted
campaign in view, where shares from 0.2 to 0.02 belong to supports of 1 to 2.8 s: with
shorter ones the large models suffer from noise, with longer ones the small models replay
worse."""

_HEARD = 2.0
"""A velocity varies more than its noise where the ratio of the variances is above this."""

_LEAST_STEPS = 4
"""Steps under the shortest test function."""

_PER_SEGMENT = 4.0
"""How many of the longest test functions a segment holds side by side."""

_PER_OCTAVE = 4
"""Lengths tried in each doubling."""

_OVERLAP = 2
"""Functions over an instant while the length is chosen."""


@dataclass(frozen=True)
class Support:
    """The length of a test function and how it was come by."""

    length: float
    reason: str


def chosen_support(problem: Problem) -> Support:
    """Choose one length for all axes from the velocities of a log."""
    lengths, ratio = _lengths(problem), signal_to_noise(problem)
    moving = ratio > _HEARD
    if not moving.any():
        return Support(lengths[-1], "the longest that segments allow; nothing stands out of noise")
    noise = problem.inputs.velocity.var(axis=0) / ratio
    names = " ".join(np.array(VELOCITIES)[moving])
    shares: list[float] = []
    for length in lengths:
        shares.append(float(noise_share(problem, length, noise)[moving].mean()))
        if shares[-1] <= _NOISE:
            return Support(length, f"the shortest with little noise; {_words(shares[-1], names)}")
    least = int(np.argmin(shares))
    return Support(lengths[least], f"the one with the least noise; {_words(shares[least], names)}")


def noise_share(problem: Problem, support: float, noise: FloatArray) -> FloatArray:
    """Return the share of noise in what test functions see of each velocity."""
    gain, power = 0.0, np.zeros(6)
    for start, stop in problem.segments.tolist():
        time, velocity = problem.inputs.time[start:stop], problem.inputs.velocity[start:stop]
        for some in bumps(time, support, _OVERLAP):
            reach = slice(some.start, some.stop)
            slopes = some.weights @ _differences(time[reach])
            gain += float((slopes.data**2).sum())
            power += ((slopes @ velocity[reach]) ** 2).sum(axis=0)
    return np.divide(gain * noise, power, out=np.ones(6), where=power > 0.0)


def _lengths(problem: Problem) -> list[float]:
    time, ends = problem.inputs.time, problem.segments
    duration = time[ends[:, 1] - 1] - time[ends[:, 0]]
    least = _LEAST_STEPS * median_step(problem)
    longest = max(float(duration @ duration / duration.sum()) / _PER_SEGMENT, least)
    n = int(np.ceil(_PER_OCTAVE * np.log2(longest / least))) + 1
    lengths: list[float] = np.geomspace(least, longest, n).tolist()
    return lengths


def _differences(time: FloatArray) -> csr_array:
    """Return what takes the values of samples to their slopes over each step."""
    rate, step = 1.0 / np.diff(time), np.arange(len(time) - 1)
    places = np.column_stack([step, step + 1]).ravel()
    entries = np.column_stack([-rate, rate]).ravel()
    return csr_array((entries, places, 2 * np.arange(len(time))), shape=(len(step), len(time)))


def _words(share: float, names: str) -> str:
    return (
        f"noise is {100.0 * share:.0f} % of the mean square acceleration that they see, "
        f"averaged over {names}"
    )
