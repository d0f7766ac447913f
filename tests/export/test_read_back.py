"""The files of every target that runs here move as the core: one law over targets and plants."""

import shutil
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.export import SINGLE_TARGETS
from hydrodamp.export.plant import ExportedPlant

from .conftest import ALL_ATOMS, BOAT, MODELS, RICH, coefficients, core, read_back, states

#: What runs the files of a target, and the tolerance against the core.
TARGETS = {
    "python": ("numpy", 1e-12),
    "casadi": ("casadi", 1e-12),
    "mujoco": ("mujoco", 1e-9),  # solves for the acceleration
    "c": ("cc gcc clang", 0.0),
    "octave": ("octave-cli octave", 1e-12),
    "jax": ("jax", 1e-12),
    "torch": ("torch", 1e-12),
    "acados": ("acados_template", 1e-12),
    "do-mpc": ("do_mpc", 1e-12),
}
FAST = "python", "casadi", "mujoco"
LEVER = {"voltage": "battery", "reference_voltage": 0.9, "voltage_exponent": 1.2, "limit": 1.8}
CURVES = (
    hd.Curve("lift", reference=1.5, reverse_ratio=0.8, exponent=1.6, dead_band=0.2),
    hd.Curve("lambda", reference=2.0, exponent=1.3, **LEVER),
    hd.Curve("gain", reference=1.0, reverse_ratio=1.2),
    hd.Curve("rpm", reference=1.0, exponent=2.0),
)
PLANTS = {model.key: (RICH, model) for model in (*MODELS, ALL_ATOMS)} | {
    "inputs of the model alone": (hd.fleet["remus100"], ALL_ATOMS),
    "no actuators": (hd.Vehicle("bare", hd.fleet["vt690"].mass_matrix, 0.0, 0.0), MODELS[0]),
    "boat": (BOAT, hd.DampingModel.from_table({"X": "u u^2(eta-1)", "Y": "v"}, key="ratio")),
    "curves": (replace(RICH, actuators=(*RICH.actuators, *CURVES)), ALL_ATOMS),
}
FEW = "fossen", "all-atoms", "boat", "curves"


def pairs():
    """Yield a target and a plant; slow are all but a few, and skipped without their package."""
    for key, (tools, _) in TARGETS.items():
        has_tool = any(shutil.which(tool) or find_spec(tool) for tool in tools.split())
        for plant in PLANTS if key in (*FAST, "c") else FEW:
            if key == "mujoco" and plant in ("boat", "no actuators"):
                continue  # needs six axes and a weight (test_planar)
            marks = [] if key in FAST and plant in FEW else [pytest.mark.slow]
            marks += [] if has_tool else [pytest.mark.skip(reason=f"{tools} is not installed")]
            yield pytest.param(key, plant, marks=marks, id=f"{key}-{plant}")


@pytest.mark.filterwarnings("ignore:The .* feature is not available:UserWarning")
@pytest.mark.filterwarnings("ignore:.torch.jit")
@pytest.mark.parametrize(("key", "name"), [*pairs()])
def test_accelerations_are_those_of_the_core(key, name, tmp_path):
    form, tolerance = SINGLE_TARGETS[key], TARGETS[key][1]
    vehicle, model = PLANTS[name]
    plant = ExportedPlant.of(vehicle, coefficients(model))
    at = states(plant, 12)
    at = at._replace(velocity=at.velocity * vehicle.free)
    found = read_back(form, plant, at, tmp_path)
    wanted = core(plant, at)
    assert (tmp_path / "depth_step.py").exists() <= vehicle.free[2]
    scale = abs(wanted).max(axis=0)  # of each axis
    scale[scale == 0.0] = 1.0
    np.testing.assert_allclose(found / scale, wanted / scale, rtol=tolerance, atol=tolerance)


def test_the_plants_have_inputs_that_act():
    remus, curved, straight = (
        ExportedPlant.of(vehicle, coefficients(ALL_ATOMS))
        for vehicle in (hd.fleet["remus100"], PLANTS["curves"][0], RICH)
    )
    assert remus.inputs[-1] == "u_c"
    assert set(curved.inputs) == {"rudder", "rpm", "lambda", "lift", "battery", "gain"}
    at, index = states(curved), [curved.inputs.index(name) for name in straight.inputs]
    without = core(straight, at._replace(inputs=np.ascontiguousarray(at.inputs[:, index])))
    assert np.abs(without - core(curved, at)).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("key", ["python", "c", "octave", "fmu"])
def test_a_boat_of_three_degrees_of_freedom_sails_as_the_core(key, planar, tmp_path):
    boat, damping, log = planar
    card = hd.export(damping, boat, key, tmp_path / "a", log=log)
    if not card.not_run:
        assert card.run_by
        assert set(card.wrench_error) == {"X", "Y", "N"}
        tolerance = 1e-15 if key == "c" else 1e-13  # the C code is that of the core
        assert card.replays.source_to_target.rms < tolerance
        assert card.replays.target_to_log.rms < 1e-12
