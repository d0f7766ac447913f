"""Power of damping: linear in the coefficients, a quadratic form, and its worst."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import nnls

import hydrodamp as hd
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import PowerRows, dissipates, worst_power
from hydrodamp.identification.dissipation.power_form import packed, power_form, unpacked

UNDER_WAY = OperatingBox([1, -0.5, -0.2, -0.1, -0.2, -0.4], [3, 0.5, 0.2, 0.1, 0.2, 0.4])
HOVERING = OperatingBox(-UNDER_WAY.high, UNDER_WAY.high)
ASTERN = OperatingBox([-3, *UNDER_WAY.low[1:]], [-1, *UNDER_WAY.high[1:]])


def velocities(box: OperatingBox, n: int = 500, seed: int = 3) -> np.ndarray:
    return box.at(np.random.default_rng(seed).uniform(size=(n, 6)))


@pytest.mark.parametrize("key", list(hd.catalog))
def test_rows_times_coefficients_is_the_power(key, true_damping):
    damping = true_damping(hd.catalog[key])
    rows, nu = PowerRows(damping.model), velocities(UNDER_WAY)
    expected = damping.power(nu)  # at a propulsion ratio of one
    scale = np.abs(expected).max()
    np.testing.assert_allclose(rows.rows(nu) @ damping.coefficients, expected, atol=1e-12 * scale)
    np.testing.assert_allclose(rows.power(damping.coefficients, nu), expected, atol=1e-12 * scale)


@pytest.mark.parametrize(
    ("term", "counted"),
    [
        ("u", True),
        ("V_v|r|", True),
        ("uv(eta-1)", False),
        ("down_y", False),
        ("1", False),
        ("u|u|*rudder", False),
        ("rpm*|rpm|", False),
    ],
)
def test_what_is_damping(term, counted):
    assert dissipates(hd.Term.parse(term)) is counted


@pytest.mark.parametrize("box", [UNDER_WAY, HOVERING, ASTERN])
@pytest.mark.parametrize("key", ["mcfarland-whitcomb", "linear", "coe", "prestero", "fossen"])
def test_the_form_is_the_power_whatever_idle_part_is_added(key, box, true_damping):
    damping = true_damping(hd.catalog[key])
    form = power_form(damping.model, box)
    assert form is not None
    rng = np.random.default_rng(5)
    weights = rng.normal(size=form.idle.shape[2])
    parts = form.entries @ damping.coefficients + form.idle @ weights
    nu = velocities(box)
    kinds = {"one": np.ones_like, "signed": np.array, "absolute": np.abs}
    values = np.stack([kinds[kind](nu[:, place]) for kind, place in form.parameters], axis=1)
    matrices = unpacked(values @ parts, len(form.velocities))
    place = list(form.velocities)
    relative = nu[:, place] / box.extent[place]
    power = np.einsum("mi,mij,mj->m", relative, matrices, relative)
    np.testing.assert_allclose(power, damping.power(nu), atol=1e-10 * np.abs(power).max())


@pytest.mark.parametrize("box", [UNDER_WAY, HOVERING, ASTERN])
@pytest.mark.parametrize("key", ["mcfarland-whitcomb", "coe", "prestero", "fossen"])
def test_every_velocity_lies_between_the_corners(key, box):
    """Parameters are a mean of the corners, or, for a homogeneous form, in their cone."""
    form = power_form(hd.catalog[key], box)
    assert form is not None
    kinds = {"one": np.ones_like, "signed": np.array, "absolute": np.abs}
    nu = velocities(box, 50)
    values = np.stack([kinds[kind](nu[:, place]) for kind, place in form.parameters], axis=1)
    part = slice(0 if form.entries[0].any() else 1, None)
    for value in values[:, part]:
        assert nnls(form.corners[:, part].T, value)[1] < 1e-9


def test_a_signed_parameter_goes_from_bound_to_bound():
    form = power_form(hd.DampingModel.from_table({"Y": "vp u"}, key="made"), UNDER_WAY)
    assert form is not None
    chosen = next(place for kind, place in form.parameters if kind == "signed")
    assert set(form.corners[:, 1]) == {UNDER_WAY.low[chosen], UNDER_WAY.high[chosen]}


def test_products_without_a_velocity_that_keeps_its_sign_leave_a_choice(true_damping):
    form = power_form(hd.catalog["coe"], UNDER_WAY)
    assert form is not None
    assert form.idle.shape[2] > 0


@pytest.mark.parametrize("key", ["gertler-hagen", "uncoupled", "pitch-yaw"])
def test_what_is_no_form(key):
    assert power_form(hd.catalog[key], UNDER_WAY) is None


def test_too_many_corners_are_no_form():
    six = _made("u|u|", "v|v|", "w|w|", "p|p|", "q|q|", "r|r|", *_PRODUCTS)
    assert power_form(six, HOVERING, constant=True) is None


_PRODUCTS = [one + other for one, other in combinations("uvwpqr", 2)]


def _made(*terms: str) -> hd.DampingModel:
    return hd.DampingModel.from_table({"X Y Z K M N": " ".join(terms)}, key="made")


def test_a_velocity_that_never_moves_takes_no_part():
    still = OperatingBox([1, -1, 0, 0, 0, -1], [2, 1, 0, 0, 0, 1])
    form = power_form(hd.catalog["mcfarland-whitcomb"], still)
    assert form is not None
    assert form.velocities == (0, 1, 5)


def test_packing_keeps_the_scalar_product():
    rng = np.random.default_rng(2)
    one, other = (matrix + matrix.T for matrix in rng.normal(size=(2, 4, 4)))
    assert packed(one) @ packed(other) == pytest.approx(np.trace(one @ other))
    np.testing.assert_allclose(unpacked(packed(one)[None], 4)[0], one)


def test_the_worst_power_of_a_quadratic_form_is_at_a_corner():
    """X_v + Y_u = 2 couples: P = -u^2 + 2 u v + v^2 grows with v, falls with u beyond v."""
    damping = hd.Damping.from_dict(None, {"X_u": -1, "X_v": 2, "Y_v": 1})
    box = OperatingBox([1, -3, 0, 0, 0, 0], [4, 3, 0, 0, 0, 0])
    worst = worst_power(damping, box)
    assert worst.power == pytest.approx(-(3.0**2) + 2 * 3 * 3 + 3**2, rel=1e-6)
    np.testing.assert_allclose(np.abs(worst.velocity[:2]), [3, 3], rtol=1e-3)
    assert "W at u 3" in str(worst)


def test_the_worst_power_inside_the_box():
    """P = 3 r^2 - 2 |r|^3, worst at r = 1."""
    damping = hd.Damping.from_dict(None, {"N_r": 3, "N_r|r|": -2})
    box = OperatingBox([0, 0, 0, 0, 0, -2], [0, 0, 0, 0, 0, 2])
    worst = worst_power(damping, box)
    assert worst.power == pytest.approx(1.0, rel=1e-8)
    assert abs(worst.velocity[5]) == pytest.approx(1.0, abs=1e-3)


def test_nothing_is_worse_than_rest_for_damping_that_dissipates():
    worst = worst_power(hd.Damping.from_dict(None, {"X_u": -1, "N_r|r|": -2}), HOVERING)
    assert worst.power == pytest.approx(0.0, abs=1e-6)


def test_the_search_finds_what_dense_sampling_finds(true_damping):
    damping = true_damping(hd.catalog["gertler-hagen"])
    worst = worst_power(damping, UNDER_WAY)
    assert UNDER_WAY.contains(worst.velocity)
    assert worst.power >= damping.power(velocities(UNDER_WAY, 100_000)).max()
    assert worst.power == pytest.approx(float(damping.power(worst.velocity)))
