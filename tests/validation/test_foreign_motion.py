"""A log whose motion is that of a vehicle of another length, by Froude scaling."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.parameters import prepare_study
from hydrodamp.validation.workflow import ModelRequest

SHIP = hd.fleet["kvlcc2"]


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
    assert all("307 m" in text and "22 m radius" in text for text in found)
