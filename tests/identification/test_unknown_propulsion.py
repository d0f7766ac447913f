"""Terms with (eta-1), where the log does not tell the propulsion ratio."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import PropulsionWarning

MODEL = hd.DampingModel.from_table(
    {
        "X": "u|u| u^2(eta-1)", "Y": "v|v| v ur", "Z": "w|w| w uq wV(eta-1)",
        "K": "p p|p|", "M": "q|q| q uw", "N": "r|r| r uv uv(eta-1)",
    },
    key="with-ratio",
)  # fmt: skip
RATIO = ("X_u^2(eta-1)", "Z_wV(eta-1)", "N_uv(eta-1)")


@pytest.fixture
def noisy(vehicle, exact_log, true_damping):
    log = exact_log(true_damping(MODEL), n=900, forward=2.0)
    noise = np.random.default_rng(3).normal(scale=0.01, size=log.velocity.shape)
    return replace(log, velocity=log.velocity + noise, propulsion_ratio=None, acceleration=None)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["ls", "weak", "ridge", "dissipative", "oe", "ai", "rls"])
def test_every_method_leaves_them_zero_and_names_them(vehicle, noisy, key):
    """The weak form evaluates terms at smoothed velocities, output error at simulated ones."""
    with pytest.warns(PropulsionWarning, match="cannot be identified"):
        fit = hd.identify(MODEL, vehicle, noisy, hd.find_method(key))
    assert [fit.damping[label] for label in RATIO] == [0.0, 0.0, 0.0]
    assert {(label,) for label in RATIO} <= set(fit.aliased)
    assert fit.rank is None or fit.rank <= MODEL.n_coefficients - len(RATIO)


def test_a_replay_leaves_them_out_at_every_speed(vehicle, noisy, true_damping):
    damping = replace(true_damping(MODEL), vehicle=None)
    reduced = hd.Damping.from_dict(MODEL, damping.as_dict() | dict.fromkeys(RATIO, 0.0))
    with pytest.warns(PropulsionWarning):
        one, other = (hd.simulate(vehicle, each, noisy) for each in (damping, reduced))
    np.testing.assert_array_equal(one.velocity, other.velocity)
