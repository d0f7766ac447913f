"""Dissipative least squares: against the same program written in a modelling language."""

from __future__ import annotations

import numpy as np
import pytest
from interleaving import interleaved
from workload import truth

import hydrodamp as hd
from hydrodamp.identification.dissipation.dissipative_set import DissipativeSet
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power_form import unpacked

UNDER_WAY = OperatingBox([1.4, -0.3, -0.1, -0.1, -0.1, -0.4], [2.9, 0.3, 0.1, 0.1, 0.1, 0.4])
pytestmark = pytest.mark.usefixtures("one_core")


def modelled(wanted: DissipativeSet, point: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Write the matrix inequalities out corner by corner, and let Clarabel solve them."""
    import cvxpy

    form = wanted.corners.form
    size = len(form.velocities)
    kappa = cvxpy.Variable(len(point))
    spread = cvxpy.Variable(max(form.idle.shape[2], 1))
    constraints = []
    for corner in form.corners:
        parts = np.einsum("p,ptn->nt", corner, form.entries)
        idle = np.einsum("p,ptn->nt", corner, form.idle)
        power = kappa @ unpacked(parts, size).reshape(len(parts), -1)
        if len(idle):
            power += spread @ unpacked(idle, size).reshape(len(idle), -1)
        weights = cvxpy.Variable(wanted.corners.bounds.shape[1], nonneg=True)
        bounds = unpacked(wanted.corners.bounds.T, size).reshape(weights.size, -1)
        constraints.append(cvxpy.reshape(power + weights @ bounds, (size, size), order="C") << 0)
    objective = cvxpy.Minimize(cvxpy.sum_squares(root @ (kappa - point)))
    cvxpy.Problem(objective, constraints).solve(solver=cvxpy.CLARABEL)
    return np.asarray(kappa.value)


@pytest.mark.parametrize("key", ["mcfarland-whitcomb", "prestero", "linear"])
def test_against_a_modelling_language(benchmark, ledger, key):
    """The nearest dissipative coefficients of a noisy set, proven at the corners."""
    pytest.importorskip("cvxpy", reason="CVXPY is not installed")
    model = hd.catalog[key]
    rng = np.random.default_rng(0)
    point = truth(model).coefficients + rng.normal(0, 200.0, model.n_coefficients)
    root = np.triu(rng.normal(size=(len(point), len(point)))) + 5.0 * np.eye(len(point))
    found: list[np.ndarray] = []

    def ours() -> np.ndarray:
        return DissipativeSet(model, UNDER_WAY).nearest(point, root).coefficients

    def other() -> None:
        found[:] = [modelled(DissipativeSet(model, UNDER_WAY), point, root)]

    fast, slow = interleaved(benchmark, ours, other, rounds=3)

    one, two = (np.linalg.norm(root @ (each - point)) for each in (ours(), found[0]))
    assert one == pytest.approx(two, rel=1e-4)
    ledger.faster(f"dissipative projection, {key}: CVXPY with Clarabel", fast, slow)
