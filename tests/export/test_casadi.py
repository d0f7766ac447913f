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

from .conftest import COMPILER, PAPER, WIDE, core, needs_compiler, states, write_export

ca = pytest.importorskip("casadi")


@pytest.mark.slow
def test_it_has_derivatives_at_rest_and_says_what_rounding_off_costs(
    tmp_path, campaign, export, refused
):
    damping = hd.Damping.from_dict(None, {"X_u|u|": -3.0, "Y_vV": -9.0, "Z_|w|": -0.1})
    slopes = []
    for smooth in (0.0, 0.01):
        plant = ExportedPlant.of(hd.fleet["remus100"], damping)
        folder = write_export(CasADi(smooth=smooth), plant, tmp_path / str(smooth))
        module = execute_module(folder / "auv_remus100.py")
        nu = ca.SX.sym("nu", 6)
        wrench = module.damping(nu, [0, 0, 1], [0] * len(module.INPUTS))
        slopes.append(np.array(ca.Function("f", [nu], [ca.jacobian(wrench, nu)])(np.zeros(6))))
    np.testing.assert_array_equal(slopes[0], 0.0)
    np.testing.assert_allclose(slopes[1], 0.0, atol=1e-12)
    card = export(CasADi(smooth=1e-3), name="card", log=campaign.test.between(0.0, 3.0))
    assert 1e-4 < card.wrench_error["N"] < 5.0
    assert "smoothed over 0.001" in card.ignores
    refused(MethodError, CasADi, smooth=-1.0)


@pytest.mark.slow
@needs_compiler
def test_the_code_it_generates_is_the_same(tmp_path):
    module = execute_module(write_export(CasADi(), WIDE, tmp_path) / "auv_rich_3.py")
    shutil.move(module.acceleration.generate("code.c"), tmp_path / "code.c")
    call = [COMPILER, "-O1", "-fPIC", "-shared", "code.c", "-o", "code.so", "-lm"]
    subprocess.run(call, cwd=tmp_path, check=True)
    at = states(WIDE, 9)
    given = [part.T for part in at]
    found = ca.external("acceleration", str(tmp_path / "code.so")).map(9)(*given)
    np.testing.assert_allclose(np.array(found).T, core(WIDE, at), rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_the_example_of_predictive_control_runs(tmp_path):
    write_export(CasADi(smooth=1e-3), PAPER, tmp_path)
    call = [sys.executable, "mpc.py"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=True)
    surges = [float(line.split()[3]) for line in done.stdout.splitlines() if "surge" in line]
    assert len(surges) == 5
    assert surges[-1] > 0.3
