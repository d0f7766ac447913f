"""Measure the change test of a season: ``python studies/season_changes.py FOLDER``.

Seasons of twenty days are simulated in memory: seasons in which nothing changes count false
changes, and seasons whose surge drag grows after the twelfth day count the changes found. Each
dive of 120 s makes four blocks; a day has one, two or four dives. ``FOLDER`` keeps the estimates,
so that the command resumes where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import hydrodamp as hd
from conditions import SILENT, autoregression
from hydrodamp.batch.changepoints import find_change_points
from hydrodamp.batch.sufficient_statistics import merge_statistics, solve_model, summarise_log
from hydrodamp.files import save_text
from hydrodamp.identification.fit import Fit
from hydrodamp.simulation.campaign.conditions import (
    COMMAND_PERIOD,
    DEPTH_STEPS,
    HEADING_STEPS,
    SENSOR_VARIANCES,
    Run,
    StepSequence,
    true_damping,
)
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from tables import replace_table

MODEL, METHOD = hd.catalog["prestero"], hd.WeakForm()

DAYS, CHANGED, DIVES = 20, 12, (1, 2, 4)
"""Days of a season, days before a change, and dives a day: 4, 8 and 16 blocks."""

DURATION = 120.0
"""Length of a dive [s]."""

DRAGS = (1.0, 1.05, 1.1, 1.2)
"""Surge drag after the change; 1 for a quiet season."""

N_QUIET, N_CHANGED = 100, 12
"""Seasons of each cell."""

FIRST_SEED = 1_000_000
"""Of the published table; seeds below this were used to choose the test."""

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "compare-many-logs.md"
MARKS = ("<!-- changes -->", "<!-- end of changes -->")
"""Where the table stands, between these marks."""

POOL = 320
"""Dives with different manoeuvres; a season draws its own without repetition."""

CORRELATION_TIME = 2.0
"""Of coloured noise [s]."""

CELLS = tuple(product(("sname", "crossflow"), ("same", "random"), ("white", "coloured")))
"""Truth, manoeuvres of the days, and noise of the velocities and attitude."""


def random_runs(n: int) -> tuple[Run, ...]:
    """Return dives with random speeds, heading steps and depth steps."""
    rng = np.random.default_rng(33)

    def steps(changes: tuple[float, ...], shortest: float) -> StepSequence:
        sizes = rng.permutation(changes) * rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0)
        return StepSequence(
            tuple(sizes), tuple(shortest * rng.uniform(1.0, 2.0, 5)), rng.uniform(2, 10)
        )

    return tuple(
        Run(
            f"dive-{k}",
            rng.uniform(1800.0, 2600.0),
            steps(HEADING_STEPS, 12),
            steps(DEPTH_STEPS, 9),
        )
        for k in range(n)
    )


@cache
def dives(truth: str, drag: float) -> tuple[hd.Vehicle, tuple[hd.Log, ...]]:
    """Return the vehicle and its noise-free dives with so many times its surge drag."""
    runs = random_runs(POOL + 1)
    plan = replace(CampaignSetup.of(truth), training_runs=runs[:-1], test_runs=runs[-1:])
    known = plan.truth.damping
    more = np.where([label == "X_u|u|" for label in known.model.labels], drag, 1.0)
    water = replace(plan.truth, damping=replace(known, coefficients=more * known.coefficients))
    (campaign,) = replace(plan, truth=water).simulate((0,), DURATION, SILENT)
    train = campaign.train
    return campaign.vehicle, tuple(train.select(one.name) for one in train.segments)


def measured(log: hd.Log, noise: str, rng: np.random.Generator) -> hd.Log:
    """Return a dive as its sensors see it."""
    time = CORRELATION_TIME if noise == "coloured" else 0.0
    normal = rng.standard_normal((log.n, 1, 6))
    errors = autoregression(normal, (time,) * 6, COMMAND_PERIOD)[:, 0] * np.sqrt(
        SENSOR_VARIANCES[:6]
    )
    return replace(log, velocity=log.velocity + errors)


def season(cell: tuple[str, str, str], seed: int, drag: float) -> dict[int, list[Fit]]:
    """Return the fits of all days of a season, for each number of blocks a day."""
    truth, manoeuvres, noise = cell
    rng = np.random.default_rng([seed, CELLS.index(cell)])
    vehicle, before = dives(truth, 1.0)
    after = dives(truth, drag)[1]
    chosen = rng.permutation(POOL)[: DAYS * DIVES[-1]].reshape(DAYS, -1)
    if manoeuvres == "same":
        chosen[:] = np.arange(DIVES[-1])
    fits: dict[int, list[Fit]] = {4 * n: [] for n in DIVES}
    for day, indices in enumerate(chosen.tolist()):
        logs = [(after if day >= CHANGED else before)[index] for index in indices]
        folds = [summarise_log(measured(log, noise, rng), vehicle, [MODEL], METHOD) for log in logs]
        for n in DIVES:
            fits[4 * n].append(solve_model(merge_statistics(folds[:n]), vehicle, MODEL, METHOD))
    return fits


def result(fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the changes found in a season, and the share of intervals that cover the truth."""
    truth = true_damping().as_dict()
    known = [(k, truth[label]) for k, label in enumerate(MODEL.labels) if label in truth]
    covered = []
    for fit in fits:
        if fit.uncertainty is not None:
            low, high = fit.uncertainty.interval(fit.damping.coefficients).T
            covered += [low[k] <= value <= high[k] for k, value in known]
    found = [(change.label, change.first) for change in find_change_points(fits)]
    return {"changes": found, "covered": float(np.mean(covered))}


