"""A model with numbers: wrench, power, labels."""

import numpy as np
import pytest

from hydrodamp.errors import ModelError, TermError
from hydrodamp.models.catalog import catalog
from hydrodamp.models.damping import Damping, VehicleStamp


@pytest.fixture
def damping():
    model = catalog["gertler-hagen"]
    coefficients = np.random.default_rng(88).normal(size=88)
    return Damping(model, coefficients, np.eye(88), VehicleStamp("toy", 1.0, 2.0), "src", "nb")


def test_coefficients_by_label(damping, refused):
    values = damping.as_dict()
    assert tuple(values) == damping.model.labels
    assert all(damping[label] == value for label, value in values.items())
    assert damping["Y_V_v|r|"] == values["Y_|r|V_v"]
    refused(ModelError, lambda: damping["K_p"])


def test_wrench_takes_commands_and_attitude(refused):
    damping = Damping.from_dict(None, {"N_u|u|*rudder": -9.0, "Y_down_y": 3.0})
    velocity = [[2.0, 0, 0, 0, 0, 0]] * 2
    wrench = damping.wrench(velocity, down=[0, 0.5, 0], commands={"rudder": [0.1, -0.1]})
    np.testing.assert_allclose(wrench[:, 5], [-3.6, 3.6])
    np.testing.assert_allclose(wrench[:, 1], 1.5)
    refused(TermError, damping.wrench, velocity)


def test_from_dict_wants_every_label_of_the_model(refused):
    model = catalog["fossen"]
    values = dict.fromkeys(model.labels, -1.0)
    assert Damping.from_dict(model, values).as_dict() == values
    fewer = {label: -1.0 for label in model.labels if label not in ("X_u|u|", "N_r")}
    refused(ModelError, Damping.from_dict, model, fewer)
    refused(ModelError, Damping.from_dict, model, {**values, "N_q": 1.0})


def test_a_damping_prints_itself(snapshot):
    values = {"X_u|u|": -3.244, "Y_v": -20.0, "Y_r": 5.0}
    stamp = VehicleStamp("toy", 1.0, 1.0)
    damping = Damping.from_dict(None, values, vehicle=stamp, source="here", note="there")
    assert str(damping) == snapshot


def test_arrays_fit_the_model_are_copied_and_cannot_be_written(refused):
    model, values = catalog["fossen"], np.zeros(12)
    damping = Damping(model, values)
    values[0] = 1.0
    assert damping["X_u"] == 0.0
    assert not damping.coefficients.flags.writeable
    assert not damping.matrix.flags.writeable
    refused(ModelError, lambda: Damping(model, np.zeros(11)))
    refused(ModelError, lambda: Damping(model, np.zeros(12), np.zeros((12, 11))))
