"""The search of truncated simulation error: damped Gauss-Newton on windows that grow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.derived import fitted, relative
from hydrodamp.identification.covariance import correlation_time
from hydrodamp.identification.differences import (
    mean_square,
    median_step,
    noise_variance,
    smoothed,
)
from hydrodamp.identification.triangle import solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.identification.windows import Windows, cut
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: A standard deviation below this is rounding [m/s, rad/s].
_FLOOR = 1e-9

#: Errors are divided by so many of their 68 % quantiles, at least by so many of the noise.
_WIDE = 2.0

#: Steps before the data set the prior, and steps in all; one that gains less than this share ends
#: either.
_EARLY, ROUNDS, REST = 2, 6, 1e-2

#: Damping of the first step, its factor, and how often a step is damped more.
_DAMPING, _FACTOR, _TRIALS = 1e-3, 8.0, 8

#: Strength of the prior before the data have set it, and its bounds.
_FIRST, _BOUNDS = 0.1, (1e-4, 10.0)


@dataclass(frozen=True, eq=False)
class Place:
    """Where a stage ended.

    ``strength`` is that of the prior against the mean square of the errors over ``spread``,
    ``size`` the mean square of coefficients that it stands for; both per coefficient, in units.
    """

    coefficients: FloatArray
    spread: FloatArray
    length: float = 0.0
    strength: float = _FIRST
    size: float = 1.0
    settled: bool = False


@dataclass(frozen=True, eq=False)
class Search:
    """What stays the same from stage to stage.

    ``unit`` of a coefficient is what makes the RMS inertial force of its axis.
    """

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    velocity: FloatArray
    noise: FloatArray
    unit: FloatArray

    def windows(self, length: float) -> Windows:
        """Return windows of a length [s], each from the smoothed velocity."""
        bounds = cut(self.problem, length)
        return Windows(self.problem, self.entries, bounds, self.velocity[bounds[:, 0]])


def searching(problem: Problem, model: DampingModel) -> Search:
    """Set up the search for a model's coefficients."""
    entries = problem.columns.entries(model)
    rows, axes = entries
    inputs, free = problem.inputs, problem.vehicle.free
    velocity, _ = smoothed(problem)
    slopes = fitted(inputs.time, problem.segments, relative(inputs.velocity), 15, degree=3).slope
    force = np.sqrt(np.mean((slopes @ problem.vehicle.mass_matrix.T) ** 2, axis=0))[axes]
    size = np.sqrt(mean_square(problem))[rows - problem.columns.n_known]
    unit = np.where((size > 0.0) & (force > 0.0), force / np.where(size > 0.0, size, 1.0), 1.0)
    noise = np.maximum(np.sqrt(noise_variance(problem))[free], _FLOOR)
    return Search(problem, entries, velocity, noise, unit)


#: Strengths of the ridge in the regressions that a search may start from.
_RIDGES = (0.0, 1e-5, 1e-3, 1e-1)


def starts(problem: Problem, model: DampingModel) -> list[FloatArray]:
    """Return coefficients of the weak form, plain and with small ones preferred."""
    triangle = WeakEquations().rows(problem).triangle()
    return [
        np.concatenate(
            [
                solve_axis(triangle, terms, axis, strength).coefficients
                for axis, terms in enumerate(model.terms)
            ]
        )
        for strength in _RIDGES
    ]


def ladder(search: Search, first: Sequence[FloatArray], lengths: Sequence[float]) -> list[Place]:
    """Search from the best of several starts through growing windows; return every stage."""
    windows = search.windows(lengths[0])
    spreads = [spread_of(search, windows.errors(each)) for each in first]
    best = int(np.argmin([np.log(spread).sum() for spread in spreads]))
    place, places = Place(first[best], spreads[best]), []
    for length in lengths:
        windows = search.windows(length)
        if np.isinf(length):  # over whole segments errors grow beyond what short windows say
            place = replace(place, spread=spread_of(search, windows.errors(place.coefficients)))
        place = descend(search, windows, replace(place, length=length))
        places.append(place)
    return places


def within(problem: Problem, lengths: Sequence[float]) -> list[float]:
    """Return the lengths [s] up to the first that no segment exceeds, which is that of them all."""
    time, (first, stop) = problem.inputs.time, problem.segments.T
    longest = float(np.max(time[stop - 1] - time[first]))
    shorter = [length for length in lengths if length < longest]
    return shorter if len(shorter) == len(lengths) else [*shorter, np.inf]


def spread_of(search: Search, errors: FloatArray) -> FloatArray:
    """Return what to divide the errors of each velocity by."""
    quantile = np.quantile(np.abs(errors), 0.68, axis=0)
    return np.asarray(_WIDE * np.maximum(quantile, search.noise))


def descend(search: Search, windows: Windows, start: Place, rounds: int = ROUNDS) -> Place:
    """Take damped Gauss-Newton steps on windows of one length; the data set the prior early on."""
    place, x, p = start, start.coefficients / search.unit, len(search.unit)
    damping, known, resting, settled = _DAMPING, False, False, False

    def cost(x: FloatArray) -> float:
        errors = windows.errors(x * search.unit) / place.spread
        return float(np.mean(errors**2) + place.strength * np.mean(x**2))

    before = cost(x)
    for number in range(rounds):
        curvature, slope = _quadratic(search, windows, place)
        if not known and (resting or number == _EARLY):
            place, known = _evidence(search, windows, place, curvature), True
            before = cost(x)
        curvature = curvature + place.strength / p * np.eye(p)
        slope = slope - place.strength / p * x
        for _ in range(_TRIALS):
            tried = x + np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
            after = cost(tried)
            if after < before:
                break
            damping *= _FACTOR
        else:
            settled = True
            break
        place = replace(place, coefficients=tried * search.unit)
        resting = (before - after) / before < REST
        x, before, damping = tried, after, max(damping / _FACTOR, 1e-9)
        settled = resting and known
        if settled:
            break
    return replace(place, settled=settled)


def _quadratic(search: Search, windows: Windows, place: Place) -> tuple[FloatArray, FloatArray]:
    """Return curvature and downward slope of half the mean square error, in units."""
    total = windows.normal(place.coefficients, place.spread)
    total /= len(windows.samples) * len(place.spread)
    unit = search.unit
    return total[:-1, :-1] * unit[:, None] * unit, total[:-1, -1] * unit


def _evidence(search: Search, windows: Windows, place: Place, curvature: FloatArray) -> Place:
    """Return the place with the prior that the data speak for (MacKay 1992).

    Errors of a replay are alike for seconds: they count as often as they are independent.
    """
    errors = windows.errors(place.coefficients) / place.spread
    number = np.repeat(np.arange(len(windows.spans)), np.diff(windows.spans, axis=1).ravel())
    time, step = windows.problem.inputs.time[windows.samples], median_step(search.problem)
    alike = [max(correlation_time(one[:, None], number, time) / step, 1.0) for one in errors.T]
    independent = search.problem.n_samples * float(np.sum(1.0 / np.array(alike)))
    told = np.maximum(np.linalg.eigvalsh(curvature), 0.0)
    square = float(np.sum((place.coefficients / search.unit) ** 2))
    misfit, p, strength, size = float(np.mean(errors**2)), len(told), place.strength, place.size
    for _ in range(5):
        determined = float(np.sum(told / (told + strength / p)))
        if not (determined > 0.0 and square > 0.0):
            break
        size = square / determined
        left = max(1.0 - determined / independent, 0.1)
        strength = float(np.clip(p * misfit / left / independent / size, *_BOUNDS))
    return replace(place, strength=strength, size=size)
