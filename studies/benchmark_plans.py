"""Vehicles of the benchmark with rudder, elevator and propeller, and their true damping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import hydrodamp as hd
from hydrodamp.simulation.campaign.conditions import (
    DEPTH_LOOP,
    PUBLISHED_AUTOPILOT,
    TEST_RUNS,
    TRAINING_RUNS,
    YAW_LOOP,
    Run,
    fin_autopilot,
    sname_truth,
    true_damping,
)
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from hydrodamp.simulation.closed_loop import Pid

SLOW_PITCH = Pid(2.5, 0.1, 3.5)
"""Half the published gains: at 5 Hz the published loop of pitch does not settle."""


@dataclass(frozen=True)
class Sea:
    """A campaign, and the true coefficients where its damping is a table of terms."""

    plan: CampaignSetup
    true: hd.Damping | None = None

    def at(self, rate: float) -> Sea:
        """Return the campaign at another rate of samples and commands [Hz]."""
        autopilot = self.plan.autopilot
        if rate < 10.0 and autopilot.pitch == PUBLISHED_AUTOPILOT.pitch:
            autopilot = fin_autopilot(DEPTH_LOOP, SLOW_PITCH, YAW_LOOP)
        plan = replace(self.plan, autopilot=autopilot, period=1.0 / rate)
        return replace(self, plan=plan)


def published() -> Sea:
    """Return the SNAME-2022 set, heave and pitch from the same laboratory's own simulation."""
    return Sea(CampaignSetup.of("sname"), true_damping())


def marginal() -> Sea:
    """Return the SNAME-2022 set with its own heave and pitch: marginal in open loop."""
    plan, found = CampaignSetup.of("sname"), hd.published["vt690-sname2022"]
    return Sea(replace(plan, truth=replace(sname_truth(found), name="sname2022")), found)


def crossflow() -> Sea:
    """Return crossflow strips, fins that meet the drift, and fins that lag by 0.05 s."""
    return Sea(CampaignSetup.of("crossflow"))


def drifting() -> Sea:
    """Return crossflow strips and fins that meet the drift, without lag."""
    plan = CampaignSetup.of("crossflow")
    return Sea(replace(plan, truth=replace(plan.truth, fin_lag=0.0)))


def lagging(sea: Callable[[], Sea], lag: float) -> Callable[[], Sea]:
    """Return a sea whose fins lag by so many seconds."""

    def make() -> Sea:
        plan = sea().plan
        return Sea(replace(plan, truth=replace(plan.truth, fin_lag=lag)))

    return make


def fewer(sea: Callable[[], Sea], *training: int) -> Callable[[], Sea]:
    """Return a sea with some of the training runs only."""

    def make() -> Sea:
        found = sea()
        runs = tuple(found.plan.training_runs[place] for place in training)
        return replace(found, plan=replace(found.plan, training_runs=runs))

    return make


REMUS_AUTOPILOT = fin_autopilot(DEPTH_LOOP, Pid(1.5, 0.1, 1.0), Pid(1.2, 0.01, 0.8))
"""Gains for a vehicle of a third of the inertia."""


def remus() -> Sea:
    """Return the REMUS 100, drag as adjusted to experiments."""
    return _remus("remus100-prestero-adjusted")


def remus_by_theory() -> Sea:
    """Return the REMUS 100, drag by strip theory."""
    return _remus("remus100-prestero-theory")


def _remus(key: str) -> Sea:
    """Return the vehicle of the fleet, its elevator as on the 690, its thrust by its speed."""
    nominal, found = 1500.0, _with_fins(hd.published[key])
    steady = float(np.sqrt(9.25 / 1.62))
    vehicle = replace(
        hd.fleet["remus100"],
        actuators=(
            hd.Fin("rudder", {"Y": 9.64, "N": -6.15}),
            hd.Fin("elevator", {"Z": 9.64, "M": 6.15}),
            hd.Propeller(
                "rpm",
                thrust=9.25 / nominal**2,
                torque=-0.543 / nominal**2,
                speed_slope=steady / nominal,
            ),
        ),
    )
    speeds = (nominal, 1000.0, 1250.0, nominal, 1250.0, 1350.0)
    runs = [_at(*pair) for pair in zip(TRAINING_RUNS + TEST_RUNS, speeds, strict=True)]
    n = len(TRAINING_RUNS)
    plan = CampaignSetup(
        vehicle, sname_truth(found), REMUS_AUTOPILOT, tuple(runs[:n]), tuple(runs[n:])
    )
    return Sea(replace(plan, truth=replace(plan.truth, name=key)), found)


def _with_fins(drag: hd.Damping) -> hd.Damping:
    """Return drag with more lift of the tail fins, which the source has too little of.

    As printed the vehicle is unstable in open loop, so that even the true coefficients replay
    nothing, and roll has no damping under way. Fins of 15 N per (m/s)^2 and rad in each plane,
    0.68 m aft and about 0.13 m off the axis, put both right: two thirds of what the source's
    area and lift slope of two fins give.
    """
    lift, aft, off = 15.0, -0.68, 0.13
    model = drag.model.with_terms({"K": "up"}, key=f"{drag.model.key}+fins")
    values = {**drag.as_dict(), "K_up": -2.0 * lift * off**2}
    for label, share in {
        "Y_uv": -1.0,
        "Y_ur": -aft,
        "N_uv": -aft,
        "N_ur": -(aft**2),
        "Z_uw": -1.0,
        "Z_uq": aft,
        "M_uw": aft,
        "M_uq": -(aft**2),
    }.items():
        values[label] += share * lift
    return hd.Damping.from_dict(model, values)


def _at(run: Run, rpm: float) -> Run:
    return replace(run, name=f"{run.name.partition('-')[0]}-{rpm:.0f}", rpm=rpm)
