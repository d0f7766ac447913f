import numpy as np
import pytest

from hydrodamp.vehicle.actuators import Fin, Matrix, Propeller, Thruster
from hydrodamp.vehicle.vehicle import Vehicle


@pytest.fixture
def equipped():
    """A vehicle with one actuator of every kind and no symmetry to hide an error."""
    return Vehicle(
        name="equipped",
        mass_matrix=np.diag([20.0, 30.0, 31.0, 1.0, 4.0, 5.0]),
        weight=100.0,
        buoyancy=104.0,
        center_of_gravity=np.array([0.01, -0.02, 0.03]),
        center_of_buoyancy=np.array([0.02, 0.01, -0.04]),
        actuators=(
            Fin("rudder", {"Y": 9.0, "N": -8.0}, drag={"X": -4.0}, limit=0.3),
            Propeller("rpm", 3e-6, advance=-2e-4, torque=1e-7, speed_slope=0.001, limit=2000.0),
            Thruster("bow", (0.6, 0.0, 0.1), (0.0, 1.0, 0.0), curve=[(-1, -20), (0, 0), (1, 30)]),
            Matrix(("vertical",), [[0, 0, 12, 0, -3, 0]]),
        ),
        source="made up",
        note="for tests",
        added_mass=np.diag([1.0, 10.0, 11.0, 0.1, 1.0, 1.5]),
    )


@pytest.fixture
def motion():
    """Random velocities, down vectors and commands of fifty samples."""
    rng = np.random.default_rng(690)
    down = rng.normal(size=(50, 3))
    return {
        "velocity": rng.normal(size=(50, 6)),
        "down": down / np.linalg.norm(down, axis=1, keepdims=True),
        "rudder": rng.uniform(-0.6, 0.6, 50),
        "rpm": rng.uniform(-2600, 2600, 50),
        "bow": rng.uniform(-1.5, 1.5, 50),
        "vertical": rng.uniform(-1, 1, 50),
    }
