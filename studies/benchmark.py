"""Rank methods of estimation on the campaigns of the benchmark: ``python studies/benchmark.py``.

    python studies/benchmark.py --out FOLDER [--campaigns GLOB] [--models LIST] [--methods LIST]
        [--group seen|unseen|all] [--jobs N] [--page PAGE] [--again]

Every method identifies every model from the training log of every campaign, and each result
replays the test log, which no method sees: from new measured states each second, every ten
seconds, and whole runs open loop. Each of these is a row, kept as a line of
``FOLDER/rows.jsonl`` as soon as it is there; what is there is not done again (but with
``--again``), so the command may be stopped and started at will. ``FOLDER/benchmark.md`` has the
tables, with the regret of each method: its error over the least error of any method on the same
model and campaign. ``docs/evidence/benchmark.md`` has the protocol.

A method of one's own is named ``module:object``: a value (or what makes one when called without
arguments) with ``identify(problem, model) -> Fit``.
"""

from __future__ import annotations

import json
import os
import sys
import time
import warnings
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from fnmatch import fnmatch
from functools import lru_cache
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown
from rich.progress import track

import hydrodamp as hd
from benchmark_campaign import Campaign
from benchmark_campaigns import campaigns
from benchmark_tables import HORIZONS, Row, markdown
from hydrodamp.files import save_text
from hydrodamp.identification.fit import Method
from hydrodamp.simulation.replay import horizon_scores
from tables import TABLES, replace_table

METHODS = tuple(hd.METHODS)
"""The methods that take part if none is named."""

Job = tuple[str, str, str]
"""A campaign, a model and a method, by their names."""


def find_campaign(name: str) -> Campaign:
    """Return the campaign of a name, made but once in a row."""
    return next(one for one in campaigns() if one.name == name)


kept = lru_cache(maxsize=2)(find_campaign)
"""The campaigns at hand: the jobs of one come in a row."""


def find_method(name: str) -> Method:
    """Return the method of a key, or the one that ``module:object`` names."""
    module, _, what = name.partition(":")
    if not what:
        return hd.find_method(name)
    found = getattr(import_module(module), what)
    made: Method = found() if isinstance(found, type) else found
    return made


def row(job: Job) -> Row:
    """Return what becomes of one job; whatever goes wrong with it is a row, too."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    campaign, model = kept(job[0]), job[1]
    method = find_method(job[2])
    asked = next(one for one in campaign.models if one.key == model)
    none: dict[str, float | None] = dict.fromkeys(HORIZONS)
    began = time.process_time()
    try:
        problem = hd.prepare(campaign.vehicle, campaign.train, asked)
        began = time.process_time()
        fit = method.identify(problem, asked)
        took = time.process_time() - began
        errors, shares = replayed(campaign, fit) if fit.status.usable else (none, {})
    except Exception as error:  # a method of one's own may raise anything
        took = time.process_time() - began
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return Row(*job, campaign.group, none, "raised", False, took, why)
    diverged = fit.status.usable and errors["run"] is None
    return Row(*job, campaign.group, errors, fit.status.word, diverged, took, fit=shares)


def replayed(
    campaign: Campaign, fit: hd.Fit
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return the RMS error of equation 24 at each horizon, and the fit by velocity of whole runs.

    The error is None, and there is no fit, where a replay diverged.
    """
    found = horizon_scores(campaign.vehicle, fit.damping, campaign.test, HORIZONS.values())
    scores = {name: one.score for name, one in zip(HORIZONS, found, strict=True)}
    whole = scores["run"]
    shares = {} if whole.diverged else dict(whole.fit_by_axis)
    return {name: one.rms for name, one in scores.items()}, shares


def read_rows(path: Path) -> list[Row]:
    """Return the rows of a file, the last one of each job; a line cut short is left out."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    found: dict[Job, Row] = {}
    for line in lines:
        try:
            one = Row(**json.loads(line))
        except json.JSONDecodeError:
            continue
        found[one.job] = one
    return list(found.values())


def append(row: Row, path: Path) -> None:
    """Add a row to a file, on a line of its own even after one that was cut short."""
    cut = path.exists() and not path.read_bytes().endswith(b"\n") and path.stat().st_size > 0
    with path.open("a", encoding="utf-8") as file:
        file.write("\n" * cut + json.dumps(asdict(row), allow_nan=False) + "\n")


def chosen(pattern: str, group: str) -> list[Campaign]:
    """Return the campaigns of a group whose names fit one of the patterns, with commas."""
    patterns = pattern.split(",")
    return [
        one
        for one in campaigns()
        if group in (one.group, "all") and any(fnmatch(one.name, part) for part in patterns)
    ]


def jobs(asked: Iterable[Campaign], models: str, methods: Sequence[str]) -> Iterator[Job]:
    """Yield every job: methods within models within campaigns."""
    patterns = models.split(",")
    for campaign in asked:
        for model in (one.key for one in campaign.models):
            if any(fnmatch(model, part) for part in patterns):
                yield from ((campaign.name, model, method) for method in methods)


def rows_of(work: Sequence[Job], workers: int) -> Iterator[Row]:
    """Do all jobs, on several processes, and yield each row as it comes."""
    console = Console(stderr=True)
    if workers == 1:
        yield from map(row, track(work, "Rows", console=console, transient=True))
        return
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        coming = as_completed([pool.submit(row, job) for job in work])
        try:
            for done in track(coming, "Rows", len(work), console=console, transient=True):
                yield done.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def main(
    out: Annotated[Path, typer.Option(help="Folder for rows.jsonl and benchmark.md.")],
    campaigns: Annotated[str, typer.Option(help="Names or patterns, with commas.")] = "*",
    models: Annotated[str, typer.Option(help="Keys or patterns, with commas.")] = "*",
    methods: Annotated[str, typer.Option(help="Keys or module:object; none for the usual.")] = "",
    group: Annotated[str, typer.Option(help="seen, unseen or all (of both).")] = "seen",
    workers: Annotated[int, typer.Option("--jobs", help="Processes.")] = os.cpu_count() or 1,
    page: Annotated[Path | None, typer.Option(help="A page whose tables are replaced.")] = None,
    again: Annotated[bool, typer.Option("--again", help="Do rows that are there, too.")] = False,
) -> None:
    """Fill the table of campaigns, models and methods, and print the regret."""
    sys.path.insert(0, str(Path.cwd()))
    keys = methods.split(",") if methods else METHODS
    for key in keys:
        find_method(key)
    asked = list(jobs(chosen(campaigns, group), models, keys))
    out.mkdir(parents=True, exist_ok=True)
    path = out / "rows.jsonl"
    there = set() if again else {one.job for one in read_rows(path)}
    for one in rows_of([job for job in asked if job not in there], workers):
        append(one, path)
    wanted = set(asked)
    found = [one for one in read_rows(path) if one.job in wanted]
    text = markdown(found)
    save_text(text, out / "benchmark.md")
    if page is not None:
        replace_table(page, TABLES, text)
    Console().print(Markdown(text))


if __name__ == "__main__":
    typer.run(main)
