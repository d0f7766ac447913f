"""What several tests of the re-enacted campaign start from."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.motion import Body
from hydrodamp.simulation.campaign.reenact import Campaign, reenact
from hydrodamp.simulation.campaign.truth import Truth, crossflow, sname, true_damping
from hydrodamp.vehicle.file import fleet


@pytest.fixture(scope="session")
def body() -> Body:
    """The known part of the VT 690."""
    return Body.of(fleet["vt690"])


@pytest.fixture(scope="session")
def coefficients() -> dict[str, float]:
    """The published coefficients by label."""
    return dict(true_damping().as_dict())


@pytest.fixture(scope="session", params=["sname", "crossflow"])
def truth(request: pytest.FixtureRequest, coefficients: dict[str, float], body: Body) -> Truth:
    """Each of the two truths in turn."""
    if request.param == "sname":
        return sname(coefficients)
    return crossflow(coefficients, body.fins_at)


@pytest.fixture(scope="session")
def velocities() -> FloatArray:
    """Random velocities of a vehicle under way."""
    rng = np.random.default_rng(690)
    low, high = [0.1, -0.4, -0.4, -1.0, -0.5, -0.5], [2.7, 0.4, 0.4, 1.0, 0.5, 0.5]
    return rng.uniform(low, high, (2000, 6))


@pytest.fixture(scope="session")
def campaign() -> Campaign:
    """A short campaign on the published truth."""
    return reenact(seed=3, duration=30.0)
