"""Numbers and files that cannot be are refused in a sentence."""

import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, ModelError, VehicleError
from hydrodamp.models.files import damping_document

DAMPING = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_v": -2.0})
VEHICLE = "name: a\nmass_matrix: [[1,0,0],[0,1,0],[0,0,1]]\naxes: [X, Y, N]\n"


@pytest.mark.parametrize("value", [1e300, -1e31])
def test_a_coefficient_beyond_any_vessel_is_refused(tmp_path, value, refused):
    document = damping_document(DAMPING)
    document["coefficients"]["X_u"] = value
    (tmp_path / "d.json").write_text(json.dumps(document), "utf-8")
    refused(ModelError, lambda: hd.read_damping(tmp_path / "d.json"))


def test_a_damping_without_any_number_is_neither_written_nor_read(tmp_path, refused):
    nothing = hd.Damping(DAMPING.model, np.full(2, np.nan))
    refused(ModelError, lambda: hd.write_damping(nothing, tmp_path / "d.json"))
    assert not (tmp_path / "d.json").exists()
    (tmp_path / "d.json").write_text(json.dumps(damping_document(nothing)), "utf-8")
    refused(ModelError, lambda: hd.read_damping(tmp_path / "d.json"))


def test_a_coefficient_given_twice_is_refused(tmp_path, refused):
    text = json.dumps(damping_document(DAMPING)).replace('"X_u": -1.0', '"X_u": -1.0, "X_u": -9')
    (tmp_path / "d.json").write_text(text, "utf-8")
    refused(FileError, lambda: hd.read_damping(tmp_path / "d.json"))


@pytest.mark.parametrize("terms", ['{X: "u u|u| u"}', '{X: "u", X Y: "u"}'])
def test_a_term_given_twice_is_refused(tmp_path, terms, refused):
    (tmp_path / "m.yaml").write_text(f"name: m\nterms: {terms}\n", "utf-8")
    refused(ModelError, lambda: hd.read_models(tmp_path / "m.yaml"))


@pytest.mark.parametrize("weight", ["true", "1e300"])
def test_a_weight_that_is_none_is_refused(tmp_path, weight, refused):
    (tmp_path / "v.yaml").write_text(f"{VEHICLE}weight: {weight}\nbuoyancy: 1\n", "utf-8")
    refused(VehicleError, lambda: hd.read_vehicle(tmp_path / "v.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("form", ["yaml", "json"])
def test_deep_nesting_is_refused(tmp_path, form, refused):
    path = tmp_path / f"d.{form}"
    for depth in (2000, 100_000):
        path.write_text("[" * depth, "utf-8")
        refused(FileError, hd.read_damping, path)


def test_aliases_that_multiply_are_refused(tmp_path, refused):
    lines = ["a0: &a0 [u, v]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 9)]
    (tmp_path / "m.yaml").write_text("\n".join(lines), "utf-8")
    refused(FileError, lambda: hd.read_models(tmp_path / "m.yaml"))
