"""Re-enact the paper's identifier and its Table I.

    python studies/paper.py --page docs/evidence/paper-reenacted.md [--only-repeats]

Each number is the median over campaigns of some seeds. The campaigns record what the paper's
vehicle did: the attitude sensor's translational acceleration, no angular one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.markdown import Markdown
from scipy.stats import spearmanr

import hydrodamp as hd
from conditions import accelerated
from hydrodamp.identification.fit import Method
from hydrodamp.identification.online import Adaptation
from hydrodamp.kernels.core import Gains
from hydrodamp.simulation.campaign.conditions import Conditions
from hydrodamp.simulation.campaign.reenact import DURATION, TRUTHS, Campaign, CampaignSetup
from hydrodamp.simulation.problem import EquationTable
from tables import TABLES, replace_table

COMPOSITE = {"ai-composite": hd.CompositeIdentifier()}
"""The identifier with a memory of the filtered equation."""

NOISES = {"0": 0.0, "1/10": 0.1, "1/3": 1 / 3, "1": 1.0}
"""Strength of the sensors' errors, in published ones."""

PASSES = (1, 10, 50)

REPEATS = (1, 10, 100)
"""Passes of the table of repeats, and the marks of the page between which it stands."""
REPEAT_MARKS = ("<!-- repeats -->", "<!-- end of repeats -->")
LONGER = 10

DEGREE = 180.0 / math.pi

MODELS = tuple(hd.catalog[key] for key in hd.PAPER_MODELS)

Column = tuple[float, ...]
"""The error of each model; infinite where the replay diverged."""


@dataclass(frozen=True)
class InDegrees(hd.AdaptiveIdentifier):
    """The identifier as it is where rates are in deg/s, for coefficients in SI units."""

    starts_in_degrees: bool = False

    def bind(self, source: hd.Problem | EquationTable, model: hd.DampingModel) -> Adaptation[Gains]:
        """Return the gains of SI units that do the same, and the start."""
        bound = super().bind(source, model)
        columns, turning = bound.equations, np.arange(6) >= 3
        rates = [
            sum(f.strip("|") in ("p", "q", "r") for f in term.factors) for term in columns.basis
        ]
        power = np.concatenate([np.zeros(columns.n_known), rates])[:, None]
        a = bound.settings.a * DEGREE**turning
        gamma = bound.settings.gamma * DEGREE ** (2.0 * power + turning)
        start = bound.start
        if self.starts_in_degrees:  # -1 N m s/deg in roll, pitch and yaw, in SI units
            start = start * DEGREE ** turning[bound.entries[1]]
        return bound._replace(settings=Gains(columns.plant, a, gamma), start=start)


UNITS = {
    "rad/s": hd.AdaptiveIdentifier(),
    "deg/s": InDegrees(),
    "deg/s, initial values too": InDegrees(starts_in_degrees=True),
}


def errors(
    campaigns: Iterable[Campaign], method: Method, models: Sequence[hd.DampingModel]
) -> tuple[Column, list[bool]]:
    """Return the median error of each model, and whether each fit had settled."""
    found: list[Column] = []
    settled = []
    for campaign in campaigns:
        problem = hd.prepare(campaign.vehicle, campaign.train, models)
        fits = hd.identify_all(problem, models, method)
        rows = hd.compare(fits, campaign.vehicle, campaign.test).rows
        found.append(tuple(math.inf if row.rms is None else row.rms for row in rows))
        settled += [fit.status is hd.Status.CONVERGED for fit in fits]
    return tuple(median(column) for column in zip(*found, strict=True)), settled


def sailed(
    seeds: int, truth: str, noise: float, duration: float = DURATION
) -> tuple[Campaign, ...]:
    """Return the campaigns of the first seeds."""
    found = CampaignSetup.of(truth).simulate(range(seeds), duration, Conditions(noise))
    return tuple(accelerated(one, seed, noise) for seed, one in enumerate(found))


def identifier(seeds: int, longer: float) -> Iterator[str]:
    """Yield the table of the linear model by the identifier, and how many fits had settled."""
    ways = [(f"{n} pass{'es' * (n > 1)}", n, DURATION) for n in PASSES]
    ways.append((f"1 pass, runs {longer:g} times longer", 1, longer * DURATION))
    cells: dict[tuple[str, str], list[float]] = {}
    settled: list[bool] = []
    for noise in NOISES.values():
        short, long = (sailed(seeds, "sname", noise, length) for length in (DURATION, ways[-1][2]))
        for unit, method in UNITS.items():
            for way, passes, duration in ways:
                logs = short if duration == DURATION else long
                ((error,), ended) = errors(
                    logs, replace(method, passes=passes), [hd.catalog["linear"]]
                )
                cells.setdefault((unit, way), []).append(error)
                settled += ended
    yield from header("rates in", "", *(f"noise {noise}" for noise in NOISES))
    for names, values in cells.items():
        yield line(*names, *map(number, values))
    yield f"\nOf these {len(settled)} fits, {sum(settled)} converged.\n"


