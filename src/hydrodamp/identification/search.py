"""The search of truncated simulation error: damped Gauss-Newton on windows that grow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.conditioning.derived import fitted, relative
from hydrodamp.identification.covariance import correlation_time
from hydrodamp.identification.differences import (
    mean_square,
    median_step,
    noise_variance,
    smoothed,
)
from hydrodamp.identification.power import PowerRows, box_of, spread as spread_over
from hydrodamp.identification.triangle import solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.identification.windows import Windows, covered, cut, laid
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: A standard deviation below this is rounding [m/s, rad/s]; share of the noise that always
#: counts, for its estimate takes fast motion for noise.
_FLOOR, _NOISE = 1e-9, 0.5

#: Steps of a stage; one that takes less than this share off the errors' variance ends it.
ROUNDS, COARSE, REST = 10, 1e-2, 2e-3

#: Damping of the first step, its factor, and how often a step is damped more.
DAMPING, _FACTOR, _TRIALS = 1e-3, 8.0, 8

#: Strength of the prior before the data have set it, and its bounds.
_FIRST, _BOUNDS = 0.1, (1e-6, 10.0)

#: Windows that tell for how long errors are alike.
_LOOKED_AT = 32

#: How far beyond the log damping is to take power, and what weight power fed to the motion has
#: against errors, both as shares of what is usual in the log.
_BEYOND, _FED = 2.0, 10.0

#: Samples of a window that are alike: against so many errors a first velocity counts as one.
_ALIKE = 16.0

#: Strengths of the prior in the regressions that a search may start from, and their steps.
_PRIORS, _ACTIVE = (1e-6, 1e-4, 1e-2, 1.0), 20

#: Residuals of those regressions below this share of the force tell of few data, not of good ones.
_EXACT = 1e-3


@dataclass(frozen=True, eq=False)
class Place:
    """Where a stage ended, over windows of several lengths.

    ``spreads`` are standard deviations of the errors of each velocity, a length each. ``strength``
    is that of the prior against the mean square of the errors over them, ``size`` the mean square
    of coefficients that it stands for; both per coefficient, in units. ``moved`` is the mean square
    by which first velocities moved, against their doubt.
    """

    coefficients: FloatArray
    windows: tuple[Windows, ...]
    spreads: tuple[FloatArray, ...]
    strength: float = _FIRST
    size: float = 1.0
    moved: float = 0.0
    damping: float = DAMPING
    settled: bool = False


@dataclass(frozen=True, eq=False)
class Search:
    """What stays the same from stage to stage.

    ``doubt`` is the standard error of the smoothed ``velocity``, less by the root of ``_ALIKE``.
    ``unit`` of a coefficient is what makes the RMS inertial force of its axis. ``power`` has the
    power fed to the motion at velocities all over a box, for coefficients in units.
    """

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    velocity: FloatArray
    doubt: FloatArray
    noise: FloatArray
    unit: FloatArray
    power: FloatArray

    def part(self, stretches: IntArray) -> Search:
        """Return the search in some stretches of the log, a segment each."""
        samples, problem = covered(stretches), self.problem
        inputs, segments = problem.inputs.part(samples), laid(stretches)
        some = replace(problem, inputs=inputs, segments=segments)
        return replace(self, problem=some, velocity=self.velocity[samples])

    def windows(self, length: float) -> Windows:
        """Return windows of a length [s], each from near the smoothed velocity."""
        bounds = cut(self.problem, length)
        starts = self.velocity[bounds[:, 0]]
        return Windows(length, self.problem, self.entries, bounds, starts, self.doubt)

    def place(self, coefficients: FloatArray, windows: Sequence[Windows]) -> Place:
        """Return the place of coefficients, with the prior that comes before the data."""
        return Place(coefficients, tuple(windows), self.spreads(coefficients, windows))

    def spreads(
        self, coefficients: FloatArray, windows: Sequence[Windows]
    ) -> tuple[FloatArray, ...]:
        """Return the standard deviation of the errors of each velocity, a kind of windows each.

        Noise counts besides, so that little is gained where errors come below it.
        """
        return tuple(
            np.sqrt(np.mean(one.errors(coefficients) ** 2, axis=0) + self.noise**2)
            for one in windows
        )

    def at(self, coefficients: FloatArray, place: Place) -> tuple[Place, FloatArray]:
        """Return the place of other coefficients, and the normal matrix of its mean square error.

        First velocities go where errors, weighed as at the place before, and doubt are least.
        """
        spreads, moved, normal = [], 0.0, np.zeros((len(self.unit) + 1,) * 2)
        for one, spread in zip(place.windows, place.spreads, strict=True):
            found, n = one.linear(coefficients, spread), len(one.samples)
            share = len(place.windows) * n * len(spread)
            spreads.append(np.sqrt(np.maximum(found.square, 0.0) / n + self.noise**2))
            normal += found.normal / share
            moved += found.moved / share
        there = replace(place, coefficients=coefficients, spreads=tuple(spreads), moved=moved)
        return there, normal

    def cost(self, place: Place) -> float:
        """Return what a search makes small: errors, coefficients, and power fed to the motion."""
        x = place.coefficients / self.unit
        misfit = 2.0 * float(np.mean(np.log(place.spreads)))
        fed = _FED * float(np.mean(np.maximum(self.power @ x, 0.0) ** 2))
        return misfit + place.moved + place.strength * float(np.mean(x**2)) + fed

    def feeding(self, x: FloatArray) -> FloatArray:
        """Return the curvature of half the cost of feeding, where coefficients in units are."""
        rows = self.power[self.power @ x > 0.0]
        return np.asarray(_FED / len(self.power) * (rows.T @ rows))


def searching(problem: Problem, model: DampingModel) -> Search:
    """Set up the search for a model's coefficients."""
    entries = problem.columns.entries(model)
    rows, axes = entries
    inputs, free = problem.inputs, problem.vehicle.free
    velocity, _, risk = smoothed(problem)
    doubt = np.maximum(np.sqrt(risk / _ALIKE)[free], _FLOOR)
    noise = np.maximum(_NOISE * np.sqrt(noise_variance(problem))[free], _FLOOR)
    slopes = fitted(inputs.time, problem.segments, relative(inputs.velocity), 15, degree=3).slope
    forces = np.sqrt(np.mean((slopes @ problem.vehicle.mass_matrix.T) ** 2, axis=0))
    force = forces[axes]
    size = np.sqrt(mean_square(problem))[rows - problem.columns.n_known]
    unit = np.where((size > 0.0) & (force > 0.0), force / np.where(size > 0.0, size, 1.0), 1.0)
    box = box_of(velocity, _BEYOND, 0.0).restricted(free)
    usual = float(np.linalg.norm(box.extent * forces * free)) or 1.0
    power = PowerRows(model).rows(spread_over(box)) * unit / usual
    return Search(problem, entries, velocity, doubt, noise, unit, power)


