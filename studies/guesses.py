"""Measure how often wrong guesses of a vehicle file are named, and right ones contradicted.

    python studies/guesses.py --out FOLDER [--draws N] [--page PAGE]

A planar boat with a slender hull and two thrusters is simulated again and again with other commands
and sensor noise. One value of its file is wrong by 50 %: the added mass of an axis, or the gain of
the recorded wrench. The default method identifies the true terms; a value is named where the
verdict has a sentence on it. Finished rows stand in ``FOLDER/rows.jsonl``.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
from benchmark_tables import table
from hydrodamp.basis.term import AXES
from hydrodamp.data.log import Segment
from tables import finish_jobs, replace_table

MARKS = ("<!-- guesses -->", "<!-- end of guesses -->")
"""Marks of the page between which the table stands."""

HULL = replace(hd.Vehicle.from_hull(1.2, 0.17, 17.0), axes=("X", "Y", "N"))
"""Boat with the mass that it displaces."""

ARM = 0.3
"""Distance of each thruster from the centre line [m]."""

TRUTH = hd.Damping.from_dict(
    None,
    {"X_u": -3.0, "X_u|u|": -6.0, "Y_v": -8.0, "Y_v|v|": -40.0, "Y_r": 1.0}
    | {"N_v": 1.0, "N_r": -1.0, "N_r|r|": -2.0},
)

N_SAMPLES, STEP, HOLD = 1200, 0.1, 25
"""Samples of a log, their step [s], and samples of a thrust."""

NOISE = 5e-3
"""Standard deviation of the velocities [m/s, rad/s]."""

WRONG = 1.5
"""File value over the true one, or its inverse for half of the draws."""

FIRST_SEED, BATCH = 100, 5
"""Seed of the first draw; draws of a job."""

HEADER = ("file", "prior std", "draws", "named", "contradicted", "right ones contradicted")


class Row(NamedTuple):
    """Labels that are estimated, named and contradicted in a draw, and the wrong one."""

    case: str
    std: str
    wrong: str
    estimated: list[str]
    named: list[str]
    contradicted: list[str]


def sail(seed: int) -> hd.Log:
    """Return a log with the wrench of two thrusters, which change every few seconds."""
    rng = np.random.default_rng(seed)
    left, right = np.repeat(rng.uniform(-3.0, 10.0, (2, N_SAMPLES // HOLD)), HOLD, axis=1)
    wrench = np.zeros((N_SAMPLES, 6))
    wrench[:, 0], wrench[:, 5] = left + right, ARM * (left - right)
    time, start = STEP * np.arange(float(N_SAMPLES)), np.eye(N_SAMPLES, 6)
    segments = (Segment("1", 0, N_SAMPLES),)
    log = hd.Log(time, start, ("u", "v", "r"), wrench=wrench, segments=segments)
    velocity = hd.simulate(HULL, TRUTH, log).velocity
    return replace(log, velocity=velocity + NOISE * HULL.free * rng.standard_normal((N_SAMPLES, 6)))


def identify(case: str, std: str, wrong: str, draw: int) -> Row:
    """Return what the default says of the file of a draw."""
    log, factor = sail(FIRST_SEED + draw), WRONG if draw % 2 else 1.0 / WRONG
    added, priors = HULL.added_mass, dict(HULL.std)
    assert added is not None
    mass = HULL.mass_matrix - added
    if wrong.startswith("A_"):
        scale = np.ones(6)
        scale[AXES.index(wrong[-1])] = np.sqrt(factor)
        added = added * np.outer(scale, scale)
    if std:
        priors["added_mass"] = (float(std.rstrip(" %")) / 100.0,) * 6
    if case.startswith("gain"):
        priors["wrench_gain"] = (0.3,) * 6
    if wrong.startswith("gain"):
        assert log.wrench is not None
        log = replace(log, wrench=log.wrench * (1.0 / (1.5 if draw % 2 else 0.5)))
    vehicle = replace(HULL, mass_matrix=mass + added, added_mass=added, std=priors)
    problem = hd.prepare(vehicle, log, TRUTH.model)
    estimates = hd.find_method("recommended").identify(problem, TRUTH.model).estimates
    return Row(
        case,
        std or "of the hull",
        wrong,
        [label for label, each in estimates.items() if each.is_determined],
        [label for label, each in estimates.items() if each.is_moved],
        [label for label, each in estimates.items() if each.is_contradicted],
    )


def cases() -> Iterator[tuple[str, str, str]]:
    """Yield name, prior standard deviation of added mass, and wrong value of each file."""
    for std in ("", "30 %"):
        yield "right", std, ""
        for axis in HULL.axes:
            yield f"added mass {axis} wrong by 50 %", std, f"A_{axis}"
    yield "gain right", "", ""
    yield "gain 0.5 or 1.5", "", "gain"


def tabulate(rows: list[Row]) -> Iterator[list[str]]:
    """Yield the rates of each case."""
    for case, std, wrong in cases():
        draws = [row for row in rows if (row.case, row.wrong) == (case, wrong)]
        draws = [row for row in draws if row.std == (std or "of the hull")]
        if not draws:
            continue

        def rate(field: str, draws: list[Row] = draws, wrong: str = wrong) -> str:
            hits = [any(x.startswith(wrong) for x in getattr(row, field)) for row in draws]
            return f"{100.0 * np.mean(hits):.0f} %" if wrong else ""

        false = [any(not x.startswith(wrong or "-") for x in row.contradicted) for row in draws]
        cells = [rate("named"), rate("contradicted"), f"{100.0 * np.mean(false):.0f} %"]
        yield [case, std or "of the hull", str(len(draws)), *cells]


def main(
    out: Annotated[Path, typer.Option(help="Folder of the finished rows.")],
    draws: Annotated[int, typer.Option(help="Logs of each file.")] = 40,
    page: Annotated[Path | None, typer.Option(help="Page to insert the table into.")] = None,
) -> None:
    """Identify all draws and print the table."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)

    def simulate(case: tuple[str, str, str], first: int) -> list[Row]:
        return [identify(*case, draw) for draw in range(first, first + BATCH)]

    jobs = {
        f"{' '.join(case)} {first}": partial(simulate, case, first)
        for first in range(0, draws, BATCH)
        for case in cases()
    }
    text = table(HEADER, list(tabulate(finish_jobs(out / "rows.jsonl", jobs, Row))))
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
