"""Dead time and first-order lag of commands, from the residuals of the weak form.

For commands with a dead time d and a lag T, e_ij(d, T) is the residual of equation 1 in the mean
over test function i, on axis j, with the coefficients of least squares. With the log-density
``l_i = −½ Σ_j (log s_j² + e_ij²/s_j²)``, s_j² the mean of e_ij² over i, the estimate maximises
``L = Σ_i l_i``. Over B pieces of the log, with scores g_b = ∂l_b/∂(d, T) and H = −∂²L/∂(d, T)²,
the covariance is ``H⁻¹ (Σ_b g_b g_bᵀ) H⁻¹`` (Godambe 1960); the intervals add the resolution, since
noise of the velocities in the terms shifts the estimate by a part of a step. A response is
significant if the log-likelihood ratio ``Δ_b`` of the pieces to no response has a mean of more than
three standard errors (Vuong 1989) and an interval excludes zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.actuator_response import apply_delay, apply_first_order_lag
from hydrodamp.conditioning.interpolation import set_interpolation
from hydrodamp.data.log import Log
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.fit import MAX_BLOCKS, MIN_BLOCKS
from hydrodamp.identification.weak_form import WeakRegression, select_support
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: What can be estimated.
PARAMETERS = ("lag", "delay")

#: Trial values over the time scale of the motion; the last is the largest estimate.
RELATIVE_GRID = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 1.0)

#: Resolution over the time scale of the motion; a log resolves no less than half a step.
RELATIVE_RESOLUTION, RESOLUTION_STEPS = 0.02, 0.5

#: Standard errors of the mean log-likelihood ratio from which a response is significant.
MIN_SIGNIFICANCE = 3.0

#: Quantile of a 95 % confidence interval.
QUANTILE_95 = 1.96

_STEPS = {"lag": apply_first_order_lag, "delay": apply_delay}
_WORDS = {"lag": "first-order lag", "delay": "dead time"}


@dataclass(frozen=True)
class CommandResponse:
    """Dead time and first-order lag of commands, with 95 % confidence intervals.

    Attributes
    ----------
    commands : tuple of str
        The commands, which share the response.
    estimates : dict of str to float
        ``lag``, ``delay`` or both [s].
    intervals : dict of str to tuple of two floats
        95 % confidence interval of each [s], not below zero.
    significance : float
        Mean log-likelihood ratio to no response, over pieces of the log, in standard errors.

    Examples
    --------
    >>> print(CommandResponse(("rudder",), {"lag": 0.2}, {"lag": (0.18, 0.22)}, 9.0))
    first-order lag of `rudder`: 0.2 s (95 % confidence interval 0.18 to 0.22 s)
    """

    commands: tuple[str, ...]
    estimates: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    significance: float

    @property
    def is_significant(self) -> bool:
        """Whether the residuals reject commands without a response, and an interval excludes 0."""
        resolved = any(low > 0.0 for low, _ in self.intervals.values())
        return resolved and self.significance >= MIN_SIGNIFICANCE

    def apply(self, log: Log) -> Log:
        """Return a log whose commands have the response; the log itself if not significant."""
        return respond(log, self.commands, self.estimates) if self.is_significant else log

    def __str__(self) -> str:
        """Return one sentence."""
        names = " ".join(f"`{name}`" for name in self.commands)
        if not self.is_significant:
            words = " or ".join(_WORDS[name] for name in self.estimates)
            return f"{names}: no significant {words}"
        sentences = (
            f"{_WORDS[name]} of {names}: {value:.3g} s (95 % confidence interval "
            f"{self.intervals[name][0]:.3g} to {self.intervals[name][1]:.3g} s)"
            for name, value in self.estimates.items()
        )
        return "; ".join(sentences)

    @property
    def mapping_steps(self) -> str:
        """The steps of a mapping that apply the response."""
        steps = []
        for name, value in self.estimates.items():
            table = ", ".join(f"{command}: {value:.3g}" for command in self.commands)
            steps += [f"{_STEPS[name].__name__}: {{{table}}}"] if value > 0.0 else []
        return ", ".join(steps)


def estimate_command_response(
    problem: Problem,
    model: DampingModel,
    parameters: Sequence[str] = ("lag",),
    commands: Sequence[str] | None = None,
) -> CommandResponse:
    """Estimate a dead time and a first-order lag of commands from the residuals of the weak form.

    Parameters
    ----------
    problem : Problem
        Vehicle and log, prepared for the model.
    model : DampingModel
        Its coefficients are estimated anew for every trial value.
    parameters : sequence of str, optional
        ``lag``, ``delay`` or both.
    commands : sequence of str, optional
        Commands that share the response; by default all that the vehicle or the model uses.

    Returns
    -------
    response : CommandResponse
        Estimates from zero to the correlation time of the velocities.

    Raises
    ------
    MethodError
        If a parameter is unknown, no command is used, or the log is too short.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> model, campaign = hd.catalog["linear"], hd.reenact(seed=1, duration=40.0)
    >>> problem = hd.prepare(campaign.vehicle, campaign.train, model)
    >>> print(estimate_command_response(problem, model))
    `rudder` `elevator` `rpm`: no significant first-order lag
    """
    unknown = [name for name in parameters if name not in PARAMETERS]
    demand(not unknown and len(parameters) > 0, "parameters", "lag, delay or both", parameters)
    return _maximise(_ResponseResiduals.of(problem, model, parameters, commands))


def _maximise(residuals: _ResponseResiduals) -> CommandResponse:
    """Return the response of the largest likelihood."""
    from scipy.optimize import minimize

    parameters = residuals.parameters
    time_scale, resolution = residuals.time_scale, residuals.resolution
    grid = product([each * time_scale for each in RELATIVE_GRID], repeat=len(parameters))
    start = max(grid, key=lambda trial: residuals.log_likelihood(trial).sum())
    simplex = np.vstack([start, np.add(start, resolution * np.eye(len(start)))])
    options: Any = {"initial_simplex": simplex, "xatol": 0.02 * resolution, "fatol": 1e-3}

    def cost(trial: FloatArray) -> float:
        return -float(residuals.log_likelihood(tuple(trial.tolist())).sum())

    bounds = [(0.0, time_scale)] * len(start)
    optimum = minimize(cost, np.array(start), method="Nelder-Mead", bounds=bounds, options=options)
    best = tuple(float(value) for value in optimum.x)
    error = np.hypot(QUANTILE_95 * residuals.standard_errors(best), resolution)
    low, high = np.maximum(np.subtract(best, error), 0.0).tolist(), np.add(best, error).tolist()
    return CommandResponse(
        residuals.commands,
        dict(zip(parameters, best, strict=True)),
        dict(zip(parameters, zip(low, high, strict=True), strict=True)),
        residuals.compare(residuals.respond(best)),
    )


def respond(log: Log, commands: Sequence[str], estimates: dict[str, float]) -> Log:
    """Return a log whose commands have a dead time and a lag [s]."""
    for name, seconds in estimates.items():
        if seconds > 0.0:
            log = _STEPS[name](log, dict.fromkeys(commands, seconds))
    return log


def response_remarks(problem: Problem, model: DampingModel) -> list[str]:
    """Return a sentence on the lag of the commands if it is significant."""
    try:
        residuals = _ResponseResiduals.of(problem, model, ("lag",), None)
    except MethodError:
        return []
    # a lag of the resolution improves the residuals where there is a longer one
    if residuals.compare(residuals.respond((residuals.resolution,))) < MIN_SIGNIFICANCE:
        return []
    response = _maximise(residuals)
    if not response.is_significant:
        return []
    return [
        f"The residuals indicate a {response}: write `steps: [{response.mapping_steps}]` in the "
        "mapping, or use `identify --estimate lag`."
    ]


def interpolation_remarks(problem: Problem, model: DampingModel) -> list[str]:
    """Return a sentence for wrench and commands if the other interpolation fits the motion."""
    log, remarks = problem.log, []
    changes: list[tuple[str, str, Log]] = []
    if log.wrench is not None:
        changes.append(("wrench", "held", set_interpolation(log, wrench="held")))
    if log.command_names:
        changes.append(("commands", "linear", set_interpolation(log, commands="linear")))
    try:
        residuals = _ResponseResiduals.of(problem, model, (), ())
    except MethodError:
        return []
    for name, value, changed in changes:
        if residuals.compare(changed) >= MIN_SIGNIFICANCE:
            words = {"held": "held from sample to sample", "linear": "linear between samples"}
            remarks.append(
                f"the motion fits {name} {words[value]}: write `steps: [set_interpolation: "
                f"{{{name}: {value}}}]` in the mapping."
            )
    return remarks


@dataclass(frozen=True, eq=False)
class _ResponseResiduals:
    """Weak-form residuals of one model as a function of the response of the commands."""

    problem: Problem
    model: DampingModel
    parameters: tuple[str, ...]
    commands: tuple[str, ...]
    support: float
    time_scale: float

    @classmethod
    def of(
        cls,
        problem: Problem,
        model: DampingModel,
        parameters: Sequence[str],
        commands: Sequence[str] | None,
    ) -> _ResponseResiduals:
        """Select the test functions; raise if there are no commands, or too few samples."""
        model = model.restricted_to(problem.vehicle.axes)
        problem = replace(problem, models=(model,)).with_log(problem.log)
        used = problem.used_commands if commands is None else tuple(commands)
        if parameters and not used:
            raise MethodError("neither the vehicle nor the model uses a command of the log")
        velocity = problem.inputs.velocity[:, problem.vehicle.free]
        time_scale = motion_time_scale(problem.inputs.time, velocity, problem.segments)
        support, _ = select_support(problem)
        residuals = cls(problem, model, tuple(parameters), used, support, time_scale)
        n_terms = max(map(len, model.terms), default=1)
        if len(residuals.recorded_densities) < MIN_BLOCKS * n_terms:
            raise MethodError("the log is too short to estimate the response of its commands")
        return residuals

    @property
    def resolution(self) -> float:
        """Shortest response that the log resolves [s]."""
        step = float(np.median(self.problem.log.steps))
        return max(RELATIVE_RESOLUTION * self.time_scale, RESOLUTION_STEPS * step)

    @cached_property
    def recorded_densities(self) -> FloatArray:
        """Log-density of each row for the log as recorded."""
        return self.densities(self.problem.log)

    def densities(self, log: Log) -> FloatArray:
        """Return the log-density of each row for a log with other commands or wrench."""
        rows = WeakRegression(self.support).rows(self.problem.with_log(log))
        total = np.zeros(rows.n)
        for axis, terms in enumerate(self.model.terms):
            if not terms or not self.problem.vehicle.free[axis]:
                continue
            design = rows.design[:, [rows.basis.index(term) for term in terms]]
            target = rows.target[:, axis]
            residual = target - design @ np.linalg.lstsq(design, target)[0]
            mean_square = max(float(np.mean(residual**2)), np.finfo(float).tiny)
            total -= 0.5 * (np.log(mean_square) + residual**2 / mean_square)
        return total

    def respond(self, values: tuple[float, ...]) -> Log:
        """Return the log with a response of its commands."""
        estimates = dict(zip(self.parameters, values, strict=True))
        return respond(self.problem.log, self.commands, estimates)

    def log_likelihood(self, values: tuple[float, ...]) -> FloatArray:
        """Return the log-likelihood of each piece of the log (B,)."""
        return _sum_pieces(self.densities(self.respond(values)))

    def compare(self, changed: Log) -> float:
        """Return the mean log-likelihood ratio of a changed log, in standard errors."""
        differences = _sum_pieces(self.densities(changed) - self.recorded_densities)
        error = float(differences.std(ddof=1)) / np.sqrt(len(differences))
        return float(differences.mean()) / error if error > 0.0 else 0.0

    def standard_errors(self, values: tuple[float, ...]) -> FloatArray:
        """Return the standard errors [s]; zero for values below the resolution."""
        at, step = np.array(values), self.resolution
        unit = step * np.eye(len(at))[at >= step]

        @cache
        def evaluate(*point: float) -> FloatArray:
            return self.log_likelihood(point)

        def total(offset: FloatArray) -> float:
            return float(evaluate(*(at + offset)).sum())

        scores = np.array([evaluate(*(at + h)) - evaluate(*(at - h)) for h in unit]) / (2.0 * step)
        hessian = np.zeros((len(unit), len(unit)))
        for i, j in np.ndindex(hessian.shape):
            mean, half = (unit[i] + unit[j]) / 2.0, (unit[i] - unit[j]) / 2.0
            change = total(mean) + total(-mean) - total(half) - total(-half)
            hessian[i, j] = -change / step**2
        error = np.zeros(len(at))
        if len(unit) and np.all(np.linalg.eigvalsh(hessian) > 0.0):
            centred = scores - scores.mean(axis=1, keepdims=True)
            root = np.linalg.solve(hessian, centred)
            error[at >= step] = np.sqrt(np.sum(root**2, axis=1))
        elif len(unit):
            error[at >= step] = np.inf
        return error


def _sum_pieces(values: FloatArray) -> FloatArray:
    """Return the sums (B,) over pieces of about equal numbers of rows."""
    piece = np.arange(len(values)) * MAX_BLOCKS // len(values)
    return np.asarray(np.bincount(piece, values, MAX_BLOCKS), dtype=np.float64)
