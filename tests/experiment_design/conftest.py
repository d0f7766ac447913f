"""A planar boat with a rudder and a propeller, and a quickly optimised plan of its dive."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design import context, optimise

TRUTH = {"X_u|u|": -8.0, "Y_v": -30.0, "Y_uv": -20.0, "N_r": -4.0, "N_ur": -8.0}


@pytest.fixture(scope="package")
def boat():
    fin = hd.Fin("rudder", {"Y": 6.0, "N": -5.0}, limit=0.4)
    actuators, mass = (fin, hd.Propeller("rpm", thrust=2e-5)), np.diag([30.0, 45.0, 8.0])
    return hd.Vehicle("boat", mass, 300.0, 300.0, actuators=actuators, axes=("X", "Y", "N"))


@pytest.fixture(scope="package")
def known():
    return hd.Damping.from_dict(None, TRUTH)


@pytest.fixture(scope="package")
def planned(boat, known):
    """A plan of a minute, with few generations and members."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(optimise, "MAX_GENERATIONS", 1)
        patch.setattr(context, "N_MEMBERS", 20)
        area = {"north": (-80, 80), "east": (-80, 80)}
        envelope = hd.Envelope(speed=(0.8, 1.6), area=area, home=(60.0, 5.0))
        return hd.plan(boat, known.model, 60.0, damping=known, envelope=envelope, mode="waypoints")