def table(truth: str, campaigns: Sequence[Sequence[Campaign]]) -> Iterator[str]:
    """Yield Table I beside its re-enactments on one truth."""
    methods_of: dict[str, dict[str, Method]] = {
        "ls": {"ls": hd.LeastSquares()},
        "ai": {**{unit: UNITS[unit] for unit in ("rad/s", "deg/s")}, **COMPOSITE},
    }
    for name, methods in methods_of.items():
        printed = tuple(getattr(hd.PAPER_TABLE_I[model.key], name) for model in MODELS)
        columns = {
            f"{called} {noise}": errors(logs, method, MODELS)[0]
            for called, method in methods.items()
            for noise, logs in zip(NOISES, campaigns, strict=True)
        }
        yield from header(f"`{truth}`", f"paper {name.upper()}", *columns)
        for place, model in enumerate(MODELS):
            values = [column[place] for column in columns.values()]
            yield line(model.title, f"{printed[place]:.2f}", *map(number, values))
        beside = [likeness(column, printed) for column in columns.values()]
        words = ("diverged", "geometric mean error factor", "rank correlation")
        for word, said in zip(words, zip(*beside, strict=True), strict=True):
            yield line(f"*{word}*", "", *said)
        best = min(columns, key=lambda one: distance(columns[one], printed))
        yield f"\nClosest to the printed column: {best}.\n"


def repeats(truth: str, seeds: int) -> Iterator[str]:
    """Yield the errors of the identifier in rad/s by passes, noise and length of the runs."""
    printed = tuple(hd.PAPER_TABLE_I[model.key].ai for model in MODELS)
    titles = (model.title for model in MODELS)
    summary = ("diverged", "factor", "rank correlation")
    yield from header("passes", "noise", "length", *titles, *summary)
    yield line("", "", "printed", *map(number, printed), "", "", "")
    for length in (1.0, 4.0):
        for noise, strength in NOISES.items():
            logs = sailed(seeds, truth, strength, length * DURATION)
            for passes in REPEATS:
                method = hd.AdaptiveIdentifier(passes=passes)
                column, _ = errors(logs, method, MODELS)
                said = likeness(column, printed)
                yield line(str(passes), noise, f"{length:g}", *map(number, column), *said)


def distance(column: Column, printed: Column) -> tuple[int, float]:
    """Return how many models diverged, and how far the others are off, as a logarithm."""
    apart = [abs(math.log(ours / theirs)) for ours, theirs in zip(column, printed, strict=True)]
    near = [one for one in apart if math.isfinite(one)]
    return len(apart) - len(near), sum(near) / len(near) if near else math.inf


def likeness(column: Column, printed: Column) -> tuple[str, str, str]:
    """Return how many diverged, the mean factor of the others, and Spearman's correlation."""
    lost, apart = distance(column, printed)
    alike = len(set(column)) < 2
    order = "-" if alike else f"{float(spearmanr(column, printed).statistic):.2f}"
    return f"{lost} of {len(column)}", number(math.exp(apart)), order


def header(*names: str) -> Iterator[str]:
    """Yield the head of a table."""
    yield line(*names)
    yield line(*["---"] * len(names))


def line(*cells: str) -> str:
    """Return a line of a table."""
    return f"| {' | '.join(cells)} |"


def number(error: float) -> str:
    """Return an error in words."""
    return f"{error:.2f}" if math.isfinite(error) else "-"


def main(
    page: Annotated[Path | None, typer.Option(help="A page whose tables are replaced.")] = None,
    seeds: Annotated[int, typer.Option(help="How many campaigns each.")] = 3,
    longer: Annotated[float, typer.Option(help="How much longer the long runs are.")] = LONGER,
    only_repeats: Annotated[bool, typer.Option(help="Only the table of repeated passes.")] = False,
) -> None:
    """Print the tables."""
    text = "\n".join(repeats("sname", 1))
    if page is not None:
        replace_table(page, REPEAT_MARKS, text)
    Console().print(Markdown(text))
    if only_repeats:
        return
    lines = ["### The identifier's linear model\n", *identifier(seeds, longer)]
    lines += ["### Table I\n"]
    for truth in TRUTHS:
        lines += table(truth, [sailed(seeds, truth, noise) for noise in NOISES.values()])
    text = "\n".join(lines)
    if page is not None:
        replace_table(page, TABLES, text)
    Console().print(Markdown(text))


if __name__ == "__main__":
    typer.run(main)
