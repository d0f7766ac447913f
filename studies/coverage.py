"""Measure how many coefficients of each grade are right within their promise.

    python studies/coverage.py --out FOLDER [--data DATA] [--draws N] [--page PAGE]

The estimates, intervals and grades are those of the default method. Simulated logs are drawn again
and again with other sensor errors and pushes of four strengths: of the paper's vehicle, four
training runs of 45 s under its autopilot, and of the BlueROV2, four runs of 45 s of a joystick. The
target of a coefficient is its true value where the model holds the truth; where it does not, the
value that the same method finds in 16 other draws together. The Cramér-Rao bound is the inverse
information of the filtered innovations at the truth, with the true noise, for free initial states.
Measured logs are cut in two halves by segments in turn. DATA has their folders, as in
``HYDRODAMP_DATA``; those that are absent are skipped.
Finished rows stand in ``FOLDER/rows.jsonl`` and are not computed again.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import hydrodamp as hd
from benchmark_campaign import Campaign
from benchmark_campaigns import PAPER, ROV, tether
from conditions import COLOURED, Coloured
from consistency import DURATION, MODEL, bound_covariance, true_coefficients
from coverage_tables import MEASURED, PSEUDO_TRUE, TRUE, WHOLE, Row, summarise
from hydrodamp.arrays import FloatArray
from hydrodamp.files import save_text
from hydrodamp.identification.identifiability import grade_fit
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from measured_splits import measured
from tables import finish_jobs, replace_table

MARKS = ("<!-- coverage -->", "<!-- end of coverage -->")
"""Marks of the page between which the tables stand."""

LEVELS = (0.0, 0.3, 1.0, 3.0)
"""Pushes in published ones."""

TETHER = tether(1.0, coloured=True)

TWIN = {**{f"push {level:g}": COLOURED.push_times(level) for level in LEVELS}, "white": Coloured()}
"""Errors of the twin's sensors; an autopilot answers the pushes."""

TETHERED = {
    **{f"push {level:g}": TETHER.push_times(level) for level in LEVELS},
    "white": Coloured(),
}
"""Errors of the ROV's sensors; nothing answers the pushes."""

OUTSIDE_ERRORS = ("push 0", "push 1")
"""Errors with which models that do not hold the truth are identified."""

OUTSIDE = tuple(hd.find_model(key) for key in ("prestero", "fossen", "linear"))
"""Models that do not hold the truth of the twin."""

FIRST_SEED, N_TOGETHER = 5000, 16
"""Seed of the first draw; draws whose runs together give the pseudo-true value."""

Job = Callable[[], Iterator[Row]]

BATCH = 5
"""Draws of a job."""


def identify(
    log: str,
    errors: str,
    draw: str,
    problem: hd.Problem,
    model: hd.DampingModel,
    bound: FloatArray | None = None,
) -> Row:
    """Return what the default says of every coefficient; nothing where it fails."""
    fit = hd.find_method("recommended").identify(problem, model)
    if not fit.status.usable or fit.uncertainty is None:
        return Row(log, errors, draw, model.key)
    grades = [grade.word for grade in grade_fit(problem, fit).grades.values()]
    std, factor = fit.uncertainty.standard_errors, fit.uncertainty.critical_value()
    estimates = fit.damping.coefficients.tolist(), std.tolist(), (factor * std).tolist()
    limit = [] if bound is None else bound.tolist()
    return Row(log, errors, draw, model.key, list(fit.model.labels), *estimates, grades, limit)


def prepare(vehicle: hd.Vehicle, log: hd.Log, model: hd.DampingModel) -> hd.Problem:
    """Return the problem without recorded accelerations."""
    return hd.prepare(vehicle, replace(log, acceleration=None), [model])


def simulate_twin(errors: str, draws: range, models: tuple[hd.DampingModel, ...]) -> Iterator[Row]:
    """Yield the rows of draws of the twin."""
    seeds = range(FIRST_SEED + draws.start, FIRST_SEED + draws.stop)
    campaigns = CampaignSetup.of("sname").simulate(seeds, DURATION, TWIN[errors])
    if MODEL in models and draws.start == 0:
        truth = true_coefficients().tolist()
        yield Row("slender", errors, TRUE, MODEL.key, list(MODEL.labels), truth)
    for draw, campaign in zip(draws, campaigns, strict=True):
        for model in models:
            problem = prepare(campaign.vehicle, campaign.train, model)
            bound = None
            if model is MODEL:
                bound = bound_covariance(problem, model, true_coefficients(), TWIN[errors])
            yield identify("slender", errors, str(draw), problem, model, bound)


def find_targets(errors: str) -> Iterator[Row]:
    """Yield the pseudo-true coefficients of the twin."""
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
        problem = prepare(logs.vehicle, logs.train, model)
        bound = bound_covariance(problem, model, logs.true.coefficients, TETHERED[errors])
        yield identify("ROV", errors, str(draw), problem, model, bound)


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
    jobs: dict[str, Job] = {}
    for draws, errors in itertools.product(batches, TWIN):
        jobs[f"slender/{errors}/{draws.start}"] = partial(simulate_twin, errors, draws, (MODEL,))
        jobs[f"ROV/{errors}/{draws.start}"] = partial(simulate_rov, errors, draws)
    jobs |= {f"targets/{errors}": partial(find_targets, errors) for errors in OUTSIDE_ERRORS}
    for draws, errors in itertools.product(batches, OUTSIDE_ERRORS):
        name = f"outside/{errors}/{draws.start}"
        jobs[name] = partial(simulate_twin, errors, draws, OUTSIDE)
    jobs["demo"] = simulate_demo
    for campaign in measured(data) if data else ():
        name = campaign.name.removeprefix("measured/").partition("-")[0]
        jobs.setdefault(name, partial(halve, name, campaign))
    return jobs


def main(
    out: Annotated[Path, typer.Option(help="Folder of the rows.")],
    data: Annotated[Path | None, typer.Option(help="Folder of measured logs.")] = None,
    draws: Annotated[int, typer.Option(min=2, help="Draws of each simulated log.")] = 20,
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run what is missing and print the tables."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    text = summarise(finish_jobs(out / "rows.jsonl", list_jobs(data, draws), Row))
    save_text(text, out / "coverage.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