def run(cell: tuple[str, str, str], seasons: Sequence[tuple[int, float]], path: Path) -> None:
    """Simulate the seasons of a cell that a file does not have yet, a line each."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    done = {(one["seed"], one["drag"]) for one in read(path)}
    with path.open("a", encoding="utf-8") as file:
        for seed, drag in seasons:
            if (seed, drag) not in done:
                found = {n: result(fits) for n, fits in season(cell, seed, drag).items()}
                print(json.dumps({"seed": seed, "drag": drag, "blocks": found}), file=file)
                file.flush()


def read(path: Path) -> list[dict[str, Any]]:
    """Return the results in a file; a line cut off by a kill is dropped."""
    lines = path.read_text("utf-8").splitlines(keepends=True) if path.exists() else []
    whole = [line for line in lines if line.endswith("\n")]
    if len(whole) < len(lines):
        save_text("".join(whole), path)
    return [json.loads(line) for line in whole]


def found_and_dated(result: dict[str, Any]) -> bool:
    """Return whether the change of the surge drag is found on its day."""
    return ["X_u|u|", CHANGED] in result["changes"]


def table(folder: Path) -> str:
    """Return false changes, changes found, and coverage, as Markdown."""
    blocks = [str(4 * n) for n in DIVES]
    lines = [
        "| truth | manoeuvres | noise | false changes | +5 % found | +10 % | +20 % | covered |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for cell in CELLS:
        seasons = read(folder / f"{'-'.join(cell)}.jsonl")
        parts = []
        for drag in DRAGS:
            own = [one["blocks"] for one in seasons if one["drag"] == drag]
            hit: Any = found_and_dated if drag > 1.0 else lambda one: bool(one["changes"])
            counts = [sum(hit(one[n]) for one in own) for n in blocks]
            parts.append(f"{', '.join(map(str, counts))} of {len(own)}")
        quiet = [one["blocks"] for one in seasons if one["drag"] == 1.0]
        shares = [100.0 * np.mean([one[n]["covered"] for one in quiet]) for n in blocks]
        right = ", ".join(f"{share:.0f}" for share in shares) + " %"
        parts.append(right if cell[0] == "sname" else "no truth")
        lines.append(f"| {' | '.join((*cell, *parts))} |")
    return "\n".join(lines)


def main() -> None:
    """Simulate, print the table, and put it on its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="for the results so far")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    asked = [(FIRST_SEED + k, 1.0) for k in range(N_QUIET)]
    asked += [(FIRST_SEED + k, drag) for drag in DRAGS[1:] for k in range(N_CHANGED)]
    with ProcessPoolExecutor(given.workers) as executor:
        tasks = [
            executor.submit(run, cell, asked, given.folder / f"{'-'.join(cell)}.jsonl")
            for cell in CELLS
        ]
        for task in tasks:
            task.result()
    text = table(given.folder)
    print(text)
    replace_table(PAGE, MARKS, text)


if __name__ == "__main__":
    main()
