"""A scenario for Stonefish: what its mesh integrates over a box is the drag."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.export.coefficients import Stonefish, box_wrenches
from hydrodamp.export.plant import ExportedPlant, States

from .conftest import PUBLISHED, write_export

SIDES = np.array([0.6, 0.3, 0.2])
SHAPE = Stonefish(length=6.0, width=3.0, height=2.0)


def integrated(sides, velocity, form, skin, density):
    """Drag of a box as SolidEntity.cpp has it at commit 3857913: triangle by triangle.

    ``ComputeHydrodynamicForcesSubmerged`` sums, ``CorrectHydrodynamicForces`` scales.
    """
    sums = np.zeros((4, 3))
    for axis in range(3):
        for side in (-1.0, 1.0):
            first, second = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = side * sides[axis] / 2
            corners[:, first] = np.array([-1, 1, 1, -1]) * sides[first] / 2
            corners[:, second] = np.array([-1, -1, 1, 1]) * sides[second] / 2
            for triangle in ([0, 1, 2], [0, 2, 3]):
                p1, p2, p3 = corners[triangle]
                fn = np.cross(p2 - p1, p3 - p1) * side
                length = np.linalg.norm(fn)
                fn1, area, fc = fn / length, length / 2, (p1 + p2 + p3) / 3
                vc = -(velocity[:3] + np.cross(velocity[3:], fc))
                vc_n = vc @ fn1
                if vc_n < -1e-12:
                    quadratic = vc * np.linalg.norm(vc) * -vc_n * area
                    sums[:2] += quadratic, np.cross(fc, quadratic)
                tangent = (vc - vc_n * fn1) * area
                sums[2:] += tangent, np.cross(fc, tangent)
    scaled = [
        factor * density * (np.abs(part) / (np.linalg.norm(part) or 1.0) @ triple) * part
        for part, triple, factor in zip(
            sums, (form, form, skin, skin), (0.5, 0.5, 1.0, 1.0), strict=True
        )
    ]
    return np.concatenate([scaled[0] + scaled[2], scaled[1] + scaled[3]])


@pytest.fixture
def vehicle():
    """One that floats as the box does, its centres together."""
    return replace(
        hd.fleet["bluerov2-heavy"],
        center_of_gravity=np.zeros(3),
        center_of_buoyancy=np.zeros(3),
        buoyancy=SIDES.prod() * 9806.65,
    )


def multipliers(folder):
    hydrodynamics = ElementTree.parse(folder / Stonefish.file).getroot().find(".//hydrodynamics")
    names = "quadratic_drag", "viscous_drag"
    return [[float(x) for x in hydrodynamics.get(name).split()] for name in names]


@pytest.mark.slow
def test_a_box_has_the_wrench_of_the_source():
    form, skin = np.array([0.9, 1.2, 0.7]), np.array([0.1, 0.2, 0.3])
    velocity = np.random.default_rng(0).normal(size=(40, 6))
    # Force alone: which diagonal splits a face moves the middles of its triangles.
    for motion, name in ((np.eye(6), "along an axis"), (velocity * [1, 1, 1, 0, 0, 0], "straight")):
        found = 1000.0 * box_wrenches(SIDES, np.zeros(3), motion) @ np.append(form, skin)
        wanted = [integrated(SIDES, each, form, skin, 1000.0) for each in motion]
        np.testing.assert_allclose(found[:, :3], np.array(wanted)[:, :3], atol=1e-9, err_msg=name)
    own = np.arange(6)
    unit = 1000.0 * box_wrenches(SIDES, np.zeros(3), np.eye(6)) @ np.append(form, skin)
    wanted = np.array([integrated(SIDES, each, form, skin, 1000.0) for each in np.eye(6)])
    np.testing.assert_allclose(unit[own, own], wanted[own, own], rtol=1e-12)


def test_skin_friction_is_linear_and_form_drag_cubic():
    ahead = np.array([0.5, 1.0, 2.0])[:, None] * np.eye(6)[0]
    parts = -box_wrenches(SIDES, np.zeros(3), ahead)[:, 0]
    np.testing.assert_allclose(parts[:, 0], 0.5 * 0.3 * 0.2 * ahead[:, 0] ** 3)
    np.testing.assert_allclose(parts[:, 3], 2.0 * 0.6 * (0.3 + 0.2) * ahead[:, 0])


def test_linear_drag_of_a_box_comes_back(vehicle, tmp_path):
    skin = np.array([0.01, 0.02, 0.03])
    parts = 1000.0 * box_wrenches(SIDES, np.zeros(3), np.eye(6))[:, :, 3:] @ skin
    labels = [f"{axis}_{name}" for axis, name in zip("XYZKMN", "uvwpqr", strict=True)]
    damping = hd.Damping.from_dict(None, dict(zip(labels, np.diag(parts), strict=True)))
    random = np.random.default_rng(0)
    each = np.vstack([np.diag(random.normal(size=6)) for _ in range(9)])  # an axis at a time
    down, none = np.tile([0.0, 0.0, 1.0], (54, 1)), np.zeros((54, 6))
    plant = ExportedPlant.of(replace(vehicle, actuators=()), damping)
    at = States(each, down, np.zeros((54, 0)), none)
    held = SHAPE.project_plant(plant, at)
    (tmp_path / Stonefish.file).write_text(SHAPE.render_files(held)[Stonefish.file])
    np.testing.assert_allclose(multipliers(tmp_path), [[0.0] * 3, skin], rtol=1e-8, atol=1e-9)
    with SHAPE.open_engine(tmp_path, held) as engine:
        found = engine.accelerations(at)
    np.testing.assert_allclose(found, plant.acceleration(at), rtol=1e-8, atol=1e-9)


@pytest.mark.slow
def test_multipliers_come_nearest_and_what_drives_is_no_drag(campaign, export, tmp_path, refused):
    damping = hd.Damping.from_dict(None, {"X_u|u|": 3.0})
    folder = write_export(Stonefish(), ExportedPlant.of(hd.fleet["bluerov2"], damping), tmp_path)
    assert multipliers(folder) == [[0.0] * 3] * 2
    card = export(SHAPE, log=campaign.test.between(0.0, 2.0), force=True)
    assert "Stonefish" in card.not_run
    assert set(card.projected) == {x for x, value in PUBLISHED.as_dict().items() if value}
    assert card.power["target"] <= 0.0
    refused(MethodError, Stonefish, height=-1.0)


def test_the_scenario_says_what_it_needs_besides(vehicle, tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u": -3.0})
    folder = write_export(SHAPE, ExportedPlant.of(vehicle, damping), tmp_path)
    text = (folder / Stonefish.file).read_text()
    for word in ("<environment>", "<materials>", "<looks>", 'density="1000.0"'):
        assert word in text
    ElementTree.fromstring(text)