def starts(search: Search, model: DampingModel) -> list[FloatArray]:
    """Return coefficients of the weak form, more or less small, that hardly feed the motion."""
    triangle = WeakEquations().rows(search.problem).triangle()
    blocks, targets = [], []
    for axis, terms in enumerate(model.terms):
        target = triangle.target(axis)
        least = _EXACT * float(np.linalg.norm(target)) / np.sqrt(triangle.n_samples)
        deviation = max(solve_axis(triangle, terms, axis).residual, least) or 1.0
        blocks.append(triangle.columns(terms) / deviation)
        targets.append(target / deviation)
    design = block_diag(*blocks) * search.unit / np.sqrt(triangle.n_samples)
    target = np.concatenate(targets) / np.sqrt(triangle.n_samples)
    curvature, slope, p = design.T @ design, design.T @ target, len(search.unit)
    found = []
    for strength in _PRIORS:
        x = np.zeros(p)
        for _ in range(_ACTIVE):
            before, fed = x, search.feeding(x)
            x = np.linalg.solve(curvature + strength / p * np.eye(p) + fed, slope)
            if np.allclose(x, before, rtol=1e-6):
                break
        found.append(x * search.unit)
    return found


def begun(search: Search, first: Sequence[FloatArray], length: float) -> Place:
    """Return the place of the coefficients that replay windows of a length [s] best."""
    windows = [search.windows(length)]
    return min((search.place(one, windows) for one in first), key=search.cost)


