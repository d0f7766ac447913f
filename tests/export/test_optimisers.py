"""Functions for optimisers: the core's accelerations and sensitivities, and a depth step."""

import subprocess
import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.codegen import vehicle_identifier
from hydrodamp.export.export import SINGLE_TARGETS
from hydrodamp.export.optimisers import JAX, Acados, PyTorch
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.scripts import CasADi, Python, execute_module
from hydrodamp.export.target import require_package
from hydrodamp.export.verification import attitude_quaternions
from hydrodamp.kernels.core import replay
from hydrodamp.kernels.plant import Inputs
from hydrodamp.simulation.problem import held_channels

from .conftest import WIDE, core, states, write_export

pytestmark = [  # what these packages warn of where they are imported
    pytest.mark.filterwarnings("ignore:The .* feature is not available:UserWarning"),
    pytest.mark.filterwarnings("ignore:.torch.jit:FutureWarning"),
    pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning"),
]
PACKAGES = {"jax": "jax", "torch": "torch", "acados": "acados_template", "do-mpc": "do_mpc"}


def needs(key):
    """Return a parameter for a target, skipped without its package."""
    package = PACKAGES[key]
    absent = pytest.mark.skipif(not find_spec(package), reason=f"{package} is not installed")
    return pytest.param(SINGLE_TARGETS[key], marks=absent, id=key)


ALL = [*map(needs, PACKAGES)]


@pytest.fixture
def jax():
    jax = pytest.importorskip("jax", reason="jax is not installed")
    with jax.enable_x64(True):
        yield jax


def module_of(form, folder, plant=WIDE):
    return execute_module(write_export(form, plant, folder) / f"{vehicle_identifier(plant)}.py")


def core_step(plant, velocity, attitude, inputs, wrench, h):
    """Return the velocity after a step of the core, and its slopes on the velocity before."""
    given = np.tile(inputs, (2, 1))
    channels = held_channels(plant.columns, dict(zip(plant.commands, given.T, strict=True)), 2)
    speed = plant.vehicle.propulsion_speed(dict(zip(plant.commands, given.T, strict=True)))
    record = Inputs(
        np.array([0.0, h]),
        np.tile(velocity, (2, 1)),
        np.zeros((2, 3)),
        np.tile(wrench, (2, 1)),
        channels,
        np.column_stack([speed, speed]),
        np.zeros((2, 3)),
    )
    entries, poses = (np.array([0]), np.array([0])), np.tile(attitude, (2, 1))
    after, _, slope = replay(
        plant.columns.plant, plant.matrix, record, [[0, 2]], entries, attitude=poses
    )
    return after[1], slope[1][:, 1:]


def slope_in_jax(step):
    import jax

    return jax.jit(jax.jacfwd(step))


def slope_in_torch(step):
    import torch

    slope = torch.func.jacfwd(step)
    return lambda *given: slope(*map(torch.tensor, given[:-1]), given[-1])


def slope_in_casadi(step):
    import casadi

    given = step.mx_in()
    return casadi.Function("slope", given, [casadi.jacobian(step(*given), given[0])])


SLOPES = {
    "jax": (JAX(), slope_in_jax),
    "torch": (PyTorch(), slope_in_torch),
    "casadi": (CasADi(), slope_in_casadi),
}


@pytest.mark.slow
@pytest.mark.parametrize("key", SLOPES)
def test_jacobians_of_a_step_are_the_sensitivities_of_the_core(key, tmp_path, request):
    """At rest too."""
    pytest.importorskip(key)
    if key == "jax":
        request.getfixturevalue("jax")
    form, slope_of = SLOPES[key]
    step, at, h = module_of(form, tmp_path).step, states(WIDE, 8), 0.02
    attitudes, slope = attitude_quaternions(at.down), slope_of(step)
    for k, velocity in enumerate([*at.velocity[:-1], np.zeros(6)]):
        given = at.inputs[k], at.wrench[k], h
        after, wanted = core_step(WIDE, velocity, attitudes[k], *given)
        state = np.concatenate([velocity, np.zeros(3), attitudes[k]])
        if key != "torch":  # whose step takes tensors
            np.testing.assert_allclose(np.array(step(state, *given)).ravel()[:6], after, rtol=1e-12)
        found = np.array(slope(state, *given))[:6, :6]
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


