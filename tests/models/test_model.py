"""Structure of a damping model: order, labels, packing, extension, fewer axes."""

import numpy as np
import pytest

from hydrodamp.basis.term import AXES, Term
from hydrodamp.errors import ModelError
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel, coefficient_unit, read_label
from table_rows import rows


@pytest.fixture
def mine():
    return DampingModel.from_table(
        {"Y N": "u|u|*rudder |r|v", "X": ["u|u|", Term.parse("u")], "Y": "v"},
        key="mine",
        title="Mine",
    )


def test_labels_go_axis_by_axis_in_canonical_order(mine):
    assert " ".join(mine.labels) == "X_u X_u|u| Y_v Y_v|r| Y_u|u|*rudder N_v|r| N_u|u|*rudder"
    assert mine.n_coefficients == 7
    assert mine.commands == ("rudder",)
    assert str(mine.basis) == "u v u|u| v|r| u|u|*rudder"


def test_unpack_is_equation_14(refused):
    """K = vec^-1(M_m^T kappa)^T, with the masking matrix M_m written out."""
    model = catalog["prestero"]
    kappa = np.random.default_rng(14).normal(size=model.n_coefficients)
    n = len(model.basis)
    masking = np.zeros((model.n_coefficients, 6 * n))
    for place, label in enumerate(model.labels):
        axis, term = read_label(label)
        masking[place, AXES.index(axis) * n + model.basis.index(term)] = 1.0
    columns = (masking.T @ kappa).reshape(n, 6, order="F")
    np.testing.assert_array_equal(model.unpack(kappa), columns.T)
    np.testing.assert_array_equal(model.pack(columns.T), kappa)
    refused(ModelError, lambda: model.unpack(np.zeros(6)))
    refused(ModelError, lambda: model.pack(np.zeros((5, 6))))


def test_index_takes_any_spelling_and_names_the_nearest(mine, refused):
    assert [mine.index(label) for label in mine.labels] == list(range(7))
    assert mine.index("Y_|r|v") == 3
    refused(ModelError, mine.index, "Y_v|p|")
    refused(ModelError, mine.index, "Q_u")
    refused(ModelError, mine.index, "Y_v|x|")


def test_with_terms_adds_and_keeps_what_is_there(refused):
    model = catalog["fossen"].with_terms({"Y N": "u|u|*rudder", "Y": "v"})
    assert model.key == "fossen-extended"
    assert model.title == "Fossen + v u|u|*rudder"
    assert model.n_coefficients == 14
    assert model.commands == ("rudder",)
    assert model.source == catalog["fossen"].source
    assert catalog["fossen"].with_terms({"X": "1"}, key="biased").key == "biased"
    refused(ModelError, catalog["fossen"].with_terms, {"Q": "u"})


def test_all_axes_change_nothing_and_unknown_ones_are_refused(refused):
    model = catalog["prestero"]
    assert model.restricted_to(AXES) == model
    refused(ModelError, model.restricted_to, ["X", "Q"])


def test_faults_of_a_table_come_at_once(refused):
    refused(ModelError, DampingModel.from_table, {"X Q": "u v|x|", "Y": ["eta"]}, key="bad")


def test_keys_and_rows_are_checked(refused):
    refused(ModelError, DampingModel.from_table, {"X": "u"}, key="a model")
    refused(ModelError, DampingModel, "mine", "Mine", ((Term.parse("u"),),))
    twice = (Term.parse("u"), Term.parse("u"))
    assert DampingModel("mine", "Mine", ((), (), twice, (), (), ())).labels == ("Z_u",)


def test_a_model_prints_itself(mine, snapshot):
    assert str(mine) == snapshot


@rows("label, unit")
def test_units(label, unit):
    assert coefficient_unit(*read_label(label)) == unit
