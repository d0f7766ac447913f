"""Published sets against the numbers of their sources."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ModelError
from hydrodamp.files import parse_yaml
from hydrodamp.identification.methods import cite
from hydrodamp.kernels.core import coriolis
from hydrodamp.models.catalog import added_mass_matrix, coriolis_coefficients


def added_mass_of(name):
    """Return the added mass matrix that a set goes with."""
    return added_mass_matrix(parse_yaml(hd.published.text(name), name)["added_mass"])


@pytest.fixture
def velocity():
    return np.random.default_rng(690).normal(size=(60, 6))


def test_the_sets(refused):
    assert len(hd.published) == len(tuple(hd.published)) == 9
    assert "lauv" in hd.published
    assert "iver" not in hd.published
    refused(ModelError, lambda: hd.published["vt690"])
    refused(ModelError, lambda: hd.published["iver"])


@pytest.mark.parametrize("name", hd.published)
def test_every_set_says_where_it_comes_from_and_fits_a_screen(name):
    damping = hd.published[name]
    assert damping.source
    assert "taken out" in damping.note
    assert len(str(damping).splitlines()) <= 30
    assert cite(damping).startswith("Coefficients: ")


def test_the_expansion_of_a_diagonal_matrix_is_the_textbook_one():
    """The usual diagonal form: m22 vr - m33 wq; ...; (m11-m22) uv + (I11-I22) pq."""
    m11, m22, m33, i1, i2, i3 = 1.0, 2.0, 4.0, 8.0, 16.0, 32.0
    assert coriolis_coefficients(np.diag([m11, m22, m33, i1, i2, i3])) == {
        "X_vr": m22,
        "X_wq": -m33,
        "Y_wp": m33,
        "Y_ur": -m11,
        "Z_uq": m11,
        "Z_vp": -m22,
        "K_vw": m22 - m33,
        "K_qr": i2 - i3,
        "M_uw": m33 - m11,
        "M_pr": i3 - i1,
        "N_uv": m11 - m22,
        "N_pq": i1 - i2,
    }


def test_derivatives_are_negated_and_symmetrised():
    matrix = added_mass_matrix({"Y_rdot": 2.0, "N_vdot": 4.0, "K_pdot": -0.5})
    assert matrix[1, 5] == matrix[5, 1] == -3.0
    assert matrix[3, 3] == 0.5


# Prestero 2001, REMUS 100, as the source has them, added mass in the products.
PRESTERO = {
    "X": {"wq": -35.5, "qq": -1.93, "vr": 35.5, "rr": -1.93, "u|u|": -1.62},
    "Y": {"ur": 5.22, "wp": 35.5, "pq": 1.93, "uv": -28.6, "v|v|": -131.0, "r|r|": 0.632},
    "Z": {"uq": -5.22, "vp": -35.5, "pr": 1.93, "uw": -28.6, "w|w|": -131.0, "q|q|": -0.632},
    "K": {"p|p|": -0.13},
    "M": {"uw": 24.0, "uq": -2.0, "vp": -1.93, "pr": 4.86, "w|w|": 3.18, "q|q|": -9.4},
    "N": {"uv": -24.0, "ur": -2.0, "wp": -1.93, "pq": -4.86, "v|v|": -3.18, "r|r|": -9.4},
}
ADJUSTED = {"Y_v|v|": -1310.0, "M_q|q|": -188.0, "N_r|r|": -94.0}

# SNAME T&R Bulletin 1-45 set, the starred coefficients of the source and the plain lift ones.
# Products that it leaves in its added-mass Coriolis matrix are written as A, symmetrised.
A11, A22, A33, A44, A55, A66 = 13.047, 48.238, 51.7901, 0.741, 14.5177, 14.5316
A26 = -(2.6899 + 3.67588) / 2
A35 = -(0.67173 - 0.776908) / 2
SNAME = {
    "X": {"u|u|": -3.244},  # the source zeroes the products of this row
    "Y": {"ur": 23.6598, "uv": -34.5946, "wp": A33, "pq": A35, "v|v|": -171.825, "r|r|": 45.2878},
    "Z": {"uq": -13.0932, "uw": -36.4678, "vp": -A22, "pr": -A26, "w|w|": -72.497, "q|q|": -11.824},
    "K": {"up": -0.53, "vw": A22 - A33, "wr": A26 + A35, "qr": A55 - A66, "p|p|": -2.64},
    "M": {"uw": 26.0741, "uq": -22.3806, "vp": A26, "w|w|": -3.68259, "q|q|": -25.6784},
    "N": {"uv": -13.0885, "ur": -24.2459, "wp": -A35, "v|v|": 34.1192, "r|r|": -46.5715},
}
MOMENTS = {"K_vq": -(A26 + A35), "M_pr": A66 - A44, "N_pq": A44 - A55}


@pytest.mark.parametrize(
    ("name", "rows", "more"),
    [
        ("remus100-prestero-theory", PRESTERO, {}),
        ("remus100-prestero-adjusted", PRESTERO, ADJUSTED),
        ("vt690-sname2022", SNAME, MOMENTS),
    ],
)
def test_viscous_remainder_and_added_mass_give_the_sources_total(name, rows, more, velocity):
    """K xi + H(A nu) nu equals what the source itself computes at random velocities."""
    total = hd.published[name].wrench(velocity) + coriolis(added_mass_of(name), velocity)
    source = {f"{axis}_{term}": row[term] for axis, row in rows.items() for term in row}
    expected = hd.Damping.from_dict(None, source | more).wrench(velocity)
    np.testing.assert_allclose(total, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", hd.published)
def test_every_set_dissipates_while_under_way(name):
    """Ahead at 0.5-2.5 m/s, drift below 0.1 m/s and rates below 0.1 rad/s."""
    rng = np.random.default_rng(466)
    velocity = rng.uniform(-0.1, 0.1, (2000, 6))
    velocity[:, 0] = rng.uniform(0.5, 2.5, 2000)
    assert hd.published[name].power(velocity).max() < 0.0


def test_cite_names_the_paper_where_its_catalogue_is_used():
    assert "@inproceedings{gibson-mccarter-stilwell-neu" in cite(hd.catalog["linear"])
    assert "@inproceedings" not in cite(hd.published["eca-a9"])
