"""Score tests of terms that a model lacks, on the innovations of the filter.

With the sensitivities of the innovations on the coefficients of the model and on those of further
terms at zero, their Gram matrix is ``[[H₁₁, H₁₂], [H₂₁, H₂₂]]`` and their scores are g₁ and g₂.
After the model is eliminated, ``g = g₂ − H₂₁ H₁₁⁻¹ g₁`` and ``H = H₂₂ − H₂₁ H₁₁⁻¹ H₁₂``. The
autocorrelations of the innovations test the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from hydrodamp.arrays import FloatArray, factorisation
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.identification.adequacy import MIN_PROBABILITY, ScoreTest
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.prediction_error import spread_runs
from hydrodamp.identification.rebuilt_outputs import fix_parameters
from hydrodamp.models.catalog import PAPER_MODELS, catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Smallest information of a term that the model and other terms do not have, over all of its own.
MIN_INFORMATION = 1e-6

#: Samples of the tests: shares of a hundredth are found in these.
MAX_SAMPLES = 4000

#: Lags of the autocorrelation of innovations.
N_LAGS = 20

#: Terms named on an axis.
MAX_NAMED = 2


def further_terms(model: DampingModel, commands: Sequence[str] = ()) -> DampingModel:
    """Return the terms of the paper's models, and those with commands on every axis.

    They are the model's, and linear ones of further commands. An axis that has all terms gets the
    products of two velocities.
    """
    driven = [term for term in model.basis if term.commands]
    driven += [Term.parse(command) for command in commands]
    products = [
        Term.parse(first + second)
        for first in VELOCITIES
        for second in (*VELOCITIES, *(f"|{each}|" for each in VELOCITIES))
    ]
    rows = []
    for axis, terms in enumerate(model.terms):
        published = (term for key in PAPER_MODELS for term in catalog[key].terms[axis])
        row = {term for term in (*published, *driven) if term not in terms}
        rows.append(tuple(row or {term for term in products if term not in terms}))
    return DampingModel("further", "", tuple(rows))


def unused_commands(problem: Problem, model: DampingModel) -> list[str]:
    """Return the commands of a log that neither the vehicle nor the model uses."""
    used = {name for term in model.basis for name in term.commands} | set(problem.vehicle.commands)
    return [name for name in problem.log.command_names if name not in used]


def score_further_terms(
    objective: ShootingObjective, result: Iterate, model: DampingModel
) -> dict[str, ScoreTest]:
    """Return the score test of each axis at an estimate."""
    fixed, at = fix_parameters(objective, result)
    further = further_terms(model, unused_commands(fixed.problem, model))
    further = further.restricted_to(fixed.problem.vehicle.axes)
    problem = fixed.problem.extend_to(model, further)
    entries = tuple(map(np.append, *map(problem.equations.entries, (model, further))))
    extended = replace(fixed, problem=problem, entries=entries)
    runs = extended.restrict(spread_runs(extended, MAX_SAMPLES))
    estimate = at.linearisations[-1]
    windows = runs.windows_like(estimate.windows)
    p, n = len(at.coefficients), runs.problem.n_samples
    theta = np.append(at.coefficients, np.zeros(further.n_coefficients))
    normal = windows.linearise(theta, estimate.residual_std)[0] * n * len(estimate.residual_std)
    scores, information, shares = _eliminate(normal, p)
    labels, axes = np.array(further.labels), entries[1][p:]
    tests = {}
    for axis in np.unique(axes[shares > MIN_INFORMATION]).tolist():
        index = np.flatnonzero((axes == axis) & (shares > MIN_INFORMATION))
        statistic, rank = _statistic(scores[index], information[np.ix_(index, index)])
        tests[AXES[axis]] = ScoreTest(statistic, rank, n)
    return {
        axis: replace(test, terms=_name(scores, information, axes == AXES.index(axis), labels))
        if test.rejects(len(tests))
        else test
        for axis, test in tests.items()
    }


def correlate_innovations(objective: ShootingObjective, result: Iterate) -> dict[str, float]:
    """Return the sum of squared autocorrelations of each velocity beyond that of white innovations.

    White ones exceed it with a probability of ``MIN_PROBABILITY`` on all axes. It is empty where
    the minimisation did not converge, or the filter diverged.
    """
    windows, residual_std, *_ = result.linearisations[-1]
    rows = []
    for linearised, innovations in windows.optimal_residuals(result.coefficients, residual_std):
        if not (result.converged and linearised.columns.any(axis=1).all()):
            return {}
        rows.append(innovations)
    series = np.concatenate(rows).reshape(-1, len(residual_std))
    power = np.sum(series**2, axis=0)
    correlations = [np.sum(series[k:] * series[:-k], axis=0) / power for k in range(1, N_LAGS + 1)]
    white = chdtri(N_LAGS, MIN_PROBABILITY / len(residual_std)) / len(series)
    excess = np.sum(np.square(correlations), axis=0) - white
    return dict(zip(objective.problem.vehicle.axes, excess.tolist(), strict=True))


@factorisation("information of the coefficients")
def _eliminate(normal: FloatArray, p: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return g, H and the share of H in the information of each term, all of unit information."""
    scale = np.sqrt(np.diag(normal)[:-1])
    scale = np.where(scale > 0.0, scale, 1.0)
    gram, scores = normal[:-1, :-1] / np.outer(scale, scale), normal[:-1, -1] / scale
    gains = np.linalg.pinv(gram[:p, :p], rcond=MIN_INFORMATION**2, hermitian=True) @ gram[:p, p:]
    information = gram[p:, p:] - gram[p:, :p] @ gains
    return scores[p:] - scores[:p] @ gains, information, np.diag(information)


def _statistic(scores: FloatArray, information: FloatArray) -> tuple[float, int]:
    """Return g' H⁻¹ g and the rank of H."""
    values, vectors = np.linalg.eigh(information)
    is_free = values > MIN_INFORMATION
    return float(np.sum((scores @ vectors)[is_free] ** 2 / values[is_free])), int(is_free.sum())


def _name(
    scores: FloatArray, information: FloatArray, on_axis: FloatArray, labels: FloatArray
) -> tuple[str, ...]:
    """Return the terms of an axis that lower the cost most, one after the other."""
    names, remaining = [], np.where(on_axis)[0]
    g, h = scores[remaining].copy(), information[np.ix_(remaining, remaining)].copy()
    for _ in range(min(MAX_NAMED, len(g))):
        diagonal = np.diag(h)
        is_free = diagonal > MIN_INFORMATION
        gain = np.where(is_free, g**2 / np.where(is_free, diagonal, 1.0), 0.0)
        best = int(np.argmax(gain))
        names.append(str(labels[remaining[best]]))
        column = h[:, best] / h[best, best]
        g, h = g - column * g[best], h - np.outer(column, h[best])
    return tuple(names)
