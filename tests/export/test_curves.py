"""Curves of commands in every target that runs here: the accelerations of the core."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.c99 import C
from hydrodamp.export.optimisers import JAX
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.scripts import CasADi, MuJoCo, Octave, Python

from .conftest import ALL_ATOMS, RICH, accelerations_of, coefficients, core, states, write_export
from .test_octave import here

CURVES = (
    hd.Curve("lift", reference=1.5, reverse_ratio=0.8, exponent=1.6, dead_band=0.2),
    hd.Curve(
        "lambda",
        reference=2.0,
        exponent=1.3,
        voltage="battery",
        reference_voltage=0.9,
        voltage_exponent=1.2,
        limit=1.8,
    ),
    hd.Curve("gain", reference=1.0, reverse_ratio=1.2),
    hd.Curve("rpm", reference=1.0, exponent=2.0),
)


@pytest.mark.parametrize(
    "form", [C, pytest.param(Octave, marks=[pytest.mark.slow, here]), CasADi, Python, JAX, MuJoCo]
)
def test_accelerations_with_curves_are_those_of_the_core(form, tmp_path):
    if form in {CasADi, JAX, MuJoCo}:
        pytest.importorskip(form.key)
    vehicle = replace(RICH, actuators=(*RICH.actuators, *CURVES))
    plant = ExportedPlant.of(vehicle, coefficients(ALL_ATOMS))
    at = states(plant)
    assert set(plant.inputs) == {"rudder", "rpm", "lambda", "lift", "battery", "gain"}
    found = accelerations_of(form(), write_export(form(), plant, tmp_path), plant, at)
    tolerance = 1e-9 if form is MuJoCo else 1e-12  # MuJoCo solves for the acceleration
    np.testing.assert_allclose(found, core(plant, at), rtol=tolerance, atol=tolerance)
    straight = ExportedPlant.of(RICH, coefficients(ALL_ATOMS))
    index = [plant.inputs.index(name) for name in straight.inputs]
    without = core(straight, at._replace(inputs=np.ascontiguousarray(at.inputs[:, index])))
    assert np.abs(without - core(plant, at)).max() > 0.1
