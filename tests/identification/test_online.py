"""Live samples: the same numbers as from a log, and clear refusals."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ProblemError


@pytest.fixture
def live():
    rng, n = np.random.default_rng(3), 40
    velocity = rng.normal(0, 0.1, (n, 6)) + np.array([1.5, 0, 0, 0, 0, 0])
    attitude = rng.normal(0, 0.1, (n, 3))
    commands = {name: rng.normal(0, 0.1, n) for name in ("rudder", "elevator")}
    commands["rpm"] = rng.uniform(1500, 2000, n)
    log = hd.Log.from_arrays(np.arange(n) / 10, velocity, attitude=attitude, commands=commands)
    return hd.fleet["vt690"], hd.catalog["gertler-hagen"], log


@pytest.mark.filterwarnings("ignore::hydrodamp.errors.PropulsionWarning")
@pytest.mark.parametrize("recorded", ["commands", "wrench", "wrench and ratio"])
def test_observed_samples_are_those_of_the_log_bit_for_bit(live, recorded):
    """U is summed in one order everywhere, so (eta-1) is zero live as it is in a batch."""
    vehicle, model, log = live
    told = {name: log.command(name) for name in log.command_names}
    if recorded != "commands":
        told = {"wrench": np.ones((log.n, 6))}
        told |= {"propulsion_ratio": np.full(log.n, 1.5)} if "ratio" in recorded else {}
        log = hd.Log.from_arrays(log.time, log.velocity, attitude=log.attitude, **told)
    problem = hd.prepare(vehicle, log, model)
    sample = None
    for k in range(log.n):
        now = {name: values[k] for name, values in told.items()}
        sample = hd.observe(
            problem.equations,
            time=log.time[k],
            velocity=log.velocity[k],
            attitude=log.attitude[k],
            previous=sample,
            **({"commands": now} if recorded == "commands" else now),
        )
        np.testing.assert_array_equal(sample.values, problem.inputs.sample(k).values)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"velocity": 1.0}, r"`velocity` must have shape \(6\); got \(\)"),
        ({"velocity": [np.nan] * 6}, "finite; at 2.0 s"),
        ({"time": np.inf}, "finite"),
        ({"attitude": [0.0, 0.0, np.nan, 0.0]}, "finite"),
        ({"attitude": [0.0]}, r"shape \(3,\) or \(4,\)"),
        ({"wrench": np.ones(6)}, "twice"),
        ({"commands": {"rudder": 0, "rpm": 0}}, "'elevator' is missing"),
    ],
)
def test_a_sample_that_would_spoil_the_estimate_is_refused(live, change, message):
    vehicle, model, log = live
    columns = hd.prepare(vehicle, log, model).equations
    commands = {"rudder": 0.0, "elevator": 0.0, "rpm": 0.0}
    good = {"time": 2.0, "velocity": np.zeros(6), "commands": commands}
    with pytest.raises(ProblemError, match=message):
        hd.observe(columns, **(good | change))
