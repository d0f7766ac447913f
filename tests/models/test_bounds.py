"""Numbers and files that cannot be are refused in a sentence."""

import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp import errors
from hydrodamp.errors import FileError, ModelError
from hydrodamp.models.files import damping_document
from table_rows import rows

DAMPING = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_v": -2.0})
VEHICLE = "name: a\nmass_matrix: [[1,0,0],[0,1,0],[0,0,1]]\naxes: [X, Y, N]\n"
FILES = {
    "damping": (hd.read_damping, json.dumps(damping_document(DAMPING))),
    "models": (hd.read_models, "name: m\nterms: {X: u}\n"),
    "vehicle": (hd.read_vehicle, f"{VEHICLE}weight: 1\nbuoyancy: 1\n"),
}


@rows("kind, old, new, error")
def test_a_file_with_a_wrong_value_is_refused(tmp_path, kind, old, new, error, refused):
    read, text = FILES[kind]
    path = tmp_path / ("d.json" if kind == "damping" else f"{kind[0]}.yaml")
    path.write_text(text.replace(old, new), "utf-8")
    refused(getattr(errors, error), read, path)


def test_a_damping_without_any_number_is_neither_written_nor_read(tmp_path, refused):
    nothing = hd.Damping(DAMPING.model, np.full(2, np.nan))
    refused(ModelError, lambda: hd.write_damping(nothing, tmp_path / "d.json"))
    assert not (tmp_path / "d.json").exists()
    (tmp_path / "d.json").write_text(json.dumps(damping_document(nothing)), "utf-8")
    refused(ModelError, lambda: hd.read_damping(tmp_path / "d.json"))


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