def ladder(search: Search, start: Place, lengths: Sequence[float]) -> Place:
    """Search from a start over windows of one length, then of one length more each time."""
    place, windows = start, tuple(search.windows(length) for length in lengths)
    for number in range(1, len(lengths) + 1):
        more = search.spreads(place.coefficients, windows[len(place.spreads) : number])
        place = replace(place, windows=windows[:number], spreads=place.spreads + more)
        place, normal = search.at(place.coefficients, place)
        place = _evidence(search, place, normal)
        place = descend(search, place, normal, REST if number == len(lengths) else COARSE)
    return place


def within(problem: Problem, lengths: Sequence[float]) -> list[float]:
    """Return the lengths [s] up to the first that no segment exceeds, which is that of them all."""
    time, (first, stop) = problem.inputs.time, problem.segments.T
    longest = float(np.max(time[stop - 1] - time[first]))
    shorter = [length for length in lengths if length < longest]
    return shorter if len(shorter) == len(lengths) else [*shorter, np.inf]


def descend(
    search: Search, place: Place, normal: FloatArray, rest: float, rounds: int = ROUNDS
) -> Place:
    """Take damped Gauss-Newton steps to the likeliest errors, until one promises or gains little.

    Errors of each velocity over windows of each length have a variance of their own, unknown: the
    logarithm of their mean square counts, which asks for no weights. After Nielsen (1999), a step
    is damped as well as the one before kept what it promised.
    """
    p, damping, settled = len(search.unit), place.damping, False
    x, before = place.coefficients / search.unit, search.cost(place)
    for _ in range(rounds):
        curvature = normal[:-1, :-1] * search.unit[:, None] * search.unit
        curvature = curvature + place.strength / p * np.eye(p) + search.feeding(x)
        slope = normal[:-1, -1] * search.unit
        slope = slope - place.strength / p * x - search.feeding(x) @ x
        settled = float(slope @ np.linalg.solve(curvature, slope)) < rest
        if settled:
            break
        factor = 2.0
        for _ in range(_TRIALS):
            step = np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
            new, there = search.at((x + step) * search.unit, place)
            after = search.cost(new)
            if after < before:
                break
            damping, factor = factor * damping, 2.0 * factor
        else:
            break
        kept = (before - after) / float(step @ (2.0 * slope - curvature @ step))
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * kept - 1.0) ** 3), DAMPING)
        settled = before - after < rest
        place, normal, x, before = new, there, x + step, after
        if settled:
            break
    return replace(place, settled=settled, damping=damping)


def _evidence(search: Search, place: Place, normal: FloatArray) -> Place:
    """Return the place with the strength of the prior that the data ask for (MacKay 1992).

    Errors of a replay are alike for seconds: they count as often as they are independent.
    """
    windows, spread = place.windows[-1], place.spreads[-1]
    some = windows.some(slice(None, None, -(-len(windows.bounds) // _LOOKED_AT)))
    errors = some.errors(place.coefficients)
    number = np.repeat(np.arange(len(some.spans)), np.diff(some.spans, axis=1).ravel())
    time, step = search.problem.inputs.time[some.samples], median_step(search.problem)
    alike = [max(correlation_time(one[:, None], number, time) / step, 1.0) for one in errors.T]
    independent = search.problem.n_samples * float(np.sum(1.0 / np.array(alike)))
    misfit = float(np.mean(1.0 - (search.noise / spread) ** 2))
    curvature = normal[:-1, :-1] * search.unit[:, None] * search.unit
    told = np.maximum(np.linalg.eigvalsh(curvature), 0.0)
    square = float(np.sum((place.coefficients / search.unit) ** 2))
    p, strength, size = len(told), place.strength, place.size
    for _ in range(5):
        determined = float(np.sum(told / (told + strength / p)))
        if not (determined > 0.0 and square > 0.0):
            break
        size = square / determined
        left = max(1.0 - determined / independent, 0.1)
        strength = float(np.clip(p * misfit / left / independent / size, *_BOUNDS))
    return replace(place, strength=strength, size=size)