@pytest.mark.slow
def test_a_gradient_in_reverse_is_the_one_forward(jax, tmp_path):
    module, at = module_of(JAX(), tmp_path), states(WIDE, 1)
    nu, *rest = (part[0] for part in at)
    forward = jax.jit(jax.jacfwd(module.acceleration))(nu, *rest)
    backward = jax.jit(jax.jacrev(module.acceleration))(nu, *rest)
    np.testing.assert_allclose(forward, backward, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_batches_are_loops_and_compiled_functions_are_those_of_numpy(jax, tmp_path):
    module, at = module_of(JAX(), tmp_path), states(WIDE, 6)
    (tmp_path / "numpy").mkdir()
    reference = module_of(Python(), tmp_path / "numpy")
    attitudes = attitude_quaternions(at.down)
    state = np.column_stack([at.velocity, np.zeros((6, 3)), attitudes])
    derivative = jax.jit(module.derivative)
    batch = jax.jit(jax.vmap(module.derivative))(state, at.inputs, at.wrench)
    for row, *each in zip(batch, state, at.inputs, at.wrench, strict=True):
        wanted = reference.derivative(*each)
        np.testing.assert_allclose(derivative(*each), wanted, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(row, wanted, rtol=1e-12, atol=1e-12)


def test_a_wrench_of_no_samples_acts_on_columns_of_samples(tmp_path):
    module, at = module_of(Python(), tmp_path), states(WIDE, 4)
    found = module.acceleration(at.velocity.T, at.down.T, at.inputs.T)
    held = module.acceleration(at.velocity[0], at.down[0], at.inputs.T)
    for k in range(4):
        alone = module.acceleration(at.velocity[k], at.down[k], at.inputs[k])
        np.testing.assert_allclose(found[:, k], alone, rtol=1e-12, atol=1e-12)
        alone = module.acceleration(at.velocity[0], at.down[0], at.inputs[k])
        np.testing.assert_allclose(held[:, k], alone, rtol=1e-12, atol=1e-12)


def test_batches_in_torch_are_those_of_the_core(tmp_path):
    torch = pytest.importorskip("torch")
    module, at = module_of(PyTorch(), tmp_path), states(WIDE, 4)
    batch = torch.func.vmap(module.acceleration)(*map(torch.tensor, at))
    np.testing.assert_allclose(batch, core(WIDE, at), rtol=1e-12, atol=1e-12)
    single = module.acceleration(*(torch.tensor(part[0]).float() for part in at))
    assert single.dtype == torch.float32


def test_the_model_of_acados_is_equation_1(tmp_path, monkeypatch):
    ca = pytest.importorskip("casadi")
    stand_in = SimpleNamespace(AcadosModel=SimpleNamespace)
    monkeypatch.setitem(sys.modules, "acados_template", stand_in)
    model, at = module_of(Acados(), tmp_path).make_model(), states(WIDE)
    assert model.name == "auv_rich_3"
    arguments = [model.x, model.xdot, model.u]
    both = ca.Function("both", arguments, [model.f_expl_expr, model.f_impl_expr])
    state = np.column_stack([at.velocity, np.zeros((50, 3)), attitude_quaternions(at.down)])
    control = np.column_stack([at.inputs, at.wrench])
    explicit, implicit = both(state.T, np.ones((13, 50)), control.T)
    np.testing.assert_allclose(np.array(explicit)[:6].T, core(WIDE, at), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.array(implicit), 1.0 - np.array(explicit), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("form", ALL)
def test_the_example_steers_a_depth_step(form, tmp_path):
    plant = ExportedPlant.of(hd.fleet["bluerov2"], hd.published["bluerov2"])
    write_export(form, plant, tmp_path)
    call = [sys.executable, "-W", "ignore", "depth_step.py"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=True)
    depths = [float(line.split()[3]) for line in done.stdout.splitlines() if ": depth " in line]
    assert depths[0] < 0.5
    np.testing.assert_allclose(depths[-len(depths) // 4 :], 1.0, atol=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("key", [*PACKAGES, "gz-sim"])
def test_without_its_package_the_card_says_how_to_get_it(key, tmp_path, monkeypatch):
    monkeypatch.setitem(require_package.__globals__, "find_spec", lambda name: None)
    card = hd.export(hd.published["bluerov2"], hd.fleet["bluerov2"], key, tmp_path / "a")
    assert "is not installed" in card.not_run
