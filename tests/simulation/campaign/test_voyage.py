"""All runs at once are the same as each alone."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import TESTING
from hydrodamp.simulation.campaign.conditions import COLOURED
from hydrodamp.simulation.campaign.motion import Body, Motion
from hydrodamp.simulation.campaign.reenact import STARTING_DEPTH, Voyage, sail
from hydrodamp.simulation.campaign.truth import Truth


def errors_of(n_samples: int) -> FloatArray:
    """Errors of the sensors in both test runs."""
    return COLOURED.draw_errors(1, 2, n_samples)


def voyage_of(body: Body, truth: Truth, places: slice, n_samples: int) -> Voyage:
    """Some of the test runs, pushed about."""
    runs = list(TESTING)[places]
    rpm = np.array([run.rpm for run in runs])
    errors, pushes = errors_of(n_samples), COLOURED.draw_pushes(1, 2, n_samples)
    motion = Motion(body, truth, body.propulsion(rpm))
    return sail(runs, motion, errors[:, places], pushes[:, places])


def test_runs_do_not_see_each_other(body: Body, truth: Truth) -> None:
    """Side by side or alone, to rounding."""
    both = voyage_of(body, truth, slice(0, 2), 80)
    second = voyage_of(body, truth, slice(1, 2), 80)
    np.testing.assert_allclose(both.states[:, 1:], second.states, atol=1e-9)


def test_measurement_is_state_plus_noise(body: Body, truth: Truth) -> None:
    """The autopilot and the log see the same noisy numbers."""
    voyage = voyage_of(body, truth, slice(0, 2), 40)
    errors = voyage.measured - voyage.states[:, :, :10]
    np.testing.assert_allclose(errors, errors_of(40), atol=1e-12)
    np.testing.assert_array_equal(voyage.states[0, :, 9], STARTING_DEPTH)
