"""How many terms: left-out blocks, one standard error, and the price of dissipation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.selection.error_reduction import nested, solved
from hydrodamp.validation.sizing import left_out, price, sized

FREE = np.zeros((1, 6))


def blocks(seed: int = 1, n: int = 20, columns: int = 6) -> FloatArray:
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(n, 30, columns))
    truth = np.array([1.0, -2.0, 0.0, 0.0, 0.0, 0.0])
    target = design @ truth + 0.5 * rng.normal(size=(n, 30))
    rows = np.concatenate([design, target[:, :, None]], axis=2)
    return np.asarray(np.einsum("bij,bik->bjk", rows, rows))


def test_a_block_is_predicted_by_the_others() -> None:
    parts = blocks(n=5)
    chosen = np.array([0, 1, 4])
    errors = left_out(parts, [chosen])
    for number in range(5):
        rest = parts.sum(axis=0) - parts[number]
        kappa = np.append(-solved(rest, chosen), 1.0)
        part = parts[number][np.ix_([*chosen, 6], [*chosen, 6])]
        assert errors[0, number] == pytest.approx(kappa @ part @ kappa)


def test_the_smallest_set_no_worse_than_the_best_is_taken() -> None:
    parts = blocks()
    sets = nested(parts.sum(axis=0), np.arange(6), np.array([], dtype=np.int64))
    found = sized(parts, sets, FREE)
    assert sets[found.place].tolist() == [0, 1]
    assert found.words.startswith("2 coefficients, the smallest of 7 nested models")


def test_a_set_that_can_dissipate_only_at_a_price_gives_way() -> None:
    parts = blocks()
    sets = [np.array([0, 1, 2]), np.array([0, 1])]
    assert sized(parts, sets, FREE).place == 1
    # At this velocity the first two take power only together with the third.
    power = np.array([[1.0, 0.0, -1e4, 0.0, 0.0, 0.0]])
    assert sized(parts, sets, power).place == 0


def test_the_price_is_that_of_a_constrained_solver() -> None:
    normal, power = blocks().sum(axis=0), np.random.default_rng(7).normal(size=(8, 6))
    part, right = normal[:6, :6], normal[:6, 6]

    def cost(kappa: FloatArray) -> float:
        return float(kappa @ part @ kappa - 2.0 * kappa @ right)

    def slope(kappa: FloatArray) -> FloatArray:
        return np.asarray(2.0 * (part @ kappa - right))

    bound = LinearConstraint(power, -np.inf, 0.0)
    best = minimize(
        cost, np.zeros(6), jac=slope, constraints=bound, method="SLSQP", options={"ftol": 1e-12}
    )
    expected = best.fun - cost(solved(normal, np.arange(6)))
    assert expected > 1.0
    assert price(normal, np.arange(6), power) == pytest.approx(expected, rel=1e-5)
