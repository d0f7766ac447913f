"""A scenario for Stonefish: what its mesh integrates along and about each axis is the drag."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.coefficients import Stonefish, box_drag
from hydrodamp.export.craft import Craft

from .conftest import core, rates_of, states, written


def test_a_plate_that_moves_ahead_has_its_area_and_its_sides():
    form, skin = box_drag(np.array([0.4, 0.3, 0.2]))[0]
    assert form == pytest.approx(0.3 * 0.2)
    assert skin == pytest.approx(2.0 * 0.4 * (0.3 + 0.2))


def test_drag_that_a_box_has_comes_back(tmp_path):
    sides, multipliers = np.array([0.6, 0.3, 0.2]), np.array([[0.9, 1.2, 0.7], [0.1, 0.2, 0.3]])
    drag = -500.0 * np.sum(box_drag(sides) * np.tile(multipliers.T, (2, 1)), axis=1)
    labels = ("X_u|u|", "Y_v|v|", "Z_w|w|", "K_p|p|", "M_q|q|", "N_r|r|")
    damping = hd.Damping.from_dict(None, dict(zip(labels, drag.tolist(), strict=True)))
    vehicle = replace(
        hd.fleet["bluerov2-heavy"],
        center_of_gravity=np.array([0.0, 0.0, 0.01]),
        center_of_buoyancy=np.zeros(3),  # the middle of the box
        buoyancy=sides.prod() * 9806.65,
    )
    craft, form = Craft.of(vehicle, damping), Stonefish(length=6.0, width=3.0, height=2.0)
    root = ElementTree.parse(written(form, craft, tmp_path) / Stonefish.file).getroot()
    found = [
        [float(part) for part in root.find(".//hydrodynamics").get(name).split()]
        for name in ("quadratic_drag", "viscous_drag")
    ]
    np.testing.assert_allclose(found, multipliers, rtol=1e-9)
    at = states(craft, 12)
    np.testing.assert_allclose(
        rates_of(form, tmp_path, craft, at), core(craft, at), rtol=1e-9, atol=1e-9
    )


def test_what_drives_is_no_drag(sailed, tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u|u|": 3.0, "Y_v|v|": -20.0})
    root = ElementTree.parse(
        written(Stonefish(), Craft.of(hd.fleet["bluerov2"], damping), tmp_path) / Stonefish.file
    ).getroot()
    hydrodynamics = root.find(".//hydrodynamics")
    assert hydrodynamics.get("quadratic_drag").split()[0] == "0.0"
    published, log = hd.published["vt690-sname2022"], sailed.test.between(0.0, 2.0)
    card = hd.export(published, sailed.vehicle, "stonefish", tmp_path / "a", log=log, force=True)
    assert "Not run here: Stonefish" in str(card)
    assert max(card.wrench_error.values()) > 1.0
    with pytest.raises(hd.MethodError, match="`height` must be positive"):
        Stonefish(height=-1.0)
