"""The search of truncated simulation error: damped Gauss-Newton on windows that grow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.conditioning.derivatives import differences_from_centre, fit_local_polynomials
from hydrodamp.identification.differentiation import (
    median_step,
    noise_variance,
    regressor_mean_square,
    smooth_velocity,
)
from hydrodamp.identification.dissipativity import (
    PowerRows,
    sample_box as spread_over,
    velocity_box,
)
from hydrodamp.identification.har_covariance import Bins
from hydrodamp.identification.multiple_shooting import (
    Windows,
    concatenate_bounds,
    sample_indices,
    split_windows,
)
from hydrodamp.identification.qr_factor import solve_axis
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: A standard deviation below this is rounding [m/s, rad/s]; share of the noise that always
#: counts, for its estimate takes fast motion for noise.
_FLOOR, _NOISE = 1e-9, 0.5

#: Steps of a stage. One that takes less than this share off the errors' variance ends a stage
#: before the last, and the last, which has come to rest if its last step took less than the first.
ROUNDS, COARSE, REST = 10, 1e-2, 2e-3

#: Least damping of a step, and how often it is damped more.
DAMPING, _TRIALS = 1e-3, 8

#: Strength of the prior before the data have set it, and its bounds.
_FIRST, _BOUNDS = 0.1, (1e-6, 10.0)

#: Windows that tell for how long errors are alike, and bins of their time.
_LOOKED_AT, _BINS = 32, 2048

#: How far beyond the log damping is to take power, and what weight power fed to the motion has
#: against errors, both as shares of what is usual in the log.
_BEYOND, _FED = 2.0, 10.0

#: Samples of a window that are alike: against so many errors a first velocity counts as one.
_ALIKE = 16.0

#: Strengths of the prior in the regressions that a search may start from, and their steps.
_PRIORS, _ACTIVE = (1e-6, 1e-4, 1e-2, 1.0), 20

#: Residuals of those regressions below this share of the force tell of few data, not of good ones.
_EXACT = 1e-3


class Linearisation(NamedTuple):
    """How windows of one length fit: standard deviations of the errors of each velocity (f,).

    ``normal`` is the normal matrix of the mean square error over the deviations seen before,
    ``moved`` the mean square by which first velocities moved, against their doubt.
    """

    windows: Windows
    spread: FloatArray
    normal: FloatArray
    moved: float


@dataclass(frozen=True, eq=False)
class Iterate:
    """Where a stage ended, over windows of several lengths.

    ``strength`` is that of the prior against the mean square of the errors over their standard
    deviations, ``size`` the mean square of coefficients that it stands for; both per coefficient,
    in units. ``damping`` is that of the next step.
    """

    coefficients: FloatArray
    kinds: tuple[Linearisation, ...]
    strength: float = _FIRST
    size: float = 1.0
    damping: float = DAMPING
    converged: bool = False


@dataclass(frozen=True, eq=False)
class ShootingObjective:
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

    def part(self, stretches: IntArray) -> ShootingObjective:
        """Return the search in some stretches of the log, a segment each."""
        samples, problem = sample_indices(stretches), self.problem
        inputs, segments = problem.inputs.select(samples), concatenate_bounds(stretches)
        some = replace(problem, inputs=inputs, segments=segments)
        return replace(self, problem=some, velocity=self.velocity[samples])

    def windows(self, length: float) -> Windows:
        """Return windows of a length [s], each from near the smoothed velocity."""
        bounds = split_windows(self.problem, length)
        initial_coefficients = self.velocity[bounds[:, 0]]
        return Windows(length, self.problem, self.entries, bounds, initial_coefficients, self.doubt)

    def spread(self, coefficients: FloatArray, windows: Windows) -> FloatArray:
        """Return the standard deviation of the errors of each velocity, starts where they are."""
        return self._deviation(np.mean(windows.errors(coefficients) ** 2, axis=0))

    def _deviation(self, square: FloatArray) -> FloatArray:
        """Return the root of a mean square; noise counts besides, so little is gained below it."""
        return np.asarray(np.sqrt(np.maximum(square, 0.0) + self.noise**2))

    def seen(self, coefficients: FloatArray, windows: Windows, spread: FloatArray) -> Linearisation:
        """See how windows fit, first velocities where errors and doubt are least."""
        normal, square, moved = windows.linear(coefficients, spread)
        return Linearisation(windows, self._deviation(square), normal, moved)

    def wider(self, place: Iterate, windows: Windows) -> Iterate:
        """Return the same coefficients over windows of one length more."""
        spread = self.spread(place.coefficients, windows)
        new = self.seen(place.coefficients, windows, spread)
        return replace(place, kinds=(*place.kinds, new))

    def at(self, coefficients: FloatArray, place: Iterate) -> Iterate:
        """Return the place of other coefficients, errors weighed as at the place before."""
        kinds = tuple(self.seen(coefficients, one.windows, one.spread) for one in place.kinds)
        return replace(place, coefficients=coefficients, kinds=kinds)

    def cost(self, place: Iterate) -> float:
        """Return what a search makes small: errors, coefficients, and power fed to the motion."""
        misfit = 2.0 * float(np.mean([np.log(one.spread) for one in place.kinds]))
        moved = float(np.mean([one.moved for one in place.kinds]))
        return misfit + moved + self.price(place.coefficients, place.strength)

    def price(self, coefficients: FloatArray, strength: float) -> float:
        """Return the part of the cost that coefficients have whatever the errors."""
        x = coefficients / self.unit
        fed = _FED * float(np.mean(np.maximum(self.power @ x, 0.0) ** 2))
        return strength * float(np.mean(x**2)) + fed

    def normal(self, place: Iterate) -> tuple[FloatArray, FloatArray]:
        """Return half the curvature and slope of the errors' cost, for coefficients in units."""
        normal = np.mean([one.normal for one in place.kinds], axis=0)
        return normal[:-1, :-1] * self.unit[:, None] * self.unit, normal[:-1, -1] * self.unit

    def feeding(self, x: FloatArray) -> FloatArray:
        """Return the curvature of half the cost of feeding, where coefficients in units are."""
        rows = self.power[self.power @ x > 0.0]
        return np.asarray(_FED / len(self.power) * (rows.T @ rows))


