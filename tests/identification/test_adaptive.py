"""The adaptive identifier: online equals batch, the truth is found, gains are checked."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.differentiation import signal_to_noise

LINEAR = hd.catalog["linear"]


@pytest.mark.slow
@pytest.mark.parametrize("method", [hd.AdaptiveIdentifier(a=2.0, gamma=20.0)])
def test_status_is_converged_when_residuals_are_small(method, prepared):
    """On exact data the estimate converges after many passes."""
    model = hd.catalog["fossen"]
    problem = prepared(model, n=600)
    first, last = (replace(method, passes=n).identify(problem, model) for n in (1, 1000))
    assert first.status is hd.Status.NOT_CONVERGED
    assert last.status is hd.Status.CONVERGED


def test_history_ends_at_the_estimate(prepared):
    problem = prepared(LINEAR, n=90)
    method = hd.AdaptiveIdentifier(passes=2)
    history = method.history(problem, LINEAR)
    assert history.coefficients.shape == (2 * (90 - 3), 36)
    assert history.velocity_error.shape == (2 * (90 - 3), 6)
    assert history.labels == LINEAR.labels
    fit = method.identify(problem, LINEAR)
    np.testing.assert_array_equal(history.coefficients[-1], fit.damping.coefficients)
    assert method.history(problem, LINEAR, every=10).time.shape == (17,)
    with pytest.raises(MethodError, match="at least 1"):
        method.history(problem, LINEAR, every=0)


def test_signal_to_noise_finds_white_noise_on_a_smooth_motion(vehicle):
    rng = np.random.default_rng(12)
    n = 20_000
    clean = np.outer(np.sin(0.3 * np.arange(n) / 10), [1.0, 0.5, 0.2, 0.1, 0.1, 0.0])
    noise = np.array([0.01, 0.02, 0.02, 0.01, 0.0, 0.0])
    log = hd.Log.from_arrays(
        np.arange(n) / 10,
        clean + rng.normal(size=(n, 6)) * noise,
        wrench=np.zeros((n, 6)),
        segment=np.repeat(["a", "b"], n // 2),
    )
    flat = replace(vehicle, center_of_gravity=(0, 0, 0))
    ratio = signal_to_noise(hd.prepare(flat, log, hd.catalog["linear"]))
    expected = (np.array([1.0, 0.5, 0.2, 0.1]) ** 2 / 2 + noise[:4] ** 2) / noise[:4] ** 2
    np.testing.assert_allclose(ratio[:4], expected, rtol=0.05)
    assert ratio[4] > 1e5  # smooth: nothing but the motion's own fourth difference
    assert ratio[5] == 1.0  # does not vary
