from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.errors import ProblemError
from hydrodamp.kernels.plant import Inputs, Sample


def test_a_sample_holds_its_row(make):
    inputs = make.inputs(np.random.default_rng(0), n=5)
    sample = inputs.sample(3)
    assert sample.time == inputs.time[3]
    np.testing.assert_array_equal(sample.velocity, inputs.velocity[3])
    np.testing.assert_array_equal(sample.propulsion, inputs.propulsion[3])
    np.testing.assert_array_equal(sample.values[7:10], inputs.down[3])
    np.testing.assert_array_equal(sample.values[10:16], inputs.wrench[3])
    np.testing.assert_array_equal(sample.values[18:], inputs.channels[3])
    assert not sample.values.flags.writeable


def test_a_sample_alone_is_level_and_unforced():
    sample = Sample.of(time=1.0, velocity=np.ones(6))
    np.testing.assert_array_equal(sample.values, [1] * 7 + [0, 0, 1] + [0] * 8)


def test_a_sample_of_wrong_shape_is_refused():
    with pytest.raises(ProblemError, match="shapes required"):
        Sample.of(time=1.0, velocity=np.ones(5))


@pytest.mark.parametrize("name", ["velocity", "down", "wrench", "channels", "propulsion"])
def test_every_array_must_have_a_row_a_sample(name):
    widths = {"velocity": 6, "down": 3, "wrench": 6, "channels": 1, "propulsion": 2}
    arrays = {key: np.zeros((4 - (key == name), width)) for key, width in widths.items()}
    with pytest.raises(ValueError, match=rf"`{name}` must have shape \(4, .*got \(3, "):
        Inputs(time=np.arange(4), **arrays)