def make_objective(problem: Problem, model: DampingModel) -> ShootingObjective:
    """Set up the search for a model's coefficients."""
    entries = problem.equations.entries(model)
    rows, axes = entries
    inputs, free = problem.inputs, problem.vehicle.free
    velocity, _, risk = smooth_velocity(problem)
    doubt = np.maximum(np.sqrt(risk / _ALIKE)[free], _FLOOR)
    noise = np.maximum(_NOISE * np.sqrt(noise_variance(problem))[free], _FLOOR)
    slopes = fit_local_polynomials(
        inputs.time, problem.segments, differences_from_centre(inputs.velocity), 15, degree=3
    ).slope
    forces = np.sqrt(np.mean((slopes @ problem.vehicle.mass_matrix.T) ** 2, axis=0))
    force = forces[axes]
    size = np.sqrt(regressor_mean_square(problem))[rows - problem.equations.n_known]
    unit = np.where((size > 0.0) & (force > 0.0), force / np.where(size > 0.0, size, 1.0), 1.0)
    box = velocity_box(velocity, _BEYOND, 0.0).restrict(free)
    usual = float(np.linalg.norm(box.max_abs * forces * free)) or 1.0
    power = PowerRows(model).rows(spread_over(box)) * unit / usual
    return ShootingObjective(problem, entries, velocity, doubt, noise, unit, power)


@factorisation("normal matrix of the weak form")
def initial_candidates(search: ShootingObjective, model: DampingModel) -> list[FloatArray]:
    """Return coefficients of the weak form, more or less small, that hardly feed the motion."""
    triangle = WeakRegression().rows(search.problem).triangle()
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


