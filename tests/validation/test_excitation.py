"""Training and test data by the excitation of both, and motion that no vehicle of a length has."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.parameters import prepare_study
from hydrodamp.data.intervals import select_data
from hydrodamp.validation.excitation import propose_split
from hydrodamp.validation.workflow import ModelRequest

SHIP = hd.fleet["kvlcc2"]


def test_a_proposed_split_has_each_manoeuvre_on_both_sides():
    time = np.arange(0.0, 300.0, 0.1)
    roll = np.where((time < 100.0) | (time > 200.0), np.sin(time), 0.0)  # not in the middle
    log = hd.Log.from_arrays(time, {"u": 1.0 + 0.2 * np.sin(0.3 * time), "p": roll})
    sides = propose_split(log, ("X", "K"))
    for side in sides:
        assert max(np.abs(select_data(log, each).velocity[:, 3]).max() for each in side) > 0.9
    assert sum(select_data(log, each).n for each in sides[1]) == pytest.approx(log.n / 3, rel=0.02)


def test_a_proposed_split_tests_a_run_with_the_motion_of_the_others():
    time, logs = np.arange(0.0, 60.0, 0.1), []
    for name, size in (("a", 0.3), ("b", 0.3), ("c", 0.0)):
        motion = {"u": 1.0 + 0.2 * np.sin(time), "p": size * np.cos(time)}
        logs.append(hd.Log.from_arrays(time, motion, source=name))
    train, test = propose_split(hd.concatenate(logs), ("X", "K"))
    assert "c" not in test
    assert len(train) == 2


def zigzag(scale):
    """Return a zigzag of a model of 7 m, scaled."""
    time, pace = np.linspace(0.0, 200.0, 801), np.sqrt(scale)
    phase = 2.0 * np.pi * time / 40.0
    velocity = {"u": 1.2 + 0.1 * np.sin(phase), "v": 0.2 * np.cos(phase)}
    velocity = {name: pace * values for name, values in velocity.items()}
    velocity["r"] = 0.06 * np.sin(phase) / pace
    wrench = np.outer(np.sin(phase), np.ones(6))
    return hd.Log.from_arrays(pace * time, velocity, wrench=wrench)


@pytest.mark.parametrize("scale", [1.0, 45.0])
def test_a_model_in_a_tank_is_not_the_ship(recwarn, scale):
    request = ModelRequest((hd.catalog["linear"],))
    method = (hd.find_method("ls"),)
    prepare_study(SHIP, zigzag(scale), zigzag(scale), request, method, None, None)
    found = [str(each.message) for each in recwarn if "turns in circles of" in str(each.message)]
    assert len(found) == (scale == 1.0)
    assert all("323 m" in text and "22 m radius" in text for text in found)
