"""Compare the error of estimates from logs of growing length with the Cramér-Rao bound.

    python studies/consistency.py --out FOLDER [--page PAGE]

The model holds the truth: Prestero's terms and the roll of the published set. A log of length k is
k repetitions of the four training runs with other sensor errors, k = 1, 4, 16, 64. With the
sensitivities S of the replay of the exact test runs and F = mean SᵀS / σ², the error of an estimate
is ``e = sqrt((κ − κ₀)ᵀ F (κ − κ₀))``, the expected replay error in standard deviations of the
sensors. The bound is ``sqrt(tr(F I⁻¹))`` with the Fisher information I of the training runs, for
free initial states and a known covariance of the errors of the velocities (AR(1) if coloured).
Finished rows stand in ``FOLDER/rows.jsonl`` and are not computed again.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
from benchmark_tables import table
from conditions import COLOURED, Coloured
from hydrodamp.arrays import FloatArray
from hydrodamp.files import save_text
from hydrodamp.identification.continuation import make_objective
from hydrodamp.identification.prediction_error import filter_windows, project_states
from hydrodamp.kernels import core
from hydrodamp.kernels.kalman import Noise
from hydrodamp.simulation.campaign.conditions import true_damping
from hydrodamp.simulation.campaign.reenact import CampaignSetup
from hydrodamp.simulation.problem import Problem
from tables import finish_jobs, replace_table

MARKS = ("<!-- consistency -->", "<!-- end of consistency -->")
"""Marks of the page between which the table stands."""

DURATION = 45.0
"""Duration of a run [s]."""

DRAWS = {1: 16, 4: 8, 16: 4, 64: 2}
"""Draws of each length."""

METHODS = ("weak", "oe", "recommended", "ls")
"""Methods of the study."""

MODEL = hd.catalog["prestero"].with_terms({"K": "up"}, key="prestero+up")
"""The model that holds the truth."""

CONDITIONS = {
    "white": Coloured(),
    "coloured": replace(COLOURED, push=(0.0,) * 6),
}
"""Sensor errors: published variances, white or AR(1); nothing pushes the vehicle."""


class Row(NamedTuple):
    """Error of one estimate, in standard deviations of the sensors."""

    noise: str
    length: int
    draw: int
    method: str
    error: float


def true_coefficients() -> FloatArray:
    """Return κ₀."""
    truth = true_damping().as_dict()
    return np.array([truth.get(label, 0.0) for label in MODEL.labels])


def sensitivities(problem: Problem, coefficients: FloatArray) -> FloatArray:
    """Return the derivatives (n, 6, p + 6) of a replay by coefficients and initial states."""
    entries = problem.equations.entries(MODEL)
    matrix = problem.equations.with_unknown(entries, coefficients)
    arguments = problem.equations.plant, matrix, problem.inputs, problem.segments, entries
    return core.replay(*arguments, block=1)[2]


def velocity_errors(conditions: Coloured) -> tuple[FloatArray, FloatArray]:
    """Return standard deviation and correlation over one step of the errors of the velocities."""
    errors = conditions.sample_sensor_errors(0, 1, 20_000)[:, 0, :6]
    times = np.array(conditions.correlation_times[:6])
    safe = np.where(times > 0.0, times, 1.0)
    return errors.std(axis=0), np.where(times > 0.0, np.exp(-0.1 / safe), 0.0)


def fisher_information(problem: Problem, coefficients: FloatArray, std: FloatArray,
                       correlation: FloatArray) -> FloatArray:  # fmt: skip
    """Return the information on the coefficients, free initial states eliminated."""
    rows = sensitivities(problem, coefficients) / std[:, None]
    p = len(coefficients)
    information = np.zeros((p, p))
    for start, stop in problem.segments.tolist():
        run = rows[start:stop].copy()
        innovation_std = np.sqrt(1.0 - correlation**2)[:, None]
        run[1:] = (run[1:] - correlation[:, None] * rows[start : stop - 1]) / innovation_std
        flat = run.reshape(-1, p + 6)
        normal = flat.T @ flat
        cross = normal[:p, p:]
        information = (
            information + normal[:p, :p] - cross @ np.linalg.pinv(normal[p:, p:]) @ cross.T
        )
    return np.asarray(information)


def bound_covariance(
    problem: Problem, model: hd.DampingModel, truth: FloatArray, conditions: Coloured
) -> FloatArray:
    """Return the inverse information of the filtered innovations at the truth."""
    std, correlation = velocity_errors(conditions)
    least = np.maximum(conditions.push, 1e-6), np.maximum(correlation, 1e-3)
    true_noise = Noise(least[0], std, least[1], conditions.push_time, 0.1)
    windows = make_objective(problem, model).windows(np.inf)
    innovations, _, slopes = filter_windows(windows, truth, true_noise, windows.entries)
    rows = project_states(windows, innovations, slopes)[1].reshape(-1, len(truth))
    return np.asarray(np.linalg.inv(rows.T @ rows))


def measure(noise: str) -> tuple[FloatArray, FloatArray]:
    """Return the metric F of the errors and the Fisher information of one set of runs."""
    silent = hd.reenact(duration=DURATION, conditions=Coloured(scale=0.0))
    truth, (std, correlation) = true_coefficients(), velocity_errors(CONDITIONS[noise])
    test, train = (
        hd.prepare(silent.vehicle, replace(log, acceleration=None), [MODEL])
        for log in (silent.exact_test, silent.exact_train)
    )
    rows = (sensitivities(test, truth)[:, :, : len(truth)] / std[:, None]).reshape(-1, len(truth))
    metric = rows.T @ rows / len(rows)
    return metric, fisher_information(train, truth, std, correlation)


def identify(noise: str, length: int, draw: int) -> Iterator[Row]:
    """Yield the rows of one log."""
    metric, _ = measure(noise)
    seeds = range(1000 * draw + 1, 1000 * draw + 1 + length)
    campaigns = CampaignSetup.of("sname").simulate(seeds, DURATION, CONDITIONS[noise])
    log = hd.concatenate([campaign.train for campaign in campaigns])
    problem = hd.prepare(campaigns[0].vehicle, replace(log, acceleration=None), [MODEL])
    for key in METHODS:
        error = hd.find_method(key).identify(problem, MODEL).damping.coefficients
        error = error - true_coefficients()
        yield Row(noise, length, draw, key, float(np.sqrt(error @ metric @ error)))


def summarise(rows: list[Row]) -> str:
    """Return the tables: RMS error by length, its slope, and its ratio to the bound."""
    body, lengths = [], sorted({row.length for row in rows})
    for noise in CONDITIONS:
        metric, information = measure(noise)
        bound = float(np.sqrt(np.trace(metric @ np.linalg.inv(information))))
        body.append([noise, "bound", *(f"{bound / np.sqrt(k):.4f}" for k in lengths), "-0.50", ""])
        for method in METHODS:
            error = {
                k: [row.error for row in rows if row[:2] == (noise, k) and row.method == method]
                for k in lengths
            }
            rms = np.array([np.sqrt(np.mean(np.square(error[k]))) for k in lengths])
            slope = np.polyfit(np.log(lengths), np.log(rms), 1)[0]
            ratio = rms * np.sqrt(lengths) / bound
            cells = (f"{value:.4f} ({r:.2f})" for value, r in zip(rms, ratio, strict=True))
            body.append([noise, f"`{method}`", *cells, f"{slope:.2f}", f"{np.median(ratio):.2f}"])
    header = ["noise", "method", *(f"length {k}" for k in lengths), "slope", "median ratio"]
    return table(header, body)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the rows.")],
    page: Annotated[Path | None, typer.Option(help="Page to insert the table into.")] = None,
) -> None:
    """Run what is missing and print the table."""
    out.mkdir(parents=True, exist_ok=True)
    jobs = {
        f"{noise}/{k}/{draw}": partial(identify, noise, k, draw)
        for noise in CONDITIONS
        for k, n in DRAWS.items()
        for draw in range(n)
    }
    text = summarise(finish_jobs(out / "rows.jsonl", jobs, Row))
    save_text(text, out / "consistency.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
