"""What is exported: equation 1 as a table, and what cannot leave the house."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.simulation.problem import vehicle_stamp

from .conftest import ALL_ATOMS, RICH, coefficients, core, states


@pytest.mark.parametrize("vehicle", [RICH, hd.fleet["bluerov2-heavy"]], ids=lambda v: v.name)
def test_the_acceleration_is_that_of_the_core(vehicle):
    plant = ExportedPlant.of(vehicle, coefficients(ALL_ATOMS))
    at = states(plant)
    np.testing.assert_allclose(plant.acceleration(at), core(plant, at), rtol=1e-12, atol=1e-12)


def test_a_zero_coefficient_asks_for_no_input():
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "N_r*gain": 0.0, "X_u^2(eta-1)": 0.0})
    plant = ExportedPlant.of(hd.fleet["remus100"], damping)
    assert plant.inputs == hd.fleet["remus100"].commands
    more = hd.Damping.from_dict(None, {"X_u": -1.0, "X_u^2(eta-1)": 2.0})
    assert ExportedPlant.of(hd.fleet["remus100"], more).inputs[-1] == "u_c"


def test_what_cannot_leave_is_told():
    vehicle = hd.fleet["vt690"]
    lost = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_v": np.nan})
    with pytest.raises(hd.ModelError, match="Y_v could not be determined"):
        ExportedPlant.of(vehicle, lost)
    with pytest.raises(hd.ModelError, match="gains of a recorded wrench"):
        ExportedPlant.of(vehicle, hd.Damping.from_dict(None, {"X_actuation_X": 0.1}))
    other = hd.Damping.from_dict(None, {"X_u": -1.0}, vehicle=vehicle_stamp(hd.fleet["remus100"]))
    with pytest.raises(hd.ModelError, match="belong to vehicle 'remus100'"):
        ExportedPlant.of(vehicle, other)
