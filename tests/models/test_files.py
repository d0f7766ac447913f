"""Models of your own in YAML: read, extend, write, refuse."""

from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.errors import ModelError
from table_rows import rows

HERE = Path(__file__).parent


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "models.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_list_of_models_may_extend_the_catalogue_and_each_other():
    finned, finned_2, plain, numbered = hd.read_models(HERE / "several.yaml")
    assert finned.n_coefficients == 38
    assert finned.source.startswith("Extends linear. Gibson")
    assert finned_2.commands == ("elevator", "rudder")
    assert plain.terms == hd.catalog["prestero"].terms
    assert numbered.key == "690"
    assert " ".join(numbered.labels) == "X_u Y_v Y_r Z_w Z_1 K_1 N_v N_r"


@pytest.mark.parametrize("key", hd.catalog)
def test_what_is_written_is_read_back(key, tmp_path):
    model = hd.catalog[key].with_terms({"Y": "u|u|*rudder down_y 1"}, key="mine")
    path = tmp_path / "mine.yaml"
    hd.write_model(model, path)
    assert hd.read_models(path) == (model,)


def test_every_fault_of_a_file_comes_at_once_with_its_place(file, refused):
    refused(ModelError, hd.read_models, file((HERE / "faults.yaml").read_text("utf-8")))


@rows("text")
def test_a_file_that_is_neither_a_model_nor_a_list_of_them(file, text, refused):
    refused(ModelError, lambda: hd.read_models(file(text)))
