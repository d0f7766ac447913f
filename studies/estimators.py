"""Compare the methods of estimation: open-loop error, divergence and time.

    python studies/estimators.py --seeds 5 --out FOLDER --bluerov2 DATA

For the re-enacted campaign, both truths and several seeds of its noise, and where DATA is
given for measured runs of a BlueROV2 (see ``examples/bluerov2``; whole runs held out), every
method identifies every model on the training runs and each result replays the others. A
table holds the median RMS error of equation 24 over the seeds (m/s and deg/s mixed, as in
the paper), "-" where more than half of the replays diverged, and how many did. Times are
seconds of one fit, in the process that also did the others' work; a ratio of two rows of
one run means something, a number alone does not.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hydrodamp as hd
from hydrodamp.files import save_json, save_text

METHODS = "ls,ai,ai-scaled,weak,ridge,dissipative,rls,oe,recommended"
BLUEROV2 = Path(__file__).parents[1] / "examples" / "bluerov2"
TRAIN, TEST = ("run_11_40_38", "run_11_57_50"), ("run_11_10_52", "run_11_46_03")

_WIDTH = 140
"""Columns that the tables need; a narrower screen would cut their numbers."""


@dataclass(frozen=True)
class Cell:
    """One fit and its replay."""

    data: str
    seed: int
    model: str
    method: str
    rms: float | None
    seconds: float
    status: str


def on_campaign(truth: str, seed: int, duration: float, methods: list[str]) -> list[Cell]:
    """Fit and replay every model by every method on one campaign."""
    campaign = hd.reenact(seed=seed, truth=truth, duration=duration)
    models = [hd.catalog[key] for key in hd.PAPER_MODELS]
    return list(
        _cells(truth, seed, campaign.vehicle, campaign.train, campaign.test, models, methods)
    )


def on_bluerov2(folder: str, methods: list[str]) -> list[Cell]:
    """Fit and replay the models of the example on measured runs."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    runs = {name: Path(folder) / f"{name}.csv" for name in TRAIN + TEST}
    mapping = BLUEROV2 / "mapping.yaml"
    train = hd.read_logs([runs[name] for name in TRAIN], mapping)
    test = hd.read_logs([runs[name] for name in TEST], mapping)
    vehicle = hd.read_vehicle(BLUEROV2 / "vehicle.yaml")
    models = hd.read_models(BLUEROV2 / "models.yaml")
    return list(_cells("bluerov2", 0, vehicle, train, test, models, methods))


def _cells(
    data: str,
    seed: int,
    vehicle: hd.Vehicle,
    train: hd.Log,
    test: hd.Log,
    models: Iterable[hd.DampingModel],
    methods: list[str],
) -> Iterator[Cell]:
    asked = tuple(models)
    problem = hd.prepare(vehicle, train, asked)
    for key in methods:
        for model in asked:
            began = time.process_time()
            fit = hd.find_method(key).identify(problem, model)
            took = time.process_time() - began
            row = hd.compare([fit], vehicle, test).rows[0]
            yield Cell(data, seed, model.key, key, row.rms, took, row.status.word)


def _gathered(calls: list[tuple[object, ...]], workers: int) -> list[Cell]:
    cells: list[Cell] = []
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(*call) for call in calls]  # type: ignore[arg-type]
        for future in track(as_completed(futures), "fitting", total=len(futures)):
            cells += future.result()
    return cells


def tables(cells: list[Cell]) -> Iterator[tuple[str, list[list[str]]]]:
    """Yield a title and rows, header first, for every kind of data."""
    for data in dict.fromkeys(cell.data for cell in cells):
        here = [cell for cell in cells if cell.data == data]
        models = list(dict.fromkeys(cell.model for cell in here))
        methods = list(dict.fromkeys(cell.method for cell in here))
        rows = [["method", *models, "diverged", "seconds"]]
        for method in methods:
            own = [cell for cell in here if cell.method == method]
            errors = [_error([c for c in own if c.model == model]) for model in models]
            lost = sum(cell.rms is None for cell in own)
            took = sum(cell.seconds for cell in own) / max(len(own), 1)
            rows.append([method, *errors, f"{lost} of {len(own)}", f"{took:.2f}"])
        seeds = len({cell.seed for cell in here})
        yield f"{data}: median RMS error of {seeds} campaign(s)", rows


def _error(cells: list[Cell]) -> str:
    found = [cell.rms for cell in cells if cell.rms is not None]
    if 2 * len(found) <= len(cells):
        return "-"
    value = median(found + [float("inf")] * (len(cells) - len(found)))
    return f"{value:.3f}" if value < 10 else f"{value:.3g}"


def markdown(cells: list[Cell]) -> str:
    """Return the tables as Markdown."""
    parts = []
    for title, (head, *rows) in tables(cells):
        lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
        lines += [f"| {' | '.join(row)} |" for row in rows]
        parts.append(f"**{title}**\n\n" + "\n".join(lines))
    return "\n\n".join(parts) + "\n"


def main(
    seeds: Annotated[int, typer.Option(help="Campaigns a truth, seeds from 0.")] = 5,
    duration: Annotated[float, typer.Option(help="Of each run [s].")] = 200.0,
    methods: Annotated[str, typer.Option(help="Keys, with commas.")] = METHODS,
    bluerov2: Annotated[Path | None, typer.Option(help="Folder of the measured runs.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for estimators.md and .json.")] = None,
    workers: Annotated[int, typer.Option(help="Processes.")] = os.cpu_count() or 1,
) -> None:
    """Print the table method x model for the campaign and for measured runs."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes share the cores
    keys = methods.split(",")
    for key in keys:
        hd.find_method(key)
    calls: list[tuple[object, ...]] = [
        (on_campaign, truth, seed, duration, keys)
        for seed in range(seeds)
        for truth in ("sname", "crossflow")
    ]
    if bluerov2 is not None:
        calls.append((on_bluerov2, str(bluerov2), keys))
    cells = _gathered(calls, workers)
    console = Console(width=max(Console().width, _WIDTH))
    for title, (head, *rows) in tables(cells):
        table = Table(*head, title=title)
        for row in rows:
            table.add_row(*row)
        console.print(table)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        save_text(markdown(cells), out / "estimators.md")
        save_json([asdict(cell) for cell in cells], out / "estimators.json")


if __name__ == "__main__":
    typer.run(main)
