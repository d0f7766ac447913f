"""What does not fit is refused before C sees it."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp import kernels
from hydrodamp.errors import ProblemError
from hydrodamp.kernels import Gains
from hydrodamp.kernels.plant import Sample


@pytest.fixture
def call(make):
    rng = np.random.default_rng(5)
    plant, inputs = make.plant(rng), make.inputs(rng, n=6)
    matrix, segments = np.zeros((plant.n_terms, 6)), np.array([[0, 6]])

    def run(kernel, **change):
        arguments = {"matrix": matrix, "inputs": inputs, "segments": segments}
        if kernel == "adapt":
            settings = {"a": np.ones(6), "gamma": matrix}
            settings |= {name: change.pop(name) for name in settings if name in change}
            arguments["gains"] = Gains(plant, **settings)
        else:
            arguments["plant"] = plant
        if kernel == "sensitivities":
            arguments["parameters"] = np.array([[0, 0]])
        return getattr(kernels, kernel)(**(arguments | change))

    return run


@pytest.mark.parametrize("kernel", ["replay", "sensitivities", "adapt"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"matrix": np.zeros((3, 6))}, r"`matrix` must have shape \(12, 6\); got \(3, 6\)"),
        ({"segments": [[0, 7]]}, r"0 <= start < stop <= 6; got \[0, 7\]"),
        ({"segments": [[2, 2]]}, r"got \[2, 2\]"),
        ({"segments": [[0.5, 6.0]]}, "`segments` must be whole numbers; got float64"),
    ],
)
def test_every_batch(call, kernel, change, message):
    with pytest.raises(ProblemError, match=message):
        call(kernel, **change)


@pytest.mark.parametrize("kernel", ["replay", "sensitivities", "adapt"])
def test_channels_must_be_the_plants(call, make, kernel):
    other = make.inputs(np.random.default_rng(6), n=6, n_channels=1)
    with pytest.raises(ProblemError, match=r"must have 2 columns.*got 1"):
        call(kernel, inputs=other)


@pytest.mark.parametrize("kernel", ["replay", "sensitivities"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"attitude": np.zeros((5, 4))}, r"`attitude` must have shape \(6, 4\); got \(5, 4\)"),
        ({"max_step": 0.0}, "`max_step` must be positive; got 0.0"),
        ({"limit": float("nan")}, "`limit` must be positive; got nan"),
    ],
)
def test_integration(call, kernel, change, message):
    with pytest.raises(ProblemError, match=message):
        call(kernel, **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": [[12, 0]]}, r"terms below 12 and axes below 6; got \[12, 0\] to \[12, 0\]"),
        ({"parameters": [[0, 0], [0, -1]]}, r"got \[0, -1\] to \[0, 0\]"),
        ({"parameters": [[2**32, 0]]}, r"got \[4294967296, 0\]"),
    ],
)
def test_sensitivities(call, change, message):
    with pytest.raises(ProblemError, match=message):
        call("sensitivities", **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": np.ones(3)}, r"`a` must have shape \(6\); got \(3,\)"),
        ({"gamma": np.ones((2, 6))}, r"`gamma` must have shape \(12, 6\); got \(2, 6\)"),
    ],
)
def test_gains(call, change, message):
    with pytest.raises(ValueError, match=message):
        call("adapt", **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"velocity": np.zeros((3, 5))}, r"`velocity` must have shape \(3, 6\)"),
        ({"down": np.zeros((2, 3))}, r"`down` must have shape \(3, 3\)"),
        ({"channels": np.zeros(3)}, r"`channels` must have shape \(3, 3\); got \(3,\)"),
        ({"propulsion_speed": np.zeros(2)}, r"`propulsion_speed` must have shape \(3,\)"),
        ({"factors": [[21, 0, 0, 0]]}, r"0\.\.20 with 0 channels"),
        ({"out": np.zeros((3, 2))}, r"`out` must be writable float64 of shape \(3, 1\)"),
        ({"out": np.zeros((3, 1), dtype=np.float32)}, "got float32"),
        ({"out": np.zeros((3, 1), dtype="f8, i4")["f0"]}, r"strides \(12, 12\) bytes"),
    ],
)
def test_regressor(change, message):
    good = {
        "factors": [[1, 0, 0, 0]],
        "velocity": np.zeros((3, 6)),
        "down": np.zeros((3, 3)),
        "channels": np.zeros((3, 0)),
        "propulsion_speed": np.zeros(3),
    }
    with pytest.raises(ProblemError, match=message):
        kernels.regressor(**(good | change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"state": np.ones((2, 6))}, r"a state must have shape \(13, 6\).*got \(2, 6\)"),
        (
            {"current": Sample.of(time=1.0, velocity=np.zeros(6), channels=np.zeros(3))},
            r"a sample 2 channels; got \(13, 6\) and 3",
        ),
    ],
)
def test_adapt_step(make, change, message):
    rng = np.random.default_rng(5)
    plant, inputs = make.plant(rng), make.inputs(rng, n=2)
    good = {
        "gains": Gains(plant, np.ones(6), np.zeros((plant.n_terms, 6))),
        "state": np.zeros((plant.n_terms + 1, 6)),
        "previous": inputs.sample(0),
        "current": inputs.sample(1),
    }
    with pytest.raises(ProblemError, match=message):
        kernels.adapt_step(**(good | change))
