"""Measure how often intervals of `hydrodamp live` cover: ``python studies/live_intervals.py``.

The truth of a model is least squares of the exact force over a long campaign of the same
manoeuvres without noise: the published coefficients where the model has the terms of the vehicle.
"""

from __future__ import annotations

import argparse
import warnings
from collections import defaultdict
from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.live.loop import begin, estimates, take
from hydrodamp.simulation.campaign.autopilot import TRAINING
from hydrodamp.simulation.campaign.conditions import WHITE
from live_campaigns import MODELS, TRUTHS, Dive, rows, sail

WIDTH = 1.959964
LONG = Dive("long", TRAINING, 4000.0)
DURATIONS = (200.0, 400.0, 600.0, 800.0)
"""Of each of the four runs [s]."""


def pseudo_truth(truth: str, model: hd.DampingModel) -> hd.Damping:
    """Return what the model would be without noise, over long manoeuvres."""
    campaign = sail(truth, LONG, [0], replace(WHITE, scale=0.0))[0]
    problem = hd.prepare(campaign.vehicle, campaign.exact_train, model)
    return hd.LeastSquares().identify(problem, model).damping


def last_line(model: hd.DampingModel, vehicle: hd.Vehicle, log: hd.Log) -> dict[str, object]:
    """Return the estimates at the end of a log."""
    state = None
    for row in rows(log):
        state = begin(vehicle, model, "rls", row) if state is None else state
        state, _ = take(state, row)
    assert state is not None
    return estimates(state)


def main() -> None:
    """Measure and print a table; partial results as they come."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=9000)
    parser.add_argument("--each", type=int, default=5, help="campaigns of each duration")
    given = parser.parse_args()
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    print("| truth | model | axis | graded determined | covered | no interval: model form |")
    print("|---|---|---|---|---|---|")
    for truth in TRUTHS:
        campaigns = [
            one
            for k, duration in enumerate(DURATIONS)
            for one in sail(
                truth,
                Dive("", TRAINING, duration),
                range(given.seed + 100 * k, given.seed + 100 * k + given.each),
            )
        ]
        for key in MODELS:
            model = hd.catalog[key]
            wanted = pseudo_truth(truth, model)
            misses: dict[str, list[float]] = defaultdict(list)
            silent: dict[str, int] = defaultdict(int)
            for campaign in campaigns:
                line = last_line(model, campaign.vehicle, campaign.train)
                for axis in line["model_form"]:
                    silent[axis] += 1
                for label, one in line["coefficients"].items():
                    if one["grade"] == "determined":
                        miss = (one["value"] - wanted[label]) / one["standard_error"]
                        misses[label].append(miss)
            for axis in "XYZKMN":
                own = {label: some for label, some in misses.items() if label[0] == axis}
                every = np.concatenate([*own.values(), np.zeros(0)])
                covered = f"{100 * np.mean(np.abs(every) < WIDTH):.0f} %" if len(every) else ""
                print(
                    f"| {truth} | {key} | {axis} | {len(every)} | {covered} "
                    f"| {silent[axis]} of {len(campaigns)} |",
                    flush=True,
                )
                for label, some in own.items():
                    if np.mean(np.abs(some) < WIDTH) < 0.88:
                        share = np.mean(np.abs(some) < WIDTH)
                        print(
                            f"<!-- {label} {len(some)} {100 * share:.0f} % "
                            f"median {np.median(some):+.1f} -->",
                            flush=True,
                        )


if __name__ == "__main__":
    main()
