"""All runs at once are the same as each alone."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.body import Body
from hydrodamp.simulation.campaign.motion import Motion
from hydrodamp.simulation.campaign.plan import TESTING
from hydrodamp.simulation.campaign.sensors import draw_noise
from hydrodamp.simulation.campaign.truth import Truth
from hydrodamp.simulation.campaign.voyage import STARTING_DEPTH, Voyage, sail


def voyage_of(body: Body, truth: Truth, places: slice, noise: FloatArray) -> Voyage:
    """Some of the test runs."""
    runs = list(TESTING)[places]
    rpm = np.array([run.rpm for run in runs])
    return sail(runs, Motion(body, truth, body.propulsion(rpm)), noise[:, places])


def test_runs_do_not_see_each_other(body: Body, truth: Truth) -> None:
    """Side by side or alone, to rounding."""
    noise = draw_noise(1, 2, 80)
    both = voyage_of(body, truth, slice(0, 2), noise)
    second = voyage_of(body, truth, slice(1, 2), noise)
    np.testing.assert_allclose(both.states[:, 1:], second.states, atol=1e-9)


def test_measurement_is_state_plus_noise(body: Body, truth: Truth) -> None:
    """The autopilot and the log see the same noisy numbers."""
    noise = draw_noise(2, 2, 40)
    voyage = voyage_of(body, truth, slice(0, 2), noise)
    np.testing.assert_allclose(voyage.measured - voyage.states[:, :, :10], noise, atol=1e-12)
    np.testing.assert_array_equal(voyage.states[0, :, 9], STARTING_DEPTH)
