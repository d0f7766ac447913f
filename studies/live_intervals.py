"""Measure how often intervals of `hydrodamp live` cover: ``python studies/live_intervals.py``.

The truth of a model is least squares of the exact force over a long campaign of the same
manoeuvres without noise: the published coefficients where the model has the terms of the vehicle.
"""

from __future__ import annotations

import argparse
import warnings
from collections import defaultdict
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import hydrodamp as hd
from hydrodamp.live.estimator import estimate_line, start, update
from hydrodamp.simulation.campaign.conditions import TRAINING_RUNS, WHITE_NOISE
from live_campaigns import MODELS, TRUTHS, Dive, rows, sail
from tables import replace_table

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "change-detection.md"
MARKS = ("<!-- intervals -->", "<!-- end of intervals -->")

WIDTH = 1.959964
LONG = Dive("long", TRAINING_RUNS, 4000.0)
DURATIONS = (200.0, 400.0, 600.0, 800.0)
"""Of each of the four runs [s]."""


def pseudo_truth(truth: str, model: hd.DampingModel) -> hd.Damping:
    """Return what the model would be without noise, over long manoeuvres."""
    campaign = sail(truth, LONG, [0], replace(WHITE_NOISE, scale=0.0))[0]
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, model)
    return hd.LeastSquares().identify(problem, model).damping


def last_line(model: hd.DampingModel, vehicle: hd.Vehicle, log: hd.Log) -> dict[str, Any]:
    """Return the estimates at the end of a log."""
    state = None
    for row in rows(log):
        state = start(vehicle, model, "rls", row) if state is None else state
        state, _ = update(state, row)
    assert state is not None
    return estimate_line(state)


def main() -> None:
    """Measure and print a table; partial results as they come."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=20000)
    parser.add_argument("--each", type=int, default=4, help="campaigns of each duration")
    parser.add_argument("--write", action="store_true", help="into the page")
    given = parser.parse_args()
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    tasks = [(truth, key, given.seed, given.each) for truth in TRUTHS for key in MODELS]
    lines = [
        "| truth | model | axis | graded determined | covered | no interval: model form |",
        "|---|---|---|---|---|---|",
    ]
    with get_context("spawn").Pool(2) as pool:
        for some in pool.imap(measure, tasks):
            print(*some, sep="\n", flush=True)
            lines += some
    if given.write:
        text = "\n".join(line for line in lines if line.startswith("|"))
        replace_table(PAGE, MARKS, text)


def measure(task: tuple[str, str, int, int]) -> list[str]:
    """Return rows of the table of a model on a truth, and coefficients below 88 %."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    truth, key, seed, each = task
    model, lines = hd.catalog[key], []
    wanted = pseudo_truth(truth, model)
    misses: dict[str, list[float]] = defaultdict(list)
    silent: dict[str, int] = defaultdict(int)
    for k, duration in enumerate(DURATIONS):
        first = seed + 100 * k
        for campaign in sail(truth, Dive("", TRAINING_RUNS, duration), range(first, first + each)):
            line = last_line(model, campaign.vehicle, campaign.train)
            for axis in line["model_form"]:
                silent[axis] += 1
            for label, one in line["coefficients"].items():
                if one["grade"] == "determined":
                    misses[label].append((one["value"] - wanted[label]) / one["standard_error"])
    for axis in "XYZKMN":
        own = {label: np.array(some) for label, some in misses.items() if label[0] == axis}
        every = np.concatenate([*own.values(), np.zeros(0)])
        covered = f"{100 * np.mean(np.abs(every) < WIDTH):.0f} %" if len(every) else ""
        n = each * len(DURATIONS)
        row = f"| {truth} | {key} | {axis} | {len(every)} | {covered} | {silent[axis]} of {n} |"
        lines.append(row)
        lines += [
            f"{label}: {np.mean(np.abs(some) < WIDTH):.2f} of {len(some)}"
            for label, some in own.items()
            if np.mean(np.abs(some) < WIDTH) < 0.88
        ]
    return lines


if __name__ == "__main__":
    main()
