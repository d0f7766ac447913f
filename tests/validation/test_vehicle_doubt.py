"""A wrong vehicle: what its variants are, and how far they move coefficients."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.fit import empty_fit
from hydrodamp.status import Status
from hydrodamp.validation.sensitivity import variants, vehicle_sensitivity
from hydrodamp.vehicle.mass import rigid_body_mass_matrix

LINEAR = hd.catalog["linear"]


def words(vehicle):
    return [what for what, _ in variants(vehicle)]


def test_each_number_is_moved_alone(vehicle):
    mass, added, trim, center = (moved for _, moved in variants(vehicle))
    full, part = vehicle.mass_matrix, vehicle.added_mass
    for way, one in zip((-0.1, 0.1), mass, strict=True):
        np.testing.assert_allclose(one.mass_matrix, full + way * (full - part), atol=1e-12)
        assert (one.weight, one.buoyancy) == (vehicle.weight, vehicle.buoyancy)
    for way, one in zip((-0.1, 0.1), added, strict=True):
        np.testing.assert_allclose(one.mass_matrix, full + way * part, atol=1e-12)
    less, more = trim
    assert less.weight - less.buoyancy == pytest.approx(-0.001 * vehicle.weight)
    assert more.weight - more.buoyancy == pytest.approx(0.001 * vehicle.weight)
    np.testing.assert_array_equal(less.mass_matrix, full)
    np.testing.assert_allclose(
        [one.center_of_gravity for one in center],
        [0.9 * vehicle.center_of_gravity, 1.1 * vehicle.center_of_gravity],
    )


def test_the_center_moves_the_coupling_of_the_rigid_body():
    """m S(r_G), as rigid_body_mass_matrix makes it with the other center."""
    vehicle = hd.fleet["vt690"]
    more = list(variants(vehicle))[3][1][1]
    rigid = rigid_body_mass_matrix(47.556, (0.187, 14.933, 14.933), 1.1 * np.array([0, 0, 0.0083]))
    np.testing.assert_allclose(more.mass_matrix, rigid + vehicle.added_mass, atol=1e-9)


def test_what_cannot_be_moved_is_left_out(vehicle):
    neutral = replace(vehicle, center_of_gravity=(0, 0, 0), added_mass=None)
    assert words(neutral) == ["mass and added mass ±10 %", "W - B ±0.47 N"]
    planar = replace(vehicle, axes=("X", "Y", "N"), added_mass=np.zeros((6, 6)))
    assert words(planar) == ["mass ±10 %", "r_G ±10 %"]
    unsplit = list(variants(replace(vehicle, added_mass=None)))[-1][1][0]
    np.testing.assert_array_equal(unsplit.mass_matrix, vehicle.mass_matrix)
    heavy = replace(vehicle, weight=vehicle.buoyancy + 20.0)
    assert words(heavy)[2] == "W - B ±2 N"


def test_an_error_of_the_mass_goes_into_the_damping(exact_log, vehicle):
    """Surge alone: M_11 du = K u + X, so a tenth of m du, fitted by u, is what K moves by."""
    free = replace(vehicle, axes=("X",), added_mass=0.2 * vehicle.mass_matrix)
    damping = hd.Damping(LINEAR, (-30 * np.eye(6)).ravel())
    log = exact_log(damping, n=900)
    model = hd.DampingModel.from_table({"X": "u"}, key="surge")
    doubt = vehicle_sensitivity(free, log, log, model, hd.LeastSquares())
    u, du = log.velocity[:, 0], log.acceleration[:, 0]
    before = hd.identify(model, free, log, hd.LeastSquares()).damping
    move = abs(0.08 * vehicle.mass_matrix[0, 0] * (u @ du) / (u @ u))
    mass = doubt.effects[0]
    assert mass.label == "X_u"
    assert mass.wrench_share == pytest.approx(move / abs(before["X_u"]), rel=1e-9)
    assert mass.standard_errors == pytest.approx(move / np.sqrt(before.covariance[0, 0]), rel=1e-9)
    assert doubt.rms is not None
    assert mass.rms is not None
    assert [effect.change[:4] for effect in doubt.effects] == ["mass", "adde", "r_G "]


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(duration=20.0)


class Blind:
    """A method that finds no number, or none that it can vouch for."""

    key = "blind"

    def __init__(self, usable):
        self.usable = usable

    def identify(self, problem, model):
        free = model.restricted_to(problem.vehicle.axes)
        empty = empty_fit(problem, free, self.key, Status.FAILED)
        still = replace(empty.damping, coefficients=np.zeros(free.n_coefficients))
        return replace(empty, damping=still, status=Status.OK) if self.usable else empty


@pytest.mark.slow
def test_a_method_that_fails_or_knows_no_covariance(campaign):
    logs = campaign.train, campaign.test
    doubt = vehicle_sensitivity(campaign.vehicle, *logs, LINEAR, Blind(usable=False))
    assert str(doubt).count("nothing could be identified") == 4
    doubt = vehicle_sensitivity(campaign.vehicle, *logs, LINEAR, Blind(usable=True))
    assert {effect.standard_errors for effect in doubt.effects} == {None}
    assert {effect.wrench_share for effect in doubt.effects} == {0.0}
