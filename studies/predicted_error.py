"""Measure how often the predicted error of a mission covers its error, on new noise-free missions.

    python studies/predicted_error.py --out FOLDER [--draws N] [--page PAGE]

The default method identifies four training runs of 45 s, drawn with other sensor errors (and
pushes). The missions are runs of the same autopilot without errors: steps of depth and heading at
propeller speeds inside the range of the training runs, and steps of depth below the least speed at
which the training runs dive. A sample is covered if its error is inside the 95 % band, and the
ratio of a mission is the RMS of the predicted standard deviation over that of the error.
Finished rows stand in ``FOLDER/rows.jsonl`` and are not computed again.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
from benchmark_tables import table
from conditions import COLOURED, SILENT
from consistency import CONDITIONS, DURATION, MODEL
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.files import save_text
from hydrodamp.simulation.campaign.conditions import depth_run, heading_run
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from tables import finish_jobs, replace_table

MARKS = ("<!-- predicted error -->", "<!-- end of predicted error -->")
"""Marks of the page between which the tables stand."""

ERRORS = {**CONDITIONS, "pushed": COLOURED}
"""Errors of the training runs; the autopilot answers the pushes."""

MISSIONS = (
    *(depth_run(2350.0, 2), depth_run(1950.0, 1)),
    *(heading_run(1950.0, 1), heading_run(2500.0, 3)),
)
"""New missions: no training run dives below 2600 rpm."""

MISSION_DURATION = 90.0
"""Duration of a mission [s], twice that of a training run."""

MODELS = (MODEL, hd.find_model("prestero"), hd.find_model("fossen"))
"""The first holds the truth."""

FIRST_SEED = 7000
"""Seed of the first draw."""


class Row(NamedTuple):
    """One mission and velocity: share of covered samples, RMS of the error and of its prediction.

    A diverged replay has an infinite error; nothing is predicted without a covariance.
    """

    errors: str
    draw: int
    model: str
    mission: str
    velocity: str
    covered: float
    error: float
    predicted: float


@cache
def simulate_missions() -> hd.Log:
    """Return the missions without errors."""
    setup = replace(CampaignSetup.of("sname"), test_runs=MISSIONS)
    (campaign,) = setup.simulate((0,), MISSION_DURATION, SILENT)
    return replace(campaign.exact_test, acceleration=None)


def predict(errors: str, draw: int) -> Iterator[Row]:
    """Yield the rows of one draw."""
    setup, mission = CampaignSetup.of("sname"), simulate_missions()
    (campaign,) = setup.simulate((FIRST_SEED + draw,), DURATION, ERRORS[errors])
    for model in MODELS:
        problem = hd.prepare(campaign.vehicle, campaign.train, [model])
        fit = hd.find_method("recommended").identify(problem, model)
        if fit.uncertainty is None:
            continue
        band = hd.predict_error(campaign.vehicle, fit, mission)
        error = np.nan_to_num(np.abs(band.velocity - mission.velocity), nan=np.inf)
        std = np.nan_to_num(band.half_width / fit.uncertainty.critical_value())
        for segment in mission.segments:
            # a velocity that the mission leaves at rest has no error and no band
            rows, names = slice(segment.start, segment.stop), VELOCITIES
            for k in np.flatnonzero(np.ptp(mission.velocity[rows], axis=0) > 1e-6).tolist():
                covered = error[rows, k] <= np.nan_to_num(band.half_width[rows, k])
                sizes = (float(np.sqrt(np.mean(each[rows, k] ** 2))) for each in (error, std))
                key = errors, draw, model.key, segment.name, names[k]
                yield Row(*key, float(np.mean(covered)), *sizes)


def summarise(rows: list[Row]) -> str:
    """Return the tables: coverage by errors, model and velocity; predicted and actual errors."""
    return f"{coverage_table(rows)}\n\n{size_table(rows)}"


def coverage_table(rows: list[Row]) -> str:
    """Return the share of covered samples, with its standard error over draws."""
    lines = []
    for errors, model in dict.fromkeys((row.errors, row.model) for row in rows):
        cells = []
        of_case = [row for row in rows if (row.errors, row.model) == (errors, model)]
        for name in (None, *VELOCITIES):
            chosen = [row for row in of_case if name in (None, row.velocity)]
            draws = sorted({row.draw for row in chosen})
            means = [np.mean([row.covered for row in chosen if row.draw == k]) for k in draws]
            deviation = ""
            if name is None:
                deviation = f" ± {100 * np.std(means) / np.sqrt(max(len(means) - 1, 1)):.0f}"
            cells.append(f"{100 * np.mean(means):.0f}{deviation}" if means else "")
        lines.append([errors, f"`{model}`", str(len({row.draw for row in of_case})), *cells])
    return table(["errors", "model", "draws", "all [%]", *VELOCITIES], lines)


def size_table(rows: list[Row]) -> str:
    """Return median and 80 % range of the predicted over the actual RMS error, by mission."""
    lines = []
    for errors, model in dict.fromkeys((row.errors, row.model) for row in rows):
        cells = []
        for mission in dict.fromkeys(row.mission for row in rows):
            chosen = [row for row in rows if row[0] == errors and row[2:4] == (model, mission)]
            low, middle, high = np.quantile(
                [row.predicted / row.error for row in chosen], (0.1, 0.5, 0.9)
            )
            cells.append(f"{middle:.1f} ({low:.1f} to {high:.1f})")
        lines.append([errors, f"`{model}`", *cells])
    missions = dict.fromkeys(row.mission for row in rows)
    return table(["errors", "model", *missions], lines)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the rows.")],
    draws: Annotated[int, typer.Option(min=2, help="Draws of each kind of errors.")] = 20,
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run what is missing and print the tables."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    jobs = {
        f"{errors}/{draw}": partial(predict, errors, draw)
        for draw, errors in itertools.product(range(draws), ERRORS)
    }
    rows = finish_jobs(out / "rows.jsonl", jobs, Row)
    text = summarise(sorted(rows, key=lambda row: list(ERRORS).index(row.errors)))
    save_text(text, out / "predicted-error.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
