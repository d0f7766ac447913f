"""Files of coefficients: what is read back damps and moves as what was written."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

import hydrodamp as hd
from hydrodamp.export.coefficients import URDF, UUV, MarineGym
from hydrodamp.export.craft import Craft

from .conftest import core, states, written

TURN = np.array([1.0, -1.0, -1.0])
XML = (".sdf", ".config", ".urdf", ".scn", ".xml")
TILTED = replace(
    hd.fleet["bluerov2-heavy"],
    center_of_gravity=np.array([0.0, 0.0, 0.01]),
    center_of_buoyancy=np.array([0.0, 0.0, -0.02]),
)
EVERY = hd.Damping.from_dict(
    None, {"X_u": -4.0, "X_u|u|": -9.0, "Y_v": -6.0, "Y_v|v|": -8.0, "K_p": -0.5, "N_r|r|": -1.0}
)
COUPLED = hd.Damping.from_dict(
    None, {"X_u^2": -3.0, "Y_v": -6.0, "Y_r": 2.0, "Y_ur": 1.5, "M_w": 0.7, "N_uv": -0.3}
)


@pytest.mark.parametrize("damping", [EVERY, COUPLED], ids=["diagonal", "coupled"])
def test_all_of_a_craft_comes_back_from_uuv(damping, tmp_path):
    craft = Craft.of(hd.fleet["remus100"], damping)
    at = states(craft, 12)
    found = UUV().read(written(UUV(), craft, tmp_path), craft).rates(at)
    np.testing.assert_allclose(found, core(craft, at), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("form", [URDF(), MarineGym()], ids=lambda form: form.key)
def test_a_diagonal_craft_comes_back(form, tmp_path):
    # About the centre of gravity all these forms hold the whole of it.
    vehicle = replace(TILTED, center_of_gravity=np.zeros(3))
    craft = Craft.of(vehicle, EVERY)
    at = states(craft, 12)
    found = form.read(written(form, craft, tmp_path), craft).rates(at)
    np.testing.assert_allclose(found, core(craft, at), rtol=1e-10, atol=1e-10)


def test_what_uuv_sums_is_the_wrench(tmp_path):
    craft = Craft.of(hd.fleet["remus100"], COUPLED)
    root = ElementTree.parse(written(UUV(), craft, tmp_path) / "uuv.urdf").getroot()

    def read(tag):
        return np.array(root.findtext(f".//{tag}").split(), dtype=float)

    nu = np.random.default_rng(0).normal(size=6)  # z down, as its ToNED leaves it
    matrix = -read("linear_damping").reshape(6, 6)
    matrix -= nu[0] * read("linear_damping_forward_speed").reshape(6, 6)
    matrix -= np.diag(read("quadratic_damping") * np.abs(nu))
    np.testing.assert_allclose(-matrix @ nu, COUPLED.wrench(nu), rtol=1e-12)
    lift = read("center_of_buoyancy") * TURN
    np.testing.assert_allclose(lift, craft.vehicle.center_of_buoyancy)


def test_positive_numbers_drag_in_marinegym_and_negative_ones_in_a_urdf(tmp_path):
    craft = Craft.of(TILTED, EVERY)
    said = yaml.safe_load((written(MarineGym(), craft, tmp_path) / "marinegym.yaml").read_text())
    assert said["hydro_coef"]["linear_damping"][:2] == [4.0, 6.0]
    assert said["hydro_coef"]["quadratic_damping"][0] == 9.0
    assert said["hydro_coef"]["added_mass"][1] == pytest.approx(7.1206, abs=0.01)
    assert said["coBM"] == pytest.approx(0.03)
    assert said["volume"] * 997.0 * 9.80665 == pytest.approx(TILTED.buoyancy)
    root = ElementTree.parse(written(URDF(), craft, tmp_path) / "hydrodynamics.urdf").getroot()
    assert float(root.find(".//linear").get("Yv")) == -6.0
    assert float(root.find(".//added_mass").get("Xdu")) == pytest.approx(-6.3567, abs=0.01)
    assert float(root.find(".//center_of_buoyancy").get("z")) == 0.02


@pytest.mark.parametrize("key", ["uuv", "urdf", "marinegym"])
def test_the_card_is_of_the_numbers_and_says_that_the_simulator_was_not_run(
    key, sailed, planar, tmp_path
):
    published, log = hd.published["vt690-sname2022"], sailed.test.between(0.0, 5.0)
    card = hd.export(published, sailed.vehicle, key, tmp_path / "a", log=log, force=True)
    assert not card.exact
    assert card.replays.source_to_target.rms > 0.0
    assert "Not run here" in str(card)
    boat, damping, _ = planar
    with pytest.raises(hd.VehicleError, match="moves all six axes"):
        hd.export(damping, boat, key, tmp_path / "b")
    steered = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_u|u|*fin": 3.0})
    with pytest.raises(hd.ModelError, match="has no input for"):
        hd.export(steered, hd.fleet["bluerov2"], key, tmp_path / "b")


@pytest.mark.parametrize("key", ["gz-sim", "vrx", "mujoco", "uuv", "urdf", "stonefish"])
def test_any_name_and_words_make_xml_that_is_read(key, tmp_path):
    vehicle = replace(hd.fleet["vt690"], name='é <"x"> -- y', source='a -- b <c> & "d" --> e\n]]>')
    damping = hd.Damping.from_dict(None, {"X_u|u|": -3.0, "Y_v|v|": -2.0}, source="x --- y")
    hd.export(damping, vehicle, key, tmp_path / "a")
    found = [path for path in (tmp_path / "a").iterdir() if path.suffix in XML]
    for path in found:
        ElementTree.parse(path)
    assert found
