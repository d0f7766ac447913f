"""Measure how many coefficients of each grade are right within their promise.

    python studies/coverage.py --out FOLDER [--data DATA] [--draws N] [--page PAGE]

The estimates, intervals and grades are those of the default method. Simulated logs are drawn again
and again with other sensor errors (and pushes): of the paper's vehicle, four training runs of 45 s
under its autopilot, and of the BlueROV2, four runs of 45 s of a joystick. The target of a
coefficient is its true value where the model holds the truth; where it does not, the value that the
same method finds in 16 other draws together. Measured logs are cut in two halves by segments in
turn. DATA has their folders, as in ``HYDRODAMP_DATA``; those that are absent are skipped.
Finished rows stand in ``FOLDER/rows.jsonl`` and are not computed again.
"""

from __future__ import annotations

import itertools
import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

import hydrodamp as hd
from benchmark_campaign import Campaign
from benchmark_campaigns import PAPER, ROV, noise, tether
from benchmark_measured import measured
from conditions import COLOURED
from consistency import CONDITIONS, DURATION, MODEL, true_coefficients
from coverage_tables import MEASURED, PSEUDO_TRUE, TRUE, WHOLE, Row, summarise
from hydrodamp.files import save_text
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from tables import replace_table

MARKS = ("<!-- coverage -->", "<!-- end of coverage -->")
"""Marks of the page between which the tables stand."""

TWIN = {**CONDITIONS, "pushed": COLOURED}
"""Errors of the twin's sensors; an autopilot answers the pushes."""

TETHERED = {
    "white": noise(1.0),
    "coloured": noise(1.0, coloured=True),
    "pushed": tether(1.0, coloured=True),
}
"""Errors of the ROV's sensors; nothing answers the pushes."""

OUTSIDE = tuple(hd.find_model(key) for key in ("prestero", "fossen", "linear"))
"""Models that do not hold the truth of the twin."""

FIRST_SEED, N_TOGETHER = 5000, 16
"""Seed of the first draw; draws whose runs together give the pseudo-true value."""

Job = Callable[[], Iterator[Row]]

BATCH = 6
"""Draws of a job."""


def identify(log: str, errors: str, draw: str, problem: hd.Problem, model: hd.DampingModel) -> Row:
    """Return what the default says of every coefficient; nothing where it fails."""
    fit = hd.find_method("recommended").identify(problem, model)
    if not fit.status.usable or fit.uncertainty is None:
        return Row(log, errors, draw, model.key)
    grades = [grade.word for grade in grade_fit(problem, fit).grades.values()]
    std, factor = fit.uncertainty.standard_errors, fit.uncertainty.critical_value()
    estimates = fit.damping.coefficients.tolist(), std.tolist(), (factor * std).tolist()
    return Row(log, errors, draw, model.key, list(fit.model.labels), *estimates, grades)


def prepare(vehicle: hd.Vehicle, log: hd.Log, model: hd.DampingModel) -> hd.Problem:
    """Return the problem without recorded accelerations."""
    return hd.prepare(vehicle, replace(log, acceleration=None), [model])


def simulate_twin(errors: str, draws: range, models: tuple[hd.DampingModel, ...]) -> Iterator[Row]:
    """Yield the rows of draws of the twin."""
    seeds = range(FIRST_SEED + draws.start, FIRST_SEED + draws.stop)
    campaigns = CampaignSetup.of("sname").simulate(seeds, DURATION, TWIN[errors])
    for draw, campaign in zip(draws, campaigns, strict=True):
        for model in models:
            problem = prepare(campaign.vehicle, campaign.train, model)
            yield identify("slender", errors, str(draw), problem, model)


def find_targets(errors: str) -> Iterator[Row]:
    """Yield the true and the pseudo-true coefficients of the twin."""
    truth = true_coefficients().tolist()
    yield Row("slender", errors, TRUE, MODEL.key, list(MODEL.labels), truth)
    seeds = range(FIRST_SEED - N_TOGETHER, FIRST_SEED)
    campaigns = CampaignSetup.of("sname").simulate(seeds, DURATION, TWIN[errors])
    log = hd.concatenate([campaign.train for campaign in campaigns])
    for model in OUTSIDE:
        problem = prepare(campaigns[0].vehicle, log, model)
        yield identify("slender", errors, PSEUDO_TRUE, problem, model)


def simulate_rov(errors: str, draws: range) -> Iterator[Row]:
    """Yield the rows of draws of the ROV, and its true coefficients."""
    for draw in draws:
        logs = ROV(FIRST_SEED + draw, DURATION, TETHERED[errors])()
        assert logs.true is not None
        model = logs.true.model
        if draw == 0:
            truth = logs.true.coefficients.tolist()
            yield Row("ROV", errors, TRUE, model.key, list(model.labels), truth)
        yield identify("ROV", errors, str(draw), prepare(logs.vehicle, logs.train, model), model)


def simulate_demo() -> Iterator[Row]:
    """Yield the rows of the log of ``hydrodamp demo``."""
    campaign = hd.reenact()
    for model in PAPER:
        problem = prepare(campaign.vehicle, campaign.train, model)
        yield identify("demo", "", WHOLE, problem, model)


def halve(name: str, campaign: Campaign) -> Iterator[Row]:
    """Yield the rows of a measured log, of all runs and of every other one."""
    log = hd.concatenate([campaign.train, campaign.test])
    runs = sorted(segment.name for segment in log.segments)
    parts = {WHOLE: log, "0": log.select(*runs[::2]), "1": log.select(*runs[1::2])}
    for model in campaign.models:
        for draw, part in parts.items():
            yield identify(name, MEASURED, draw, prepare(campaign.vehicle, part, model), model)


def list_jobs(data: Path | None, n_draws: int) -> dict[str, Job]:
    """Return all jobs by name."""
    batches = [range(k, min(k + BATCH, n_draws)) for k in range(0, n_draws, BATCH)]
    jobs: dict[str, Job] = {"demo": simulate_demo}
    for campaign in measured(data) if data else ():
        name = campaign.name.removeprefix("measured/").partition("-")[0]
        jobs.setdefault(name, partial(halve, name, campaign))
    jobs |= {f"targets/{errors}": partial(find_targets, errors) for errors in TWIN}
    for errors, draws in itertools.product(TWIN, batches):
        jobs[f"slender/{errors}/{draws.start}"] = partial(simulate_twin, errors, draws, (MODEL,))
        jobs[f"ROV/{errors}/{draws.start}"] = partial(simulate_rov, errors, draws)
    for draws, errors in itertools.product(batches, TWIN):
        name = f"outside/{errors}/{draws.start}"
        jobs[name] = partial(simulate_twin, errors, draws, OUTSIDE)
    return jobs


def main(
    out: Annotated[Path, typer.Option(help="Folder of the rows.")],
    data: Annotated[Path | None, typer.Option(help="Folder of measured logs.")] = None,
    draws: Annotated[int, typer.Option(min=2, help="Draws of each simulated log.")] = 24,
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run what is missing and print the tables."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "rows.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    done = {job: [Row(*row) for row in rows] for job, rows in map(json.loads, lines)}
    jobs = list_jobs(data, draws)
    for name in track([name for name in jobs if name not in done], "identify"):
        done[name] = list(jobs[name]())
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([name, done[name]]) + "\n")
    text = summarise([row for rows in done.values() for row in rows])
    save_text(text, out / "coverage.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
