"""Measure false alarms and detection of `hydrodamp live`: ``python studies/live_false_alarms.py``.

Campaigns in which nothing changes, for models with and without the vehicle's terms, on both truths;
and campaigns after which the vehicle is another. Sensor noise is coloured, and forces push.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import count, islice, takewhile
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import hydrodamp as hd
from benchmark_campaigns import noise
from hydrodamp.live.estimator import LiveState, start, update
from hydrodamp.live.samples import read_number
from hydrodamp.simulation.campaign.reenact import PAUSE, Campaign, CampaignSetup
from live_alarm import Change, dragged
from live_campaigns import DIVES, MODELS, STEPS, TRUTHS, Dive, rows, sail
from tables import replace_table

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "change-detection.md"
MARKS = ("<!-- alarm -->", "<!-- end of alarm -->")

CHANGES = (
    Change("drag", 0.1),
    Change("drag", 0.2),
    Change("actuator", 0.2),
    Change("actuator", 0.5),
    Change("payload, heavy", 0.05),
)
BASE = next(dive for dive in DIVES if dive.name == "steps 200 s")
SEA = noise(1.0, 1.0, coloured=True)
WAIT = 300.0
"""For an alarm after a change [s]."""

Quiet = tuple[str, str, str, float, list[tuple[float, str]], str]
"""Model, truth, name and hours of a campaign, its alarms, and the axes armed at the end."""


def follow(
    state: LiveState | None,
    model: hd.DampingModel,
    vehicle: hd.Vehicle,
    log: hd.Log,
    end: float = np.inf,
) -> tuple[LiveState, list[tuple[float, str]]]:
    """Return the state after a log up to its end [s], and when alarms rang, on which axis first."""
    begins = 0.0 if state is None else state.validator.time + PAUSE
    rang = []
    for row in takewhile(lambda row: read_number(row, "time") < begins + end, rows(log, begins)):
        state = start(vehicle, model, "rls", row) if state is None else state
        before = state.alarm.changes
        state, _ = update(state, row)
        if state.alarm.changes > before and state.alarm.last:
            rang.append((state.validator.time - begins, state.alarm.last.axes[0]))
    assert state is not None
    return state, rang


def sail_changed(truth: str, change: Change, seed: int) -> Campaign:
    """Return the runs of the base in another order, with another vehicle."""
    plan = CampaignSetup.of(truth)
    water = plan.truth
    if change.kind == "drag":
        water = replace(water, damping=dragged(water.damping, change.share))
    vehicle = change.finned(change.loaded(plan.vehicle))
    runs = STEPS[::-1]
    plan = replace(plan, vehicle=vehicle, truth=water, training_runs=runs, test_runs=runs[:1])
    return plan.simulate((seed,), BASE.duration, SEA)[0]


def quiet(task: tuple[str, Dive, int]) -> list[Quiet]:
    """Return hours, alarms and armed axes at the end, of each model on a quiet campaign."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    truth, dive, seed = task
    campaign, found = sail(truth, dive, [seed], SEA)[0], []
    for key in MODELS:
        state, rang = follow(None, hd.catalog[key], campaign.vehicle, campaign.train)
        axes = np.unique(state.rls.adaptation.settings.axes).tolist()
        armed = "".join(state.alarm.line(axes)["armed"])
        hours = len(dive.runs) * dive.duration / 3600.0
        found.append((key, truth, dive.name, hours, list(rang), armed))
    return found


def detect(task: tuple[str, int]) -> list[tuple[str, str, Change, tuple[float, str] | None]]:
    """Return how soon each change is found with each model, if it is."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    truth, seed = task
    base, found = sail(truth, BASE, [seed], SEA)[0], []
    states = {key: follow(None, hd.catalog[key], base.vehicle, base.train)[0] for key in MODELS}
    for change in CHANGES:
        log = sail_changed(truth, change, seed + 100_000).train
        for key, state in states.items():
            rang = follow(state, hd.catalog[key], base.vehicle, log, WAIT)[1]
            found.append((key, truth, change, rang[0] if rang else None))
    return found


def false_alarms(found: list[Quiet]) -> Iterator[str]:
    """Yield the table of quiet campaigns."""
    yield "| model | truth | campaigns | hours | false alarms | armed at the end |"
    yield "|---|---|---|---|---|---|"
    groups = defaultdict(list)
    for one in found:
        groups[one[:2]].append(one)
    for (key, truth), some in groups.items():
        armed = ", ".join(
            f"{axis} {sum(axis in one[5] for one in some)}"
            for axis in "XYZKMN"
            if any(axis in one[5] for one in some)
        )
        alarms, hours = sum(len(one[4]) for one in some), sum(one[3] for one in some)
        yield f"| {key} | {truth} | {len(some)} | {hours:.1f} | {alarms} | {armed} |"


def detections(found: list[tuple[str, str, Change, tuple[float, str] | None]]) -> Iterator[str]:
    """Yield the table of changes."""
    columns = [(key, truth) for key in MODELS for truth in TRUTHS]
    yield "| change | " + " | ".join(f"{key}, {truth}" for key, truth in columns) + " |"
    yield "|---" * (len(columns) + 1) + "|"
    for change in CHANGES:
        cells = []
        for pair in columns:
            rings = [one[3] for one in found if one[:2] == pair and one[2] == change]
            heard = [ring for ring in rings if ring]
            cell = f"{len(heard)} of {len(rings)}"
            if heard:
                delays = [delay for delay, _ in heard]
                axes = " ".join(sorted({axis for _, axis in heard}))
                cell += f", {np.median(delays):.0f} s (at most {max(delays):.0f}), {axes}"
            cells.append(cell)
        yield f"| {change.kind} {100 * change.share:.0f} % | {' | '.join(cells)} |"


def main() -> None:
    """Measure, print as it comes, and put the tables on their page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=7000, help="the design used 31, 41 and 141")
    parser.add_argument("--each", type=int, default=4, help="campaigns of each truth that change")
    parser.add_argument("--minutes", type=float, default=60.0, help="time for quiet campaigns")
    parser.add_argument("--write", action="store_true", help="into the page")
    given = parser.parse_args()
    seeds = [given.seed + 900 + k for k in range(given.each)]
    tasks = (
        (truth, dive, given.seed + n + 50 * k)
        for n in count()
        for k, dive in enumerate(DIVES)
        for truth in TRUTHS
    )
    still, changed = [], []
    with get_context("spawn").Pool(2) as pool:
        for some in pool.imap_unordered(detect, [(t, s) for s in seeds for t in TRUTHS]):
            changed += some
            for key, truth, change, ring in some:
                print("changed", key, truth, change, ring, flush=True)
        end = time.monotonic() + 60.0 * given.minutes
        while time.monotonic() < end:
            for one in pool.map(quiet, islice(tasks, 2), chunksize=1):
                still += one
                for key, truth, name, _, rang, armed in one:
                    print("quiet", key, truth, name, rang, armed, flush=True)
    still.sort(key=lambda one: (MODELS.index(one[0]), one[1]))
    text = "\n".join([*false_alarms(still), "", *detections(changed)])
    print(text)
    if given.write:
        replace_table(PAGE, MARKS, text)


if __name__ == "__main__":
    main()
