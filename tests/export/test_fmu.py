"""The functional mock-up unit: valid, and the core's bits in both its kinds."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.export.craft import Craft
from hydrodamp.export.fmu import FMU, INPUTS, RATES, STATES, loaded

from .conftest import ALL_ATOMS, MODELS, RICH, coefficients, core, states, written

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler is installed"
)


def packed(craft, folder):
    return next(written(FMU(), craft, folder).glob("*.fmu"))


def test_fmpy_finds_no_fault_with_it(tmp_path):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(packed(Craft.of(RICH, coefficients(ALL_ATOMS)), tmp_path))) == []


@pytest.mark.parametrize("model", [MODELS[3], ALL_ATOMS], ids=lambda model: model.key)
def test_its_rates_are_the_cores_to_the_last_bit(model, tmp_path):
    craft, n = Craft.of(RICH, coefficients(model)), 20
    unit, at = loaded(packed(craft, tmp_path)), states(craft, n)
    turned = quaternion_from_euler(np.random.default_rng(0).normal(size=(n, 3)))
    w, x, y, z = turned.T  # as attitude.c has it
    down = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    wanted = core(craft, replace(at, down=np.column_stack(down)))
    rates = []
    for k in range(n):
        inputs = [*at.wrench[k], *at.inputs[k]]
        unit.setReal(range(INPUTS, INPUTS + len(inputs)), inputs)
        unit.setReal(range(STATES, RATES), [*at.velocity[k], 0.0, 0.0, 0.0, *turned[k]])
        rates.append(unit.getReal(range(RATES, RATES + 6)))
    np.testing.assert_array_equal(rates, wanted)


def test_co_simulation_is_a_replay_to_the_last_bit(sailed, tmp_path):
    log, damping = sailed.exact_test.between(0.0, 5.0), hd.published["vt690-sname2022"]
    craft = Craft.of(sailed.vehicle, damping)
    unit = loaded(packed(craft, tmp_path))
    velocity = [log.velocity[0]]
    unit.setReal(range(STATES, RATES), [*log.velocity[0], 0.0, 0.0, 0.0, *unit_quaternion(log)])
    unit.exitInitializationMode()
    for k, length in enumerate(np.diff(log.time).tolist()):
        unit.setReal(range(INPUTS + 6, INPUTS + 9), [log.command(name)[k] for name in craft.inputs])
        unit.doStep(float(log.time[k]), length)
        velocity.append(unit.getReal(range(6)))
    wanted = hd.simulate(sailed.vehicle, damping, log, attitude="simulated").velocity
    np.testing.assert_array_equal(velocity, wanted)


def unit_quaternion(log):
    """The first attitude as attitude.c normalises it."""
    w, x, y, z = log.attitude[0].tolist()
    return np.array([w, x, y, z]) / np.sqrt(w * w + x * x + y * y + z * z)


def test_another_program_sails_it(tmp_path):
    from fmpy import simulate_fmu

    path = packed(Craft.of(hd.fleet["vt690"], hd.published["vt690-sname2022"]), tmp_path)
    inputs = np.array([(0.0, 2000.0)], dtype=[("time", float), ("input.rpm", float)])
    for kind in ("ModelExchange", "CoSimulation"):
        end = {"stop_time": 60.0, "fmi_type": kind, "output_interval": 1.0, "input": inputs}
        found = simulate_fmu(str(path), output=["velocity.u"], **end)
        assert found["velocity.u"][-1] == pytest.approx(2.0, abs=0.01)  # u_c = 0.001 rpm


def test_the_card_is_of_the_unit_itself(planar, tmp_path):
    boat, damping, log = planar
    card = hd.export(damping, boat, "fmu", tmp_path / "a", log=log)
    assert card.run_by.startswith("fmpy")
    assert card.replays.source_to_target.rms < 1e-13
