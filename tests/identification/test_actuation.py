"""The gain of the known wrench: told where it is wrong, silent where it is right."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.wrench_gains import Gain, check_gains, estimate_gains
from hydrodamp.simulation.checks import actuation, with_gains

PRESTERO = hd.catalog["prestero"]
CAMPAIGN = hd.reenact(seed=0, duration=60.0)
BARE = replace(CAMPAIGN.vehicle, actuators=())


def recorded(log, factor):
    """The log with the wrench of its actuators in the place of their commands."""
    wrench = factor * actuation(CAMPAIGN.vehicle, log)
    return replace(log, wrench=wrench, commands=np.empty((log.n, 0)), command_names=())


def asked(log, vehicle=BARE):
    return {one.axis: one for one in estimate_gains(hd.prepare(vehicle, log, PRESTERO), [PRESTERO])}


def told(log, vehicle=BARE):
    return list(map(str, check_gains(hd.prepare(vehicle, log, PRESTERO), [PRESTERO])))


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.2, 3.0])
def test_without_noise_the_gain_is_what_undoes_the_factor(factor):
    found = asked(recorded(CAMPAIGN.exact_train, factor))
    assert set(found) == set("XYZMN")  # the torque of the propeller is zero
    for one in found.values():
        assert one.value * factor == pytest.approx(1.0, abs=0.03)
        assert one.is_inconsistent == (factor in (0.5, 3.0))


def test_doubtful_is_far_from_one_and_well_known():
    assert all(Gain("X", *each).is_inconsistent for each in ((0.3, 0.27, 0.33), (2.7, 2.43, 2.97)))
    wide, near = [(0.3, 0.01, 0.59), (2.7, 1.95, 3.52)], [(0.5, 0.38, 0.62), (1.6, 1.52, 1.69)]
    assert not any(Gain("X", *each).is_inconsistent for each in wide + near)


def test_noise_alone_makes_no_doubt():
    assert told(recorded(CAMPAIGN.train, 1.0)) == []
    assert told(CAMPAIGN.train, CAMPAIGN.vehicle) == []


def test_a_wrench_of_20_percent_too_much_under_noise():
    surge = asked(recorded(CAMPAIGN.train, 1.2))["X"]
    assert surge.low < 1.0 / 1.2 < surge.high < 1.0


def test_a_wrench_three_times_too_large_is_told_with_its_number():
    (said,) = told(recorded(CAMPAIGN.train, 3.0))
    assert "0.32 (0.31 to 0.34), " in said
    assert "gains of the recorded wrench" in said
    assert set(said.split("`")[1]) >= set("XMN")  # the others' intervals are wide


def test_wrong_actuators_are_named():
    *fins, propeller = CAMPAIGN.vehicle.actuators
    strong = replace(propeller, thrust=3.0 * propeller.thrust)
    (said,) = told(CAMPAIGN.train, replace(CAMPAIGN.vehicle, actuators=(*fins, strong)))
    assert f"gains of the wrench of the actuators of '{CAMPAIGN.vehicle.name}'" in said


def test_nothing_is_asked_of_what_does_not_vary_or_is_an_unknown_already():
    constant = replace(recorded(CAMPAIGN.train, 0.0), wrench=np.ones((CAMPAIGN.train.n, 6)))
    assert asked(constant) == {}
    assert asked(recorded(CAMPAIGN.train.between(0.0, 0.5), 1.0)) == {}  # too short
    log = recorded(CAMPAIGN.train, 3.0)
    freed = with_gains(BARE, log, PRESTERO)
    assert list(check_gains(hd.prepare(BARE, log, freed), [freed])) == []


@pytest.mark.slow
@pytest.mark.parametrize("key", ["ls", "weak", "ridge", "oe"])
def test_free_gains_undo_a_factor_by_every_method_and_in_its_replay(key):
    method, test = hd.find_method(key), recorded(CAMPAIGN.exact_test, 1.2)
    found = []
    for factor in (1.0, 1.2):
        train = recorded(CAMPAIGN.exact_train, factor)
        freed = with_gains(BARE, train, PRESTERO)
        fit = method.identify(hd.prepare(BARE, train, freed), freed)
        gain = np.array([1.0 + fit.damping[f"{axis}_actuation_{axis}"] for axis in "XMN"])
        found.append(factor * gain)
    np.testing.assert_allclose(found[1], found[0], rtol=0.005)
    np.testing.assert_allclose(found[0], 1.0, atol=0.03)
    without = method.identify(hd.prepare(BARE, train, PRESTERO), PRESTERO)
    with_free, as_given = hd.compare([fit, without], BARE, test).rows
    assert with_free.rms < as_given.rms
