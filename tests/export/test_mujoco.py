"""MJCF and its passive force: MuJoCo's accelerations are the core's."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.craft import Craft
from hydrodamp.export.mujoco import MuJoCo
from hydrodamp.export.scripts import executed

from .conftest import ALL_ATOMS, MODELS, RICH, coefficients, core, rates_of, states, written

here = pytest.mark.skipif(not find_spec("mujoco"), reason="mujoco is not installed")
PUBLISHED = hd.published["vt690-sname2022"]


@here
@pytest.mark.parametrize("model", [*MODELS, ALL_ATOMS], ids=lambda model: model.key)
def test_accelerations_are_those_of_the_core(model, tmp_path):
    craft = Craft.of(RICH, coefficients(model))
    at = states(craft, 12)
    found, wanted = (
        rates_of(MuJoCo(), written(MuJoCo(), craft, tmp_path), craft, at),
        core(craft, at),
    )
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


@here
def test_it_sails_as_the_core_but_for_its_step(sailed, tmp_path):
    log = sailed.test.between(0.0, 5.0)
    card = hd.export(PUBLISHED, sailed.vehicle, "mujoco", tmp_path / "a", log=log)
    assert card.exact
    assert card.replays.source_to_target.rms < 1e-4
    assert "MuJoCo" in card.run_by


@here
def test_what_is_applied_at_the_center_of_mass_moves_it_and_other_models_are_left_alone(tmp_path):
    import mujoco

    craft = Craft.of(hd.fleet["vt690"], PUBLISHED)
    written(MuJoCo(), craft, tmp_path)
    ball = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    other = mujoco.MjModel.from_xml_string(ball)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "vt690.xml"))
    data, water = mujoco.MjData(model), executed(tmp_path / "vt690.py")
    water.in_water(model)
    model.opt.timestep = 1e-3
    data.xfrc_applied[1] = [3.0, -2.0, 1.0, 0.1, 0.2, -0.3]  # upright, at rest: z up
    mujoco.mj_forward(model, data)
    turn = np.array([1.0, -1.0, -1.0])
    force, moment = turn * [3.0, -2.0, 1.0], turn * [0.1, 0.2, -0.3]
    about = np.concatenate([force, moment + np.cross(craft.vehicle.center_of_gravity, force)])
    wanted = np.linalg.solve(craft.vehicle.mass_matrix, about)
    np.testing.assert_allclose(data.qacc * np.tile(turn, 2), wanted, rtol=1e-9, atol=1e-12)
    falling = mujoco.MjData(other)
    mujoco.mj_forward(other, falling)
    mujoco.set_mjcb_passive(None)
    np.testing.assert_allclose(falling.qacc, [0, 0, -9.81, 0, 0, 0], atol=1e-9)


def test_locked_axes_and_time_that_stands_are_refused(planar, tmp_path):
    boat, damping, _ = planar
    with pytest.raises(hd.VehicleError, match="'mujoco' moves all six axes"):
        hd.export(damping, boat, "mujoco", tmp_path / "a")
    with pytest.raises(hd.MethodError, match="`step` must be positive"):
        MuJoCo(step=0.0)
