"""The functional mock-up unit: valid, and the core's bits in both its kinds."""

import ctypes
import re
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.errors import MethodError
from hydrodamp.export.c99 import FMU, INPUTS, RATES, STATES, open_fmu

from .conftest import PAPER, WIDE, core, needs_compiler, states, write_export

pytest.importorskip("fmpy")
pytestmark = needs_compiler


@pytest.fixture
def hold():
    with ExitStack() as stack:
        yield stack.enter_context


VERSIONS = pytest.mark.parametrize("fmi", ["2.0", "3.0"])


def packed(plant, folder, fmi="2.0"):
    return next(write_export(FMU(fmi), plant, folder).glob("*.fmu"))


@VERSIONS
def test_fmpy_finds_no_fault_with_it(fmi, tmp_path):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(packed(WIDE, tmp_path, fmi))) == []


@VERSIONS
def test_a_unit_has_all_functions_of_its_interface(fmi, tmp_path):
    import fmpy

    path = packed(WIDE, tmp_path, fmi)
    library = ctypes.CDLL(str(next(Path(fmpy.extract(path)).glob("binaries/*/*"))))
    header = Path(fmpy.__file__).with_name("c-code") / f"fmi{fmi[0]}Functions.h"
    asked = set(re.findall(r"\b(fmi\d\w+)TYPE\b", header.read_text()))
    assert len(asked) > 40
    assert [name for name in asked if not hasattr(library, name)] == []


@VERSIONS
@pytest.mark.parametrize("plant", [PAPER, WIDE], ids=["paper", "wide"])
def test_its_rates_are_the_cores_to_the_last_bit(plant, fmi, hold, tmp_path):
    n = 20
    unit, at = hold(open_fmu(packed(plant, tmp_path, fmi))), states(plant, n)
    turned = quaternion_from_euler(np.random.default_rng(0).normal(size=(n, 3)))
    w, x, y, z = turned.T  # as attitude.c has it
    down = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    wanted = core(plant, at._replace(down=np.column_stack(down)))
    rates = []
    for k in range(n):
        inputs = [*at.wrench[k], *at.inputs[k]]
        unit.setReal(range(INPUTS, INPUTS + len(inputs)), inputs)
        unit.setReal(range(STATES, RATES), [*at.velocity[k], 0.0, 0.0, 0.0, *turned[k]])
        rates.append(unit.getReal(range(RATES, RATES + 6)))
    np.testing.assert_array_equal(rates, wanted)


@VERSIONS
def test_co_simulation_is_a_replay_to_the_last_bit(fmi, campaign, hold, tmp_path):
    log, plant = campaign.exact_test.between(0.0, 5.0), PAPER
    unit = hold(open_fmu(packed(plant, tmp_path, fmi)))
    velocity = [log.velocity[0]]
    unit.setReal(range(STATES, RATES), [*log.velocity[0], 0.0, 0.0, 0.0, *unit_quaternion(log)])
    unit.exitInitializationMode()
    for k, length in enumerate(np.diff(log.time).tolist()):
        unit.setReal(range(INPUTS + 6, INPUTS + 9), [log.command(name)[k] for name in plant.inputs])
        unit.doStep(float(log.time[k]), length)
        velocity.append(unit.getReal(range(6)))
    wanted = hd.simulate(plant.vehicle, plant.damping, log, attitude="simulated").velocity
    np.testing.assert_array_equal(velocity, wanted)


def unit_quaternion(log):
    """The first attitude as attitude.c normalises it."""
    w, x, y, z = log.attitude[0].tolist()
    return np.array([w, x, y, z]) / np.sqrt(w * w + x * x + y * y + z * z)


@VERSIONS
def test_another_program_sails_it(fmi, tmp_path):
    from fmpy import simulate_fmu

    path = packed(PAPER, tmp_path, fmi)
    inputs = np.array([(0.0, 2000.0)], dtype=[("time", float), ("input.rpm", float)])
    for kind in ("ModelExchange", "CoSimulation"):
        end = {"stop_time": 60.0, "fmi_type": kind, "output_interval": 1.0, "input": inputs}
        found = simulate_fmu(str(path), output=["velocity.u"], **end)
        assert found["velocity.u"][-1] == pytest.approx(2.0, abs=0.01)  # u_c = 0.001 rpm


def test_a_quaternion_that_grew_is_told_to_the_importer(tmp_path):
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Model, fmi2EventInfo

    path = packed(PAPER, tmp_path)
    place = extract(path, tmp_path / "unit")
    guid = read_model_description(path).guid
    unit = FMU2Model(
        guid=guid, unzipDirectory=place, modelIdentifier="auv_vt690", instanceName="one"
    )
    unit.instantiate()
    unit.setupExperiment()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    info = fmi2EventInfo()
    for length, changed in ((1.0, 0), (1.01, 1)):
        unit.setReal(range(9, 13), [0.6 * length, 0.8 * length, 0.0, 0.0])
        event, _ = unit.completedIntegratorStep()
        unit.fmi2NewDiscreteStates(unit.component, info)
        assert (event, info.valuesOfContinuousStatesChanged) == (changed, changed)
        np.testing.assert_allclose(unit.getReal(range(9, 13)), [0.6, 0.8, 0.0, 0.0], rtol=1e-12)
    unit.freeInstance()


@VERSIONS
def test_model_exchange_keeps_the_quaternion_of_length_one(fmi, tmp_path):
    """A solver of coarse tolerance over a long spiral; the importer has to tell each step."""
    from fmpy import simulate_fmu

    path = packed(PAPER, tmp_path, fmi)
    inputs = np.array(
        [(0.0, 2000.0, 0.2, 0.05)],
        dtype=[("time", float), *((f"input.{x}", float) for x in ("rpm", "rudder", "elevator"))],
    )
    parts = [f"quaternion.{x}" for x in "wxyz"]
    end = {"stop_time": 600.0, "output_interval": 1.0, "input": inputs, "relative_tolerance": 1e-4}
    found = simulate_fmu(str(path), fmi_type="ModelExchange", output=parts, **end)
    length = np.sqrt(sum(found[part] ** 2 for part in parts))
    assert np.abs(found["quaternion.z"]).max() > 0.5  # it turned
    np.testing.assert_allclose(length, 1.0, atol=1e-8)


def test_versions_that_are_not_written_are_refused(refused):
    refused(MethodError, FMU, "1.0")
