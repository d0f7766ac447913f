"""Measure how often nominal 95 % intervals cover what they should.

    python studies/coverage.py --draws 200 --out FOLDER

The campaign is sailed again and again in `COLOURED` conditions (their constants stand in
``conditions.py``): AR(1) errors on every sensor, and a wrench
that pushes the vehicle while the autopilot steers it on.

The target of a draw is the same estimator on the same trajectory without added noise:
the exact states of that very draw, with the pushes told as one more command. It cannot be
one target for all draws: the trajectories stray by 5 mm/s in sway, where the turns
themselves are 100 mm/s, and what the linear model makes of exact data then scatters as
much as its estimates do. The column "target moves" says how much, against the estimates.

A coefficient counts where most draws grade it as determined. That is decided once for all
draws: to count it only in the draws that grade it so would select those draws in which it
came out large. Coverage is averaged over coefficients; its error is that of a mean over
draws, since the coefficients of a draw err together. "Without bias" is the coverage of
intervals moved by the mean miss: it tells a wrong width from a wrong place.

The table of bias compares the methods on the same coefficients: those that count for the
first one. A bias is a mean miss; it stands in standard deviations of the miss over draws
and in per cent of the target, the median over the coefficients.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import track

from conditions import COLOURED, training_pushes
from coverage_tables import Draws, Key, bias_table, coverage_table, markdown, show, summary
from hydrodamp import (
    AXES,
    Campaign,
    Fit,
    Log,
    Matrix,
    Problem,
    Vehicle,
    find_method,
    find_model,
    prepare,
)
from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.files import open_atomic
from hydrodamp.identification.fit import Uncertainty, critical_value
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.identifiability import (
    analyse_excitation,
    grade_by_excitation,
    identifiability,
)
from hydrodamp.simulation.campaign import reenact

LEVEL = 0.95
"""Nominal coverage of the intervals."""

PUSHES = tuple(f"push_{axis}" for axis in AXES)
"""Names of the pushes where they are told as commands."""


@dataclass(frozen=True)
class Plan:
    """What is studied: which methods and models, on which campaign."""

    methods: tuple[str, ...]
    models: tuple[str, ...]
    truth: str
    duration: float


def interval(fit: Fit) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return both ends of every coefficient's interval, and its standard error.

    That of noise alone, where the fit tells it apart from misfit: the target is made from the
    same trajectory. A fit without an uncertainty of its own gets the normal law.
    """
    estimate, covariance = fit.damping.coefficients, fit.damping.covariance
    if covariance is None:
        nothing = np.full_like(estimate, np.nan)
        return nothing, nothing, nothing
    found = (fit.uncertainty or Uncertainty(covariance, np.inf, "the fit")).noise_only
    low, high = found.interval(estimate, LEVEL).T
    return low, high, found.standard_errors


def determined(problem: Problem, fit: Fit) -> BoolArray:
    """Return which coefficients are graded determined or minor by the fit's own intervals."""
    if not fit.status.usable:
        return np.zeros(fit.model.n_coefficients, dtype=bool)
    covariance = fit.damping.covariance
    if fit.uncertainty is not None:
        covariance = fit.uncertainty.noise_only.covariance
    if covariance is None:
        found = identifiability(problem, fit.model)
    else:
        half = critical_value(LEVEL, np.inf) * np.sqrt(np.diag(covariance))
        found = grade_by_excitation(analyse_excitation(problem, fit.model), half)
    return np.array(
        [found.grades[label] in (Grade.DETERMINED, Grade.MINOR) for label in fit.model.labels]
    )


