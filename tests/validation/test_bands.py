"""Prediction bands: first order against theory, chunked as whole, honest where lost."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.files import as_json
from hydrodamp.identification import predicted_error
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.fit_files import fit_document, read_fit
from hydrodamp.simulation.replay import replay


@pytest.fixture
def coasting(vehicle):
    """Two runs of a vehicle on one axis that slows down: u = u_0 exp(X_u t / m)."""
    surge = replace(vehicle, axes=("X",))
    time = np.tile(0.1 * np.arange(60), 2)
    velocity = {"u": np.repeat([2.0, 1.0], 60)}
    segment = np.repeat(["fast", "slow"], 60)
    log = hd.Log.from_arrays(time, velocity, wrench=np.zeros((120, 6)), segment=segment)
    known = hd.Damping.from_dict(None, {"X_u": -20.0})
    return hd.prepare(surge, log, known.model), replace(known, covariance=[[4.0]])


@pytest.fixture
def manoeuvres():
    """A model with many terms on the re-enacted campaign, with covariance."""
    campaign = hd.reenact(seed=0, duration=15.0)
    linear = hd.find_model("linear")
    train = hd.prepare(campaign.vehicle, campaign.train, linear)
    damping = hd.LeastSquares(hd.SavitzkyGolay()).identify(train, linear).damping
    problem = hd.prepare(campaign.vehicle, campaign.test, linear)
    return problem, replace(damping, covariance=1e-3 * damping.covariance)


def test_one_axis_is_the_formula(coasting):
    problem, damping = coasting
    mass, time = problem.vehicle.mass_matrix[0, 0], problem.inputs.time
    wanted = np.repeat([2.0, 1.0], 60) * np.exp(-20.0 * time / mass)
    band = hd.prediction_band(problem, damping)
    np.testing.assert_allclose(band.velocity[:, 0], wanted, rtol=1e-6)
    half = 1.959964 * 2.0 * time / mass * wanted
    np.testing.assert_allclose(band.upper[:, 0] - wanted, half, rtol=1e-5, atol=1e-6)
    wide = hd.prediction_band(problem, damping, degrees_of_freedom=5.0)
    half5 = 2.570582 / 1.959964 * half
    np.testing.assert_allclose(wide.upper[:, 0] - wanted, half5, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(wanted - band.lower[:, 0], half, rtol=1e-5, atol=1e-6)


@pytest.mark.slow
def test_stretches_of_time_give_the_band_of_the_whole(manoeuvres, monkeypatch):
    problem, damping = manoeuvres
    whole = hd.prediction_band(problem, damping)
    monkeypatch.setattr(predicted_error, "_CHUNK_SIZE", 6 * 42 * 20)
    parts = hd.prediction_band(problem, damping)
    np.testing.assert_allclose(parts.velocity, whole.velocity, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(parts.upper, whole.upper, rtol=1e-8, atol=1e-12)
    np.testing.assert_array_equal(whole.velocity, replay(problem, damping).velocity)


@pytest.mark.parametrize("chunk", [8_000_000, 6 * 7 * 4])
def test_a_replay_that_diverges_has_no_band_from_there(coasting, monkeypatch, chunk):
    problem, damping = coasting
    monkeypatch.setattr(predicted_error, "_CHUNK_SIZE", chunk)
    band = hd.prediction_band(problem, replace(damping, coefficients=[400.0]))
    lost = np.isnan(band.velocity[:, 0])
    assert lost[59]
    assert not lost[60]
    np.testing.assert_array_equal(np.isnan(band.upper[:, 0]), lost)


def test_terms_of_locked_axes_do_not_matter(coasting):
    problem, damping = coasting
    more = hd.Damping.from_dict(None, {"X_u": -20.0, "N_r": -5.0})
    band = hd.prediction_band(problem, replace(more, covariance=np.diag([4.0, 9.0])))
    np.testing.assert_allclose(band.upper, hd.prediction_band(problem, damping).upper)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"level": 95.0}, "`level` must be between 0 and 1; got 95.0"),
        ({"degrees_of_freedom": 0.0}, "`degrees_of_freedom` must be positive"),
        ({"covariance": None}, "have no covariance"),
    ],
)
def test_bad_settings_are_a_sentence(coasting, settings, message):
    problem, damping = coasting
    damping = replace(damping, covariance=settings.pop("covariance", damping.covariance))
    with pytest.raises(MethodError, match=message):
        hd.prediction_band(problem, damping, **settings)


@pytest.mark.parametrize("usual", [0.1, 10.0])
def test_the_error_of_the_form_rises_to_its_level_and_beyond_the_motion_of_the_log(coasting, usual):
    """It is in proportion to a motion larger than that of the log, not to a smaller one."""
    problem, damping = coasting
    exact = replace(damping, covariance=[[0.0]])
    errors = {"X": (0.02, 1.5, usual)}
    band = hd.prediction_band(problem, exact, form_errors=errors)
    motion = np.repeat([band.velocity[k : k + 60, 0].std() for k in (0, 60)], 60)
    level = 1.959964 * 0.02 * np.maximum(motion / usual, 1.0)
    half = level * np.sqrt(1.0 - np.exp(-problem.inputs.time / 1.5))
    np.testing.assert_allclose(band.half_width[:, 0], half, rtol=1e-6, atol=1e-12)


@pytest.mark.slow
def test_a_small_velocity_has_no_error_of_a_large_one(manoeuvres):
    problem, damping = manoeuvres
    exact = replace(damping, covariance=np.zeros_like(damping.covariance))
    errors = {"X": (0.02, 1.0, 10.0), "N": (0.02, 1.0, 1e-3)}
    width = hd.prediction_band(problem, exact, form_errors=errors).half_width
    assert width[:, 0].max() <= 1.959964 * 0.02 < 0.1 * width[:, 5].max()


def test_a_band_names_the_velocities_beyond_the_training_data(coasting):
    problem, damping = coasting
    fit = hd.Fit(damping, "oe", hd.Status.OK)
    for limit, names in ((1.0, ("u",)), (2.0, ())):
        trained = replace(fit, training_range={"u": (-limit, limit)})
        assert hd.predict_error(problem.vehicle, trained, problem.log).extrapolated == names


FORM_ERRORS = {"X": (0.02, 1.5, 0.1)}


@pytest.mark.parametrize("kind", ["plain", "wrong form", "adequate form", "biased"])
def test_the_band_of_a_fit_has_its_noise_and_the_errors_of_its_form(coasting, tmp_path, kind):
    """Before and after its file: half of the width by noise, and no bias beside form errors."""
    problem, damping = coasting
    known = hd.Uncertainty(damping.covariance, 5.0, "by hand", damping.covariance / 4.0)
    fit = hd.Fit(damping, "oe", hd.Status.OK, uncertainty=known)
    if kind == "adequate form":
        fit = replace(fit, adequacy=Adequacy(Form.ADEQUATE, (), {}, {}))
    if kind == "biased":
        known = known.inflate(np.array([9.0]), "a bias")
        wide = replace(damping, covariance=known.covariance)
        fit = replace(fit, damping=wide, uncertainty=known)
    errors = FORM_ERRORS if kind in ("wrong form", "biased") else {}
    fit = replace(fit, form_errors=errors)
    (tmp_path / "fit.json").write_text(as_json(fit_document(fit)), "utf-8")
    settings = {"degrees_of_freedom": 5.0, "form_errors": errors}
    expected = hd.prediction_band(problem, damping, **settings).half_width
    expected = expected / 2.0 if kind == "adequate form" else expected
    for each in (fit, read_fit(tmp_path / "fit.json")):
        band = hd.predict_error(problem.vehicle, each, problem.log)
        np.testing.assert_allclose(band.half_width, expected, rtol=1e-9)
