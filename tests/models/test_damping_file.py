"""The damping file: both ways, what it says, what it refuses, whose it is."""

import json
import warnings

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, ForeignVehicleWarning, ModelError
from hydrodamp.models.damping import VehicleStamp, warn_if_foreign
from hydrodamp.models.files import damping_document, damping_from_document
from table_rows import rows

STAMP = VehicleStamp("toy", 466.5, 470.0, "0123456789abcdef")


@pytest.fixture
def damping():
    rng = np.random.default_rng(30)
    model = hd.catalog["prestero"].with_terms({"Y N": "u|u|*rudder"}, key="finned")
    n = model.n_coefficients
    return hd.Damping(model, rng.normal(size=n) / 3, rng.normal(size=(n, n)), STAMP, "src", "nb")


@pytest.mark.parametrize(
    "model", [*hd.catalog.values(), hd.catalog["pitch-yaw"].restricted_to("K")]
)
def test_what_is_written_is_read_back_bit_for_bit(model, tmp_path):
    rng, n = np.random.default_rng(30), model.n_coefficients
    for more in ((), (rng.normal(size=(n, n)), STAMP, "src", "nb")):
        damping = hd.Damping(model, rng.normal(size=n) / 3, *more)
        hd.write_damping(damping, tmp_path / "damping.json")
        again = hd.read_damping(tmp_path / "damping.json")
        assert again.model == model
        np.testing.assert_array_equal(again.coefficients, damping.coefficients)
        np.testing.assert_array_equal(again.covariance, damping.covariance)
        for name in ("vehicle", "source", "note"):
            assert getattr(again, name) == getattr(damping, name)


def test_the_file_says_what_its_numbers_mean(damping, tmp_path):
    hd.write_damping(damping, tmp_path / "damping.json")
    document = json.loads((tmp_path / "damping.json").read_text(encoding="utf-8"))
    assert (document["format"], document["version"]) == ("hydrodamp-damping", 1)
    assert document["frame"].startswith("FRD")
    assert "Viscous remainder: H(M nu) nu with the full M" in document["content"]
    assert {"eta", "sign_convention", "reference_point"} < set(document)
    assert document["units"]["Y_v|v|"] == "N/(m/s)^2"
    assert document["units"]["N_u|u|*rudder"] == "N m/((m/s)^2 [rudder])"
    assert list(document["units"]) == list(document["coefficients"])
    assert document["covariance"]["order"] == list(damping.model.labels)
    assert document["vehicle"]["mass_matrix_digest"] == "0123456789abcdef"


def test_numbers_that_are_not_finite_become_null_and_come_back_as_nan(tmp_path):
    model = hd.catalog["fossen"]
    covariance = np.eye(12)
    covariance[1, 2] = np.inf
    damping = hd.Damping(model, [np.nan, *np.ones(11)], covariance)
    hd.write_damping(damping, tmp_path / "damping.json")
    text = (tmp_path / "damping.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    again = hd.read_damping(tmp_path / "damping.json")
    assert np.isnan(again["X_u"])
    assert np.isnan(again.covariance[1, 2])


def find(document, path):
    """Return the table at the parent of a path, and the last key."""
    *parents, key = path.split("/")
    for parent in parents:
        document = document[parent]
    return document, key


@rows("path, value")
def test_a_wrong_value_is_named(damping, path, value, refused):
    document = damping_document(damping)
    table, key = find(document, path)
    table[key] = value
    refused(ModelError, damping_from_document, document, "damping.json")


@pytest.mark.parametrize("path", ["model", "coefficients/Y_v|v|"])
def test_an_absent_value_is_named(damping, path, refused):
    document = damping_document(damping)
    table, key = find(document, path)
    del table[key]
    refused(ModelError, damping_from_document, document, "damping.json")


def test_what_is_no_damping_file(tmp_path, refused):
    path = tmp_path / "damping.json"
    path.write_text('{"format":\n !}', encoding="utf-8")
    with pytest.raises(FileError, match=r"line 2: cannot be read as JSON: .* column 2"):
        hd.read_damping(path)
    path.write_text("[]", encoding="utf-8")
    refused(ModelError, hd.read_damping, path)


def test_terms_may_be_typed_as_text(damping):
    document = damping_document(damping)
    document["model"]["terms"] = {
        axis: " ".join(row) for axis, row in document["model"]["terms"].items()
    }
    assert damping_from_document(document).as_dict() == damping.as_dict()


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (VehicleStamp("b", 466.5, 470.0, "f" * 16), "the mass matrix is another"),
        (VehicleStamp("b", 400.0, 470.0, ""), "weight 466.5 N there, 400 N here"),
        (VehicleStamp("b", 466.5, 471.0, STAMP.mass_matrix_digest), "buoyancy 470 N there"),
    ],
)
def test_another_vehicle_is_warned_of(damping, other, says):
    with pytest.warns(ForeignVehicleWarning, match=rf"belong to vehicle 'toy'.*'b'.*{says}"):
        warn_if_foreign(damping, other)


def test_the_same_vehicle_or_an_unknown_one_is_not_warned_of(damping):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_if_foreign(damping, VehicleStamp("renamed", 466.5, 470.0, STAMP.mass_matrix_digest))
        warn_if_foreign(damping, VehicleStamp("renamed", 466.5, 470.0))
        warn_if_foreign(hd.Damping(hd.catalog["fossen"], np.zeros(12)), STAMP)
