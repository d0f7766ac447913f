"""What does not fit is refused before C sees it."""

import numpy as np
import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Gains
from hydrodamp.kernels.plant import Sample

RUNS = ("replay", "adapt")
ZEROS = np.zeros((12, 6))


def arguments(make, kernel):
    """Such as the kernel takes."""
    rng = np.random.default_rng(5)
    plant, inputs = make.plant(rng), make.inputs(rng, n=6)
    of_gains = {"gains": Gains(plant, np.ones(6), ZEROS)}
    if kernel == "adapt_step":
        samples = {"previous": inputs.sample(0), "current": inputs.sample(1)}
        return {**of_gains, **samples, "state": np.zeros((13, 6))}
    of_run = {"matrix": ZEROS, "inputs": inputs, "segments": np.array([[0, 6]])}
    if kernel == "adapt":
        return {**of_gains, **of_run}
    return {"plant": plant, **of_run}


def few_channels(make):
    return make.inputs(np.random.default_rng(6), n=6, n_channels=1)


STRANGE = Sample.of(time=1.0, velocity=np.zeros(6), channels=np.zeros(3))


@pytest.mark.parametrize(
    ("asked", "name", "value", "message"),
    [
        (RUNS, "matrix", np.zeros((3, 6)), r"`matrix` must have shape \(12, 6\); got \(3, 6\)"),
        (RUNS, "segments", [[0, 7]], r"0 <= start < stop <= 6; got \[0, 7\]"),
        (RUNS, "segments", [[2, 2]], r"got \[2, 2\]"),
        (RUNS, "inputs", few_channels, "must have 2 columns.*got 1"),
        (RUNS[:1], "attitude", np.zeros((5, 4)), r"`attitude` must have shape \(6, 4\); got \(5"),
        (("adapt_step",), "state", np.ones((2, 6)), r"must have shape \(13, 6\).*got \(\(2, 6\)"),
        (("adapt_step",), "current", STRANGE, r"a sample 2 channels; got \(\(13, 6\), 2, 3\)"),
    ],
)
def test_records_and_steps(make, asked, name, value, message):
    change = {name: value(make) if callable(value) else value}
    for kernel in asked:
        with pytest.raises(ProblemError, match=message):
            getattr(core, kernel)(**{**arguments(make, kernel), **change})


def test_gains(make):
    plant = make.plant(np.random.default_rng(5))
    with pytest.raises(ValueError, match=r"`a` must have shape \(6\); got \(3,\)"):
        Gains(plant, np.ones(3), ZEROS)
    with pytest.raises(ValueError, match=r"`gamma` must have shape \(12, 6\); got \(2, 6\)"):
        Gains(plant, np.ones(6), np.ones((2, 6)))