def told(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle with the pushes among its actuators."""
    pushed = Matrix(PUSHES, np.eye(6).tolist())
    return replace(vehicle, actuators=(*vehicle.actuators, pushed))


def noiseless(campaign: Campaign, seed: int) -> Log:
    """Return the exact log without accelerations, but with the pushes as commands."""
    log = campaign.exact_train
    return replace(
        log,
        acceleration=None,
        command_names=log.command_names + PUSHES,
        commands=np.hstack((log.commands, training_pushes(campaign, seed, COLOURED))),
    )


def sampled(plan: Plan, seeds: range) -> dict[Key, Draws]:
    """Return what every method says of every model, for some seeds."""
    parts: dict[Key, list[Draws]] = {}
    models = [find_model(key) for key in plan.models]
    campaigns = reenact.CampaignSetup.of(plan.truth).simulate(seeds, plan.duration, COLOURED)
    for seed, campaign in zip(seeds, campaigns, strict=True):
        noisy = prepare(campaign.vehicle, campaign.train, models)
        exact = prepare(told(campaign.vehicle), noiseless(campaign, seed), models)
        for method in plan.methods:
            for model in plan.models:
                parts.setdefault((method, model), []).append(one(noisy, exact, method, model))
    return {key: Draws.joined(several) for key, several in parts.items()}


def one(noisy: Problem, exact: Problem, method: str, model: str) -> Draws:
    """Return the single draw of a method and a model."""
    way = find_method(method)
    fit = way.identify(noisy, find_model(model))
    aim = way.identify(exact, find_model(model))
    low, high, error = (values[np.newaxis] for values in interval(fit))
    graded = determined(noisy, fit)[np.newaxis]
    return Draws(_numbers(fit), _numbers(aim), low, high, error, graded)


def _numbers(fit: Fit) -> FloatArray:
    return fit.damping.coefficients[np.newaxis] * (1.0 if fit.status.usable else np.nan)


def all_draws(plan: Plan, n_draws: int, first: int, workers: int) -> dict[Key, Draws]:
    """Return all draws, on several processes."""
    size = max(1, min(10, math.ceil(n_draws / workers)))
    last = first + n_draws
    batches = [range(start, min(start + size, last)) for start in range(first, last, size)]
    done = dict(_in_processes(plan, batches, workers))
    return {key: Draws.joined([done[batch][key] for batch in batches]) for key in done[batches[0]]}


def _in_processes(
    plan: Plan, batches: list[range], workers: int
) -> Iterator[tuple[range, dict[Key, Draws]]]:
    console = Console(stderr=True)
    if workers == 1:
        for batch in track(batches, "Draws", console=console, transient=True):
            yield batch, sampled(plan, batch)
        return
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        futures = {pool.submit(sampled, plan, batch): batch for batch in batches}
        arriving = as_completed(futures)
        for future in track(arriving, "Draws", len(batches), console=console, transient=True):
            yield futures[future], future.result()


def main(
    out: Annotated[Path, typer.Option(help="Folder for coverage.md and coverage.json.")],
    draws: Annotated[int, typer.Option(min=2, help="How many campaigns.")] = 200,
    duration: Annotated[float, typer.Option(help="Length of each run [s].")] = 45.0,
    truth: Annotated[str, typer.Option(help="sname or crossflow.")] = "sname",
    methods: Annotated[str, typer.Option(help="Keys, joined by commas.")] = "recommended,weak,ls",
    models: Annotated[str, typer.Option(help="Likewise.")] = "linear,prestero,gertler-hagen",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first campaign.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = os.cpu_count() or 1,
) -> None:
    """Measure how often nominal 95 % intervals cover their target."""
    plan = Plan(tuple(methods.split(",")), tuple(models.split(",")), truth, duration)
    result = summary(all_draws(plan, draws, seed, workers))
    tables = {
        "Coverage of nominal 95 % intervals": coverage_table(result),
        "Bias against the target, in spreads and in per cent": bias_table(result),
    }
    said = {"draws": draws, "duration": duration, "truth": truth, "first_seed": seed}
    out.mkdir(parents=True, exist_ok=True)
    with open_atomic(out / "coverage.json") as stream:
        json.dump({**said, **result}, stream, indent=1)
    with open_atomic(out / "coverage.md") as stream:
        stream.write("\n\n".join(f"{name}:\n\n{markdown(one)}" for name, one in tables.items()))
    for name, table in tables.items():
        show(name, table)


if __name__ == "__main__":
    typer.run(main)
