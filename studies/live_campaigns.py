"""Campaigns for the studies of `hydrodamp live`, fed in memory through its loop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import hydrodamp as hd
from hydrodamp.live.samples import Row, read_number, rows_of
from hydrodamp.simulation.campaign.conditions import (
    DEPTH_HOLDS,
    DEPTH_STEPS,
    HEADING_HOLDS,
    HEADING_STEPS,
    TEST_RUNS,
    TRAINING_RUNS,
    WHITE_NOISE,
    Conditions,
    Run,
    StepSequence,
)
from hydrodamp.simulation.campaign.reenact import Campaign, CampaignSetup

MODELS = ("prestero", "linear", "fossen")
TRUTHS = ("sname", "crossflow")

TRANSIT = 400.0
"""Straight course before the first manoeuvre of a run [s]."""


def _after(seconds: float, name: str, rpm: float, yaw: bool, dive: bool) -> Run:
    still = Run(name, rpm)
    heading = StepSequence(HEADING_STEPS, HEADING_HOLDS, seconds) if yaw else still.heading
    depth = StepSequence(DEPTH_STEPS, DEPTH_HOLDS, seconds) if dive else still.depth
    return Run(name, rpm, heading, depth)


@dataclass(frozen=True)
class Dive:
    """Runs of one length [s] that follow one another."""

    name: str
    runs: tuple[Run, ...]
    duration: float


STEPS = TRAINING_RUNS + TEST_RUNS
DIVES = (
    *(Dive(f"steps {seconds} s", STEPS, float(seconds)) for seconds in (100, 200, 400, 800)),
    Dive(
        "transit, then steps",
        (
            _after(TRANSIT, "transit-yaw", 2133.0, True, False),
            _after(TRANSIT, "transit-depth", 2133.0, False, True),
            *TRAINING_RUNS,
        ),
        800.0,
    ),
)


def sail(
    truth: str, dive: Dive, seeds: Sequence[int], conditions: Conditions = WHITE_NOISE
) -> list[Campaign]:
    """Return the dive of each seed; all runs are training."""
    plan = replace(CampaignSetup.of(truth), training_runs=dive.runs, test_runs=dive.runs[:1])
    return list(plan.simulate(seeds, dive.duration, conditions))


def rows(log: hd.Log, begins: float = 0.0) -> Iterator[Row]:
    """Yield the rows of a log from a time [s] on."""
    for row in rows_of(log):
        time = read_number(row, "time") + begins
        yield {**row, "time": time, "segment": f"{begins} {row['segment']}"}
