"""CasADi's functions: the core's accelerations, derivatives, code, and an example that runs."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.scripts import CasADi, execute_module

from .conftest import ALL_ATOMS, MODELS, RICH, coefficients, core, states, write_export

ca = pytest.importorskip("casadi")


def test_its_jacobian_is_that_of_differences(tmp_path):
    plant = ExportedPlant.of(RICH, coefficients(ALL_ATOMS))
    function = execute_module(
        write_export(CasADi(), plant, tmp_path) / "auv_rich_3.py"
    ).acceleration
    at, step = states(plant, 5), 1e-6
    nu = ca.SX.sym("nu", 6)
    other = [ca.SX.sym("x", len(part.T)) for part in at[1:]]
    slope = ca.Function("slope", [nu, *other], [ca.jacobian(function(nu, *other), nu)])
    for k in range(5):
        rest = [part[k] for part in at[1:]]
        found = np.array(slope(at.velocity[k], *rest))
        for axis, unit in enumerate(step * np.eye(6)):
            ahead, behind = (function(at.velocity[k] + s * unit, *rest) for s in (1.0, -1.0))
            wanted = np.array(ahead - behind).ravel() / (2.0 * step)
            np.testing.assert_allclose(found[:, axis], wanted, rtol=1e-6, atol=1e-5)


@pytest.mark.slow
def test_it_has_derivatives_at_rest_and_says_what_rounding_off_costs(tmp_path, campaign, refused):
    damping = hd.Damping.from_dict(None, {"X_u|u|": -3.0, "Y_vV": -9.0, "Z_|w|": -0.1})
    slopes = []
    for smooth in (0.0, 0.01):
        plant = ExportedPlant.of(hd.fleet["remus100"], damping)
        folder = tmp_path / str(smooth)
        folder.mkdir()
        module = execute_module(
            write_export(CasADi(smooth=smooth), plant, folder) / "auv_remus100.py"
        )
        nu = ca.SX.sym("nu", 6)
        wrench = module.damping(nu, [0, 0, 1], [0] * len(module.INPUTS))
        slopes.append(np.array(ca.Function("f", [nu], [ca.jacobian(wrench, nu)])(np.zeros(6))))
    np.testing.assert_array_equal(slopes[0], 0.0)
    np.testing.assert_allclose(slopes[1], 0.0, atol=1e-12)
    published, vehicle = hd.published["vt690-sname2022"], campaign.vehicle
    log = campaign.test.between(0.0, 3.0)
    card = hd.export(published, vehicle, CasADi(smooth=1e-3), tmp_path / "card", log=log)
    assert 1e-4 < card.wrench_error["N"] < 5.0
    assert "smoothed over 0.001" in card.ignores
    refused(MethodError, CasADi, smooth=-1.0)


@pytest.mark.slow
def test_its_step_is_that_of_a_replay(tmp_path, campaign):
    log = campaign.exact_test.between(0.0, 3.0)
    damping = hd.published["vt690-sname2022"]
    plant = ExportedPlant.of(campaign.vehicle, damping)
    module = execute_module(write_export(CasADi(), plant, tmp_path) / "auv_vt690.py")
    state = np.concatenate([log.velocity[0], np.zeros(3), log.attitude[0]])
    for k, length in enumerate(np.diff(log.time)):
        for _ in range(2):
            given = [log.command(name)[k] for name in module.INPUTS]
            state = np.array(module.step(state, given, np.zeros(6), length / 2.0)).ravel()
    wanted = hd.simulate(campaign.vehicle, damping, log, attitude="simulated")
    np.testing.assert_allclose(state[:6], wanted.velocity[-1], rtol=1e-12)


@pytest.mark.slow
def test_the_code_it_generates_is_the_same(tmp_path):
    compiler = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if compiler is None:
        pytest.skip("no C compiler is installed")
    plant = ExportedPlant.of(RICH, coefficients(MODELS[0]))
    function = execute_module(
        write_export(CasADi(), plant, tmp_path) / "auv_rich_3.py"
    ).acceleration
    (tmp_path / "code").mkdir()
    made = function.generate("code.c")
    shutil.move(made, tmp_path / "code" / "code.c")
    call = [compiler, "-O1", "-fPIC", "-shared", "code.c", "-o", "code.so", "-lm"]
    subprocess.run(call, cwd=tmp_path / "code", check=True)
    at = states(plant, 9)
    given = [part.T for part in at]
    found = ca.external("acceleration", str(tmp_path / "code" / "code.so")).map(9)(*given)
    np.testing.assert_allclose(np.array(found).T, core(plant, at), rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_the_example_of_predictive_control_runs(tmp_path):
    plant = ExportedPlant.of(hd.fleet["vt690"], hd.published["vt690-sname2022"])
    write_export(CasADi(smooth=1e-3), plant, tmp_path)
    call = [sys.executable, "mpc.py"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=True)
    surges = [float(line.split()[3]) for line in done.stdout.splitlines() if "surge" in line]
    assert len(surges) == 5
    assert surges[-1] > 0.3
