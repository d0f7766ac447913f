"""Files of coefficients: what is read back damps and moves as what was written."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

import hydrodamp as hd
from hydrodamp.errors import ModelError, VehicleError
from hydrodamp.export.coefficients import URDF, UUV, MarineGym
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.identification.dissipativity import OperatingBox

from .conftest import core, read_back, states, write_export

_VALUES = ("inertial/mass", "hydrostatics/buoyancy")
TURN = np.array([1.0, -1.0, -1.0])
XML = (".sdf", ".config", ".urdf", ".scn", ".xml")
STIFF = replace(
    hd.fleet["bluerov2-heavy"],
    center_of_gravity=np.zeros(3),
    center_of_buoyancy=np.array([0.0, 0.0, -0.03]),
)
EVERY = hd.Damping.from_dict(
    None, {"X_u": -4.0, "X_u|u|": -9.0, "Y_v": -6.0, "Y_v|v|": -8.0, "K_p": -0.5, "N_r|r|": -1.0}
)
COUPLED = hd.Damping.from_dict(
    None, {"X_u^2": -3.0, "Y_v": -6.0, "Y_r": 2.0, "Y_ur": 1.5, "M_w": 0.7, "N_uv": -0.3}
)


@pytest.mark.parametrize(
    ("form", "damping"), [(UUV(), EVERY), (UUV(), COUPLED), (URDF(), EVERY), (MarineGym(), EVERY)]
)
def test_a_craft_whose_origin_is_its_centre_of_gravity_comes_back(form, damping, tmp_path):
    plant = ExportedPlant.of(STIFF, damping)
    at = states(plant, 12)
    found = read_back(form, plant, at, tmp_path)
    np.testing.assert_allclose(found, core(plant, at), rtol=1e-10, atol=1e-10)


def test_linear_damping_about_any_origin_comes_back(tmp_path):
    form, arm = UUV(), np.array([0.3, -0.1, 0.05])
    turn = np.eye(6)
    turn[:3, 3:] = [[0, arm[2], -arm[1]], [-arm[2], 0, arm[0]], [arm[1], -arm[0], 0]]
    vehicle = replace(
        STIFF,
        mass_matrix=turn.T @ hd.fleet["bluerov2-heavy"].mass_matrix @ turn,
        added_mass=turn.T @ hd.fleet["bluerov2-heavy"].added_mass @ turn,
        center_of_gravity=arm,
        center_of_buoyancy=arm - [0.0, 0.0, 0.04],
    )
    drag = turn.T @ np.diag([-4.0, -6.0, -8.0, -0.5, -0.4, -0.6]) @ turn
    labels = [[f"{axis}_{name}" for name in "uvwpqr"] for axis in "XYZKMN"]
    damping = dict(zip(np.ravel(labels).tolist(), drag.ravel().tolist(), strict=True))
    plant = ExportedPlant.of(vehicle, hd.Damping.from_dict(None, damping))
    at = states(plant, 12)
    found = read_back(form, plant, at, tmp_path)
    np.testing.assert_allclose(found, core(plant, at), rtol=1e-9, atol=1e-9)


def test_quadratic_drag_is_exact_where_the_centre_of_gravity_is_below_the_origin(tmp_path):
    card = hd.export(EVERY, hd.fleet["remus100"], "uuv", tmp_path / "a")
    assert card.exact
    assert max(card.wrench_error.values()) < 1e-9


def test_what_gazebo_makes_of_uuv_is_the_wrench(tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u": -4.0, "Y_v": -6.0, "Y_r": 2.0, "M_w": 0.7})
    plant = ExportedPlant.of(hd.fleet["remus100"], damping)
    root = ElementTree.parse(write_export(UUV(), plant, tmp_path) / "uuv.urdf").getroot()

    def read(tag):
        return np.array(root.findtext(f".//{tag}").split(), dtype=float)

    assert root.find(".//inertial/origin").get("xyz") == "0.0 0.0 0.0"
    nu, down = np.random.default_rng(0).normal(size=6), np.array([0.1, -0.7, 0.7])
    matrix = -read("linear_damping").reshape(6, 6)
    matrix -= nu[0] * read("linear_damping_forward_speed").reshape(6, 6)
    matrix -= np.diag(read("quadratic_damping") * np.abs(nu))
    # ODE applies the force to the centre of mass, and buoyancy at a place told from there.
    np.testing.assert_allclose(-matrix @ nu, damping.wrench(nu), rtol=1e-9, atol=1e-12)
    lift = -float(root.findtext(".//volume")) * 1000.0 * 9.80665 * down
    weight = float(root.find(".//mass").get("value")) * 9.80665 * down
    moment = np.cross(read("center_of_buoyancy") * TURN, lift)
    wanted = plant.vehicle.restoring_wrench(down[None])[0]
    np.testing.assert_allclose([*(lift + weight), *moment], wanted, atol=1e-9)


def test_what_auv_controllers_makes_of_a_urdf_moves_as_the_vehicle(tmp_path):
    plant = ExportedPlant.of(hd.fleet["bluerov2"], EVERY)
    root = ElementTree.parse(write_export(URDF(), plant, tmp_path) / "hydrodynamics.urdf").getroot()

    def read(tag, names):
        return np.array([float(root.find(f".//{tag}").get(name)) for name in names.split()])

    # As parse_model_from_xml of its hydrodynamics.cpp at commit 3c4db4e: every element is a child
    # of the element that is named here, every number an attribute; the weight is 9.81 times the
    # mass; restoring forces with z down about the origin.
    down, hydrodynamics = np.array([0.1, -0.7, 0.7]), root.find("hydrodynamics")
    groups = {"inertial": "mass inertia added_mass center_of_gravity"}
    groups |= {"damping": "linear quadratic", "hydrostatics": "buoyancy center_of_buoyancy"}
    for group, children in groups.items():
        assert {child.tag for child in hydrodynamics.find(group)} == {*children.split()}
    mass, lift = (float(hydrodynamics.find(x).get("value")) for x in _VALUES)
    weight = 9.81 * mass
    inertia, arm = read("inertia", "ixx iyy izz"), read("center_of_gravity", "x y z")
    assert not arm.any()
    added = -read("added_mass", "Xdu Ydv Zdw Kdp Mdq Ndr")
    matrix = np.diag(added) + np.diag([mass, mass, mass, *inertia])
    nu = np.random.default_rng(0).normal(size=6)
    wanted = nu @ plant.vehicle.mass_matrix @ nu
    assert nu @ matrix @ nu == pytest.approx(wanted, rel=0.05)  # no coupled mass
    drag = read("linear", "Xu Yv Zw Kp Mq Nr") * nu
    drag += read("quadratic", "Xuu Yvv Zww Kpp Mqq Nrr") * np.abs(nu) * nu
    np.testing.assert_allclose(drag, np.diag(plant.damping.wrench(np.diag(nu))), rtol=1e-12)
    moment = np.cross(read("center_of_buoyancy", "x y z"), -lift * down)
    found = np.concatenate([(weight - lift) * down, moment])
    np.testing.assert_allclose(found, plant.vehicle.restoring_wrench(down[None])[0], atol=1e-9)


def test_positive_numbers_drag_in_marinegym_and_negative_ones_in_a_urdf(tmp_path):
    plant = ExportedPlant.of(STIFF, EVERY)
    text = (write_export(MarineGym(), plant, tmp_path) / "marinegym.yaml").read_text()
    assert "keep `rotor_configuration`" in text
    said = yaml.safe_load(text)
    assert said["hydro_coef"]["linear_damping"][:2] == [4.0, 6.0]
    assert said["hydro_coef"]["quadratic_damping"][0] == 9.0
    assert said["hydro_coef"]["added_mass"][1] == pytest.approx(7.1206, abs=0.01)
    assert said["coBM"] == pytest.approx(0.03)
    assert said["volume"] * 997.0 * 9.8 == pytest.approx(STIFF.buoyancy)
    root = ElementTree.parse(write_export(URDF(), plant, tmp_path) / "hydrodynamics.urdf").getroot()
    assert float(root.find(".//damping/linear").get("Yv")) == -6.0
    assert float(root.find(".//added_mass").get("Xdu")) == pytest.approx(-6.3567, abs=0.01)
    assert float(root.find(".//center_of_buoyancy").get("z")) == pytest.approx(-0.03)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["uuv", "urdf", "marinegym"])
def test_the_card_is_of_the_numbers_and_says_that_the_simulator_was_not_run(
    key, campaign, planar, export, refused
):
    card = export(key, log=campaign.test.between(0.0, 5.0), force=True)
    assert not card.exact
    assert card.replays.source_to_target.rms > 0.0
    assert card.not_run
    boat, damping, _ = planar
    refused(VehicleError, export, key, damping, "b", boat)
    righted = hd.Damping.from_dict(None, {"X_u": -1.0, "K_wdown_y": 3.0})
    refused(ModelError, export, key, righted, "b", hd.fleet["bluerov2"])


@pytest.mark.slow
@pytest.mark.parametrize("key", ["gz-sim", "vrx", "mujoco", "uuv", "urdf", "stonefish"])
def test_any_name_and_words_make_xml_that_is_read(key, tmp_path):
    vehicle = replace(hd.fleet["vt690"], name='é <"x"> -- y', source='a -- b <c> & "d" --> e\n]]>')
    damping = hd.Damping.from_dict(None, {"X_u|u|": -3.0, "Y_v|v|": -2.0}, source="x --- y")
    box = OperatingBox([-1.0] * 6, [1.0] * 6)
    hd.export(damping, vehicle, key, tmp_path / "a", box=box, force=True)
    found = [path for path in (tmp_path / "a").iterdir() if path.suffix in XML]
    for path in found:
        ElementTree.parse(path)
    assert found