def best_initial_iterate(
    search: ShootingObjective, first: Sequence[FloatArray], length: float
) -> Iterate:
    """Return the place of the coefficients that replay windows of a length [s] best as they are."""
    windows = search.windows(length)

    def cost(one: FloatArray) -> float:
        return 2.0 * float(np.mean(np.log(search.spread(one, windows)))) + search.price(one, _FIRST)

    return search.wider(Iterate(min(first, key=cost), ()), windows)


def continue_over_lengths(
    search: ShootingObjective, start: Iterate, lengths: Sequence[float]
) -> Iterate:
    """Search from a start over windows of one length, then of one length more each time."""
    place = start
    for number, length in enumerate(lengths, start=1):
        if number > 1:
            place = search.wider(place, search.windows(length))
            place = replace(place, damping=min(place.damping, 1.0))  # stuck there, not here
        rest = REST if number == len(lengths) else COARSE
        place = minimise(search, _evidence(search, place), rest)
    return place


def admissible_lengths(problem: Problem, lengths: Sequence[float]) -> list[float]:
    """Return the lengths [s] up to the first that no segment exceeds, which is that of them all."""
    shorter = [length for length in lengths if length < problem.durations.max()]
    return shorter if len(shorter) == len(lengths) else [*shorter, np.inf]


@factorisation("normal matrix of the windows")
def minimise(
    search: ShootingObjective, place: Iterate, rest: float, rounds: int = ROUNDS
) -> Iterate:
    """Take damped Gauss-Newton steps to the likeliest errors, until one promises or gains little.

    Errors of each velocity over windows of each length have a variance of their own, unknown: the
    logarithm of their mean square counts, which asks for no weights. After Nielsen (1999), a step
    is damped as well as the one before kept what it promised.
    """
    p, damping, settled = len(search.unit), place.damping, False
    before = search.cost(place)
    for _ in range(rounds):
        x = place.coefficients / search.unit
        curvature, slope = search.normal(place)
        other = place.strength / p * np.eye(p) + search.feeding(x)
        curvature, slope = curvature + other, slope - other @ x
        promised = float(slope @ np.linalg.solve(curvature, slope))
        if settled := promised < rest:
            break
        factor = 2.0
        for _ in range(_TRIALS):
            step = np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)
            tried = search.at((x + step) * search.unit, place)
            after = search.cost(tried)
            if after < before:
                break
            damping, factor = factor * damping, 2.0 * factor
        else:
            break
        gained = before - after
        # a step that was damped to nothing gains little anywhere
        settled = gained < COARSE and (damping <= 1.0 or promised < COARSE)
        kept = gained / float(step @ (2.0 * slope - curvature @ step))
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * kept - 1.0) ** 3), DAMPING)
        place, before = tried, after
        if gained < rest:
            break
    return replace(place, converged=settled, damping=damping)


@factorisation("normal matrix of the windows")
def _evidence(search: ShootingObjective, place: Iterate) -> Iterate:
    """Return the place with the strength of the prior that the data ask for (MacKay 1992).

    Errors of a replay are alike for seconds: they count as often as they are independent.
    """
    windows, spread = place.kinds[-1].windows, place.kinds[-1].spread
    some = windows.select(slice(None, None, -(-len(windows.bounds) // _LOOKED_AT)))
    errors = some.errors(place.coefficients)
    number = np.repeat(np.arange(len(some.spans)), np.diff(some.spans, axis=1).ravel())
    bins = Bins.of(number, search.problem.inputs.time[some.samples], _BINS)
    sums, step = bins.sums(errors), median_step(search.problem)
    alike = [max(bins.correlation_time(one[:, None]) / step, 1.0) for one in sums.T]
    independent = search.problem.n_samples * float(np.sum(1.0 / np.array(alike)))
    misfit = float(np.mean(1.0 - (search.noise / spread) ** 2))
    told = np.maximum(np.linalg.eigvalsh(search.normal(place)[0]), 0.0)
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
