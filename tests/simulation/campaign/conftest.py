"""What several tests of the re-enacted campaign start from."""

import numpy as np
import pytest

from hydrodamp.simulation.campaign.conditions import (
    crossflow_truth,
    fin_position,
    sname_truth,
    true_damping,
)
from hydrodamp.simulation.campaign.reenact import reenact
from hydrodamp.vehicle.file import fleet


@pytest.fixture(scope="session", params=["sname", "crossflow"])
def truth(request):
    """Each of the two truths in turn."""
    if request.param == "sname":
        return sname_truth(true_damping())
    return crossflow_truth(true_damping(), fin_position(fleet["vt690"]))


@pytest.fixture(scope="session")
def velocities():
    """Random velocities of a vehicle under way."""
    rng = np.random.default_rng(690)
    low, high = [0.1, -0.4, -0.4, -1.0, -0.5, -0.5], [2.7, 0.4, 0.4, 1.0, 0.5, 0.5]
    return rng.uniform(low, high, (2000, 6))


@pytest.fixture(scope="session")
def campaign():
    """A short campaign on the published truth."""
    return reenact(seed=3, duration=30.0)
