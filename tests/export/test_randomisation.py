"""Draws of coefficients: the covariance they come from, dissipative ones, files of each."""

import csv
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, ModelError
from hydrodamp.export.export import Randomisation, accept_draws
from hydrodamp.export.plant import ExportedPlant

LABELS = {"X_u|u|": -3.0, "Y_v": -2.0, "N_v": 0.5, "N_r": -4.0}
COVARIANCE = np.array([[0.01, 0, 0, 0], [0, 1.0, 0.3, 0], [0, 0.3, 0.2, 0], [0, 0, 0, 0.0]])


@pytest.fixture(scope="module")
def damping():
    model = hd.Damping.from_dict(None, LABELS).model
    return hd.Damping(model, np.array([*LABELS.values()]), COVARIANCE)


def read_draws(folder):
    head, estimate, *rows = csv.reader((folder / "draws.csv").read_text("utf-8").splitlines())
    assert head == ["draw", *LABELS]
    assert [float(cell) for cell in estimate[1:]] == [*LABELS.values()]
    return np.array([[float(cell) for cell in row[1:]] for row in rows])


@pytest.mark.slow
def test_draws_have_the_covariance_of_the_fit(damping, tmp_path):
    form = Randomisation(draws=4000)
    card = hd.export(damping, hd.fleet["vt690"], form, tmp_path / "a")
    assert max(card.wrench_error.values()) < 1e-10
    rows = read_draws(tmp_path / "a")
    np.testing.assert_allclose(rows.mean(axis=0), [*LABELS.values()], atol=0.06)
    np.testing.assert_allclose(np.cov(rows.T), COVARIANCE, atol=0.06)
    again = hd.export(damping, hd.fleet["vt690"], form, tmp_path / "b")
    assert again == card
    np.testing.assert_array_equal(read_draws(tmp_path / "b"), rows)


class Generator:
    """A generator that returns given samples."""

    def __init__(self, rows):
        self.rows = rows

    def standard_normal(self, shape):
        return np.array(self.rows * shape[0])[: shape[0]] - [*LABELS.values()]


@pytest.mark.slow
def test_draws_that_inject_energy_are_rejected(damping, refused):
    plant = ExportedPlant.of(hd.fleet["vt690"], replace(damping, covariance=np.eye(4)))
    passive, active = damping.coefficients.tolist(), (-damping.coefficients).tolist()
    generator = Generator([active, passive])
    draws = accept_draws(plant, 2, generator, dissipative=False)
    np.testing.assert_array_equal(draws, [active, passive])
    draws = accept_draws(plant, 2, generator, dissipative=True)
    np.testing.assert_array_equal(draws, [passive, passive])
    refused(MethodError, lambda: accept_draws(plant, 1, Generator([active]), dissipative=True))


def test_each_draw_is_written_for_another_target(damping, tmp_path):
    form = Randomisation(draws=3, form="python")
    hd.export(damping, hd.fleet["vt690"], form, tmp_path / "a")
    rows, found = read_draws(tmp_path / "a"), []
    for path in sorted((tmp_path / "a").glob("*/auv_vt690.py")):
        names = {}
        exec(path.read_text("utf-8"), names)
        found.append(names["damping"]([0, 1.0, 0, 0, 0, 0], inputs=[0, 0, 0])[1])
    np.testing.assert_allclose(found, rows[:, 1])


def test_what_cannot_be_drawn_is_told(damping, tmp_path, refused):
    bare = hd.Damping.from_dict(None, LABELS)
    refused(ModelError, lambda: hd.export(bare, hd.fleet["vt690"], "randomisation", tmp_path / "a"))
    refused(MethodError, Randomisation, form="randomisation")
    refused(MethodError, Randomisation, draws=0)


def test_draws_for_a_form_that_lacks_terms_are_refused(damping, tmp_path, refused):
    """Dropped silently, cross terms such as N_v would leave draws of another model."""
    form = Randomisation(draws=2, form="urdf")
    refused(MethodError, hd.export, damping, hd.fleet["bluerov2"], form, tmp_path / "x")
    assert not (tmp_path / "x").exists()
