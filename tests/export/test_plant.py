"""What is exported: equation 1 as a table, and what cannot leave the house."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.errors import ModelError
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


def test_gains_of_a_recorded_wrench_scale_the_wrench_of_the_log():
    """Equation 1 with gains of the recorded wrench, and without them under the scaled one."""
    vehicle = hd.Vehicle.from_hull(1.2, 0.17, 17.0)
    time = 0.02 * np.arange(500)
    phase = np.outer(time, np.linspace(0.5, 1.0, 6)) + np.arange(6.0)
    segments = Segment("a", 0, 200), Segment("b", 200, 500)
    log = hd.Log(
        time, 0.1 * np.sin(phase), tuple("uvwpqr"), wrench=np.cos(phase), segments=segments
    )
    gains = {"X_actuation_X": 0.3, "X_actuation_rise_X": 0.9, "N_actuation_N": -1.4}
    drag = {"X_u": -3.0, "N_r": -1.0}
    plant = ExportedPlant.of(vehicle, hd.Damping.from_dict(None, drag | gains), log)
    assert plant.damping.as_dict() == drag
    np.testing.assert_allclose(plant.wrench_gain, [1.3, 1.0, 1.0, 1.0, 1.0, -0.4])
    expected, ungained, scaled = (
        hd.simulate(vehicle, hd.Damping.from_dict(None, numbers), each).velocity
        for numbers, each in ((drag | gains, log), (drag, log), (drag, plant.scale_wrench(log)))
    )
    effect, error = np.abs(expected - ungained), np.abs(expected - scaled)
    assert (error.max(axis=0) <= 2e-3 * effect.max(axis=0)).all()


def test_what_cannot_leave_is_told(refused):
    vehicle = hd.fleet["vt690"]
    lost = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_v": np.nan})
    refused(ModelError, ExportedPlant.of, vehicle, lost)
    gains = hd.Damping.from_dict(None, {"X_actuation_X": 0.1})
    refused(ModelError, ExportedPlant.of, vehicle, gains)
    other = hd.Damping.from_dict(None, {"X_u": -1.0}, vehicle=vehicle_stamp(hd.fleet["remus100"]))
    refused(ModelError, ExportedPlant.of, vehicle, other)
