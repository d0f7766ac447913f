"""Sailing: equation 1 as a replay has it, side by side and in closed loop."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.planning.courses import Pilot
from hydrodamp.planning.helm import helm
from hydrodamp.planning.information import Seen, informed
from hydrodamp.planning.manoeuvres import Manoeuvre
from hydrodamp.planning.sailing import Fleet, passed
from hydrodamp.planning.waters import drawn, known_damping, wide_model


@pytest.fixture(scope="module")
def fleet():
    vehicle, model = hd.fleet["vt690"], hd.catalog["fossen"]
    envelope = hd.Envelope(depth=(3, 20))
    known = known_damping(vehicle, model, None)
    sizes = np.zeros(wide_model(vehicle, model, known).n_coefficients)
    waters = drawn(vehicle, model, known, sizes, 3, seed=1)
    return Fleet.of(vehicle, helm(vehicle, known, envelope), envelope, waters)


@pytest.fixture(scope="module")
def voyage(fleet):
    move = Manoeuvre("steps", 0.5, 0.5, (0.0, 0.3, 0.3, 0.1, 0.1))
    told, overlays = move.orders(fleet.helm, fleet.envelope, 300)
    told[:, 2] += fleet.envelope.middle
    return fleet.sail(
        (np.repeat(told[:, None], 3, axis=1), np.repeat(overlays[:, None], 3, axis=1))
    )


def test_each_vehicle_sails_as_a_replay_of_its_commands_in_its_own_water(fleet, voyage):
    for place, water in enumerate(fleet.waters.dampings):
        log = voyage.part([place]).log(fleet.vehicle, fleet.helm.names, exact=True)
        again = hd.simulate(fleet.vehicle, water, log, attitude="simulated", max_step=0.02)
        assert np.abs(again.velocity - log.velocity).max() < 1e-4


def test_the_autopilot_follows_what_it_is_told(fleet, voyage):
    calm, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).orders(
        fleet.helm, fleet.envelope, 400
    )
    calm += (0.0, np.pi - 0.2, 14.0)
    calm[:200, 1:] = (0.2 - np.pi, 11.0)  # the short way is over south
    sailed = fleet.in_waters([0]).sail((calm[:, None], overlays[:, None]))
    turn = np.angle(np.exp(1j * (sailed.states[-1, 0, 8] - calm[-1, 1])))
    assert abs(turn) < 0.02
    assert sailed.states[-1, 0, 11] == pytest.approx(14.0, abs=0.3)
    assert sailed.states[200:, 0, 8].min() < -np.pi + 0.2


def test_courses_that_are_told_turn_slowly_so_that_all_draws_turn_to_one_side(fleet):
    """A step of half a turn, less a degree: the way that is shorter for one is not for another."""
    told, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).orders(
        fleet.helm, fleet.envelope, 300
    )
    told += (0.0, 0.0, fleet.envelope.middle)
    orders = tuple(np.repeat(one[:, None], 3, axis=1) for one in (told, overlays))
    sailed = fleet.sail(orders, 1, lambda place, _: np.radians(179.0) if place > 99 else 0.0)
    rate = np.diff(sailed.told[:, :, 1], axis=0) / sailed.period
    assert np.degrees(np.abs(rate).max()) == pytest.approx(10.0)
    assert np.degrees(sailed.states[-1, :, 8]) == pytest.approx([179.0] * 3, abs=5.0)


def test_courses_are_chosen_from_where_the_vehicles_are():
    """Stretches of 100 m, and of 110 m where 100 were thought, in a square of 300 m."""
    area = hd.Envelope(area={"north": (-150, 150), "east": (-150, 150)}).area
    told = np.tile([2.0, 0.0, 10.0], (12, 500, 1))
    pilot, here, seen = Pilot(area, told, 0.1, np.zeros((12, 1, 1, 2))), np.zeros((2, 2)), []
    for stretch in range(12):
        course = pilot(500 * stretch, here)
        assert pilot(500 * stretch + 5, here + 1.0) == course
        here = here + np.array([[100.0], [110.0]]) * [np.cos(course), np.sin(course)]
        seen.append(np.abs(here).max())
    assert max(seen) < 150.0


def test_limits_are_told_by_how_much_they_are_passed(fleet, voyage):
    narrow = fleet.envelope.model_copy(update={"depth": (9.0, 13.0), "pitch": 5.0})
    far = passed(narrow, voyage)
    depth = voyage.states[:, :, 11]
    assert far["depth"].max() == pytest.approx(max(depth.max() - 13.0, 9.0 - depth.min()) / 4.0)
    assert far["pitch"].max() > 0.0 > passed(fleet.envelope, voyage)["pitch"].max()


def test_information_adds_up_and_falls_with_the_square_of_noise(fleet, voyage):
    noise = fleet.envelope.deviations[:6]
    one, two = (informed(fleet, voyage, Seen.of(k * noise)) for k in (1.0, 2.0))
    assert two == pytest.approx(one / 4.0)
    assert np.linalg.eigvalsh(one).min() > 0.0
    longer = voyage.until(160), voyage
    parts = [np.trace(informed(fleet, some, Seen.of(noise))[0]) for some in longer]
    assert parts[0] < parts[1]
