"""The operating box: from a log, by hand, and what is no box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipation.operating_box import OperatingBox, operating_box

LINEAR = hd.catalog["linear"]


@pytest.fixture
def boxed(vehicle, exact_log, true_damping):
    def build(forward: float, **options: float) -> tuple[hd.Problem, OperatingBox]:
        log = exact_log(true_damping(LINEAR), forward=forward)
        problem = hd.prepare(vehicle, log, LINEAR)
        return problem, operating_box(problem, **options)

    return build


def test_under_way_the_box_keeps_away_from_rest(boxed):
    problem, box = boxed(3.0)
    low, high = np.quantile(problem.inputs.velocity[:, 0], [0.01, 0.99])
    assert box.low[0] == pytest.approx(0.75 * low)
    assert box.high[0] == pytest.approx(1.25 * high)
    assert box.nearest[0] == box.low[0] > 0.0


def test_a_hovering_vehicle_has_a_box_around_rest(boxed):
    _, box = boxed(0.0)
    np.testing.assert_array_equal(box.low, -box.high)
    assert not box.nearest.any()


def test_astern_is_under_way_too(boxed):
    _, box = boxed(-3.0)
    assert box.low[0] < box.high[0] < 0.0
    assert box.nearest[0] == -box.high[0]
    assert box.extent[0] == -box.low[0]


def test_all_but_surge_are_symmetric(boxed):
    _, box = boxed(3.0)
    np.testing.assert_array_equal(box.low[1:], -box.high[1:])


def test_an_outlier_does_not_set_the_box(vehicle, exact_log, true_damping, boxed):
    problem, box = boxed(3.0)
    velocity = problem.log.velocity.copy()
    velocity[100] = 40.0
    log = replace(problem.log, velocity=velocity)
    other = operating_box(hd.prepare(vehicle, log, LINEAR))
    np.testing.assert_allclose(other.extent, box.extent, rtol=0.05)
    wild = operating_box(hd.prepare(vehicle, log, LINEAR), tail=0.0)
    assert wild.high[1] == pytest.approx(50.0)


def test_locked_velocities_have_no_interval(vehicle, exact_log, true_damping):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    box = operating_box(hd.prepare(planar, exact_log(true_damping(LINEAR)), LINEAR))
    np.testing.assert_array_equal(box.extent > 0, [True, True, False, False, False, True])
    assert "w" not in str(box)


def test_bounds_count_as_inside():
    box = OperatingBox([1, -1, -1, -1, -1, -1], [2, 1, 1, 1, 1, 1])
    inside = box.contains([[1, 1, 0, 0, 0, 0], [0.9, 0, 0, 0, 0, 0]])
    np.testing.assert_array_equal(inside, [True, False])
    np.testing.assert_array_equal(box.at(np.full((1, 6), 0.5)), [[1.5, 0, 0, 0, 0, 0]])


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ([0] * 5, [1] * 6, "`low` must have shape"),
        ([0, 2, 0, 0, 0, 0], [1] * 6, "got v from 2 to 1"),
        ([0] * 6, [1, 1, np.inf, 1, 1, 1], "got w from 0 to inf"),
    ],
)
def test_what_is_no_box(low, high, said):
    with pytest.raises(hd.MethodError, match=said):
        OperatingBox(low, high)


@pytest.mark.parametrize("options", [{"tail": 0.5}, {"tail": -0.1}, {"widening": 1.0}])
def test_shares_are_shares(boxed, options):
    with pytest.raises(hd.MethodError, match="`tail` must be at least 0"):
        boxed(3.0, **options)
