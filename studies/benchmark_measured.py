"""Compare methods on measured logs with fixed splits, ours and what a user would pick instead.

    python studies/benchmark_measured.py --out FOLDER --data DATA [--splits GLOB] [--page PAGE]

Splits are in ``measured_splits.toml``. Every entry identifies from the training part and replays
the test part whole, open loop, from its first measured velocity. Each is a line of
``FOLDER/rows.jsonl``; what is there is not done again.
"""

from __future__ import annotations

import math
import time
import tomllib
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from fnmatch import fnmatch
from functools import lru_cache, partial
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
import outside_methods
import outside_mujoco
from benchmark_campaign import Logs
from benchmark_tables import number, table
from expert_script import replay_script
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.identification.general_model import remove_duplicates
from hydrodamp.simulation.replay import Trajectory, score
from measured_splits import Split, models, read_logs, read_splits
from tables import finish_jobs, replace_table

MARKS = "<!-- measured -->", "<!-- end of measured -->"
SUMMARY_MARKS = "<!-- summary -->", "<!-- end of summary -->"
EARLIER = Path(__file__).with_name("benchmark_afd9ded.toml")
METHODS = "ls", "weak", "oe", "recommended"
GENERAL, POLYNOMIAL, SCRIPT, MUJOCO = "general", "polynomial", "script", "mujoco-sysid"
WITH_MUJOCO, WITH_POLYNOMIAL = ("bluerov2", "beluga"), ("kvlcc2",)


class Row(NamedTuple):
    """RMS of equation 24 of a replay, fits and shares inside the band [%], CPU time [s]."""

    split: str
    model: str
    method: str
    status: str
    seconds: float
    rms: float | None
    fits: dict[str, float | None]
    inside: dict[str, float]

    @property
    def error(self) -> float:
        """Mean over velocities of the RMS error over the standard deviation; infinite for none."""
        fits = [fit for fit in self.fits.values() if fit is not None]
        return float(np.mean([1.0 - fit / 100.0 for fit in fits])) if fits else math.inf


def entries(split: Split) -> Iterator[tuple[str, str]]:
    """Yield model and method of every entry of a split."""
    yield GENERAL, "recommended"
    if split.vehicle in WITH_POLYNOMIAL:
        yield from ((POLYNOMIAL, method) for method in METHODS)
    yield from ((model.key, method) for model in models(split) for method in METHODS)
    yield from (("", method) for method in (SCRIPT, *outside_methods.available()))
    if split.vehicle in WITH_MUJOCO and outside_mujoco.is_available():
        yield "", MUJOCO


def identify(split: Split, data: Path, model: str, method: str) -> list[Row]:
    """Return the row of an entry; whatever goes wrong with it is a row, too."""
    warnings.simplefilter("ignore")
    logs = _logs(split, data)
    run = partial(_ours, split, logs, model) if model else partial(_outside, split, logs)
    began = time.process_time()
    try:
        return [run(method)]
    except (hd.HydrodampError, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        why = f"{type(error).__name__}: {error}".split("\n")[0]
        return [Row(split.name, model, method, why, time.process_time() - began, None, {}, {})]


@lru_cache(maxsize=1)
def _logs(split: Split, data: Path) -> Logs:
    return read_logs(data, split, read_splits()[0])


def _ours(split: Split, logs: Logs, key: str, method: str) -> Row:
    began = time.process_time()
    if key == GENERAL:
        model = hd.general_model(logs.vehicle, logs.train)
    elif key == POLYNOMIAL:
        model = polynomial(split, logs)
    else:
        model = next(each for each in models(split) if each.key == key)
    problem = hd.prepare(logs.vehicle, logs.train, model)
    fit = hd.find_method(method).identify(problem, model)
    seconds = time.process_time() - began
    if not fit.status.usable:
        return Row(split.name, key, method, fit.status.word, seconds, None, {}, {})
    found = score(hd.simulate(logs.vehicle, fit.damping, logs.test))
    inside = {}
    if found.rms is not None and fit.uncertainty is not None:
        with suppress(hd.HydrodampError):
            inside = _shares_inside(logs, fit)
    status = "diverged" if found.diverged else fit.status.word
    fits = {} if found.diverged else found.fit_by_axis
    return Row(split.name, key, method, status, seconds, found.rms, fits, inside)


def polynomial(split: Split, logs: Logs) -> hd.DampingModel:
    """Return the terms of the outside methods, on every free axis, as a model."""
    squares = ("*".join(pair) for pair in combinations_with_replacement(split.velocities, 2))
    own = (f"{each}*|{each}|" for each in split.velocities)
    terms = " ".join(["1", *split.velocities, *own, *squares, *split.terms])
    model = hd.DampingModel.from_table(
        dict.fromkeys(logs.vehicle.axes, terms), key=POLYNOMIAL, title="Second order"
    )
    return remove_duplicates(hd.prepare(logs.vehicle, logs.train, model), model)


def _shares_inside(logs: Logs, fit: hd.Fit) -> dict[str, float]:
    """Return by velocity the share [%] of test samples inside the predicted 95 % band."""
    band = hd.predict_error(logs.vehicle, fit, logs.test)
    error = np.abs(band.velocity - logs.test.velocity)
    share = 100.0 * np.mean(error <= band.half_width, axis=0)
    return {VELOCITY_OF[axis]: float(share[AXES.index(axis)]) for axis in logs.vehicle.axes}


def _outside(split: Split, logs: Logs, method: str) -> Row:
    axes = [AXES.index(axis) for axis in logs.vehicle.axes]
    velocity = np.zeros((logs.test.n, 6))
    began = time.process_time()
    if method == SCRIPT:
        velocity = replay_script(logs.train, logs.test, axes, has_fins="Z" not in logs.vehicle.axes)
        seconds = time.process_time() - began
    elif method == MUJOCO:
        velocity, seconds = outside_mujoco.replay(logs)
    else:
        names = _names(split, logs.train)
        train, test = (_runs(log, names, axes) for log in (logs.train, logs.test))
        began = time.process_time()
        w, columns = outside_methods.fit(method, train, names)
        seconds = time.process_time() - began
        velocity[:, axes] = np.vstack([outside_methods.replay(w, columns, run) for run in test])
    return _outside_row(split, logs, method, velocity, seconds)


def _outside_row(
    split: Split, logs: Logs, method: str, velocity: FloatArray, seconds: float
) -> Row:
    diverged = () if np.isfinite(velocity).all() else (("", 0.0),)
    found = score(Trajectory(logs.test, velocity, diverged, "measured", logs.vehicle.axes))
    fits = {} if diverged else found.fit_by_axis
    status = "diverged" if diverged else "ok"
    return Row(split.name, "", method, status, seconds, found.rms, fits, {})


def _names(split: Split, log: hd.Log) -> outside_methods.Names:
    words = {word.strip("|") for term in split.terms for word in term.split("*")}
    known = _inputs(log)
    inputs = tuple(name for name in known if name in words)
    return outside_methods.Names(split.velocities, inputs, split.terms)


def _inputs(log: hd.Log) -> dict[str, FloatArray]:
    """Return commands, wrench and direction of gravity by name."""
    found = {name: log.command(name) for name in log.command_names}
    if log.wrench is not None:
        found |= dict(zip(AXES, log.wrench.T, strict=True))
    if log.attitude is not None:
        found |= dict(zip(("down_x", "down_y", "down_z"), log.down.T, strict=True))
    return found


def _runs(log: hd.Log, names: outside_methods.Names, axes: list[int]) -> list[outside_methods.Run]:
    known = _inputs(log)
    inputs = np.column_stack([known[name] for name in names.inputs])
    whole = [np.nan_to_num(each) for each in (log.time, log.velocity[:, axes], inputs)]
    return [
        outside_methods.Run(*(each[start:stop] for each in whole))
        for start, stop in log.bounds.tolist()
    ]


def summarise(rows: Sequence[Row]) -> str:
    """Return a table for each split, and the summary of all."""
    earlier = {
        (one["campaign"].removeprefix("measured/"), one["model"], one["method"]): one.get("rms")
        for one in tomllib.loads(EARLIER.read_text(encoding="utf-8"))["row"]
    }
    parts = [summary_table(rows), lead_table(rows)]
    for split in dict.fromkeys(row.split for row in rows):
        of_split = [row for row in rows if row.split == split]
        best = min(row.error for row in of_split)
        head = ("entry", "error", "regret", "fit [%]", "inside 95 % [%]", "CPU [s]", "to afd9ded")
        lines = []
        for row in sorted(of_split, key=lambda row: row.error):
            before = earlier.get((split, row.model, row.method))
            ratio = "" if before is None or row.rms is None else number(row.rms / before)
            cells = _numbers(row.fits) or row.status, _numbers(row.inside)
            lines.append((_entry(row), *_errors(row, best), *cells, f"{row.seconds:.1f}", ratio))
        parts.append(f"## Split {split}\n\n{table(head, lines)}")
    return "\n\n".join(parts)


def _entry(row: Row) -> str:
    return f"`{row.method}`" + (f" `{row.model}`" if row.model else "")


def _group(row: Row) -> str:
    """Return the name of an entry over all splits: models of examples have one."""
    if row.model in ("", GENERAL, POLYNOMIAL):
        return ", ".join(f"`{name}`" for name in (row.method, row.model) if name)
    return f"`{row.method}`, example's model"


def _errors(row: Row, best: float) -> tuple[str, str]:
    is_known = row.error < math.inf
    return ("-", "-") if not is_known else (f"{row.error:.3f}", number(row.error / best))


def _numbers(values: dict[str, float | None] | dict[str, float]) -> str:
    return ", ".join(f"{k} {v:.0f}" for k, v in values.items() if v is not None)


def regrets(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Return the regret by entry and split; ours with the models of examples is the best of them.

    A diverged replay has an infinite regret.
    """
    best: dict[str, float] = {}
    for row in rows:
        best[row.split] = min(best.get(row.split, math.inf), row.error)
    found: dict[str, dict[str, float]] = {}
    for row in rows:
        of_entry = found.setdefault(_group(row), {})
        regret = row.error / best[row.split]
        of_entry[row.split] = min(of_entry.get(row.split, math.inf), regret)
    return found


def summary_table(rows: Sequence[Row]) -> str:
    """Return median and worst regret, splits led, failures and CPU time of every entry."""
    lines = []
    for name, by_split in regrets(rows).items():
        values = sorted(by_split.values())
        seconds = sum(row.seconds for row in rows if _group(row) == name)
        finite = [value for value in values if value < math.inf]
        median = number(float(np.median(values))) if np.median(values) < math.inf else "-"
        worst = number(finite[-1]) if finite else "-"
        first = sum(value == 1.0 for value in values)
        failed = len(values) - len(finite)
        lines.append(
            (name, str(len(values)), median, worst, str(first), str(failed), f"{seconds:.0f}")
        )
    head = ("entry", "splits", "median regret", "worst", "best on", "failed", "CPU [s]")
    order = sorted(lines, key=lambda line: math.inf if line[2] == "-" else float(line[2]))
    return f"**Regret over the best entry of each split**\n\n{table(head, order)}"


def leads(rows: Sequence[Row]) -> Iterator[tuple[str, Row, Row | None, Row]]:
    """Yield our default with `general` and with an example's model, and the best outside."""
    for split in dict.fromkeys(row.split for row in rows):
        of_split = [row for row in rows if row.split == split]
        default = [row for row in of_split if row.method == "recommended"]
        parts = (
            [row for row in default if row.model == GENERAL],
            [row for row in default if row.model not in (GENERAL, POLYNOMIAL)],
            [row for row in of_split if not row.model],
        )
        general, example, other = (min(part, key=_error, default=None) for part in parts)
        if general and other:
            yield split, general, example, other


def _error(row: Row) -> float:
    return row.error


def summarise_leads(rows: Sequence[Row]) -> str:
    """Return on how many splits our default loses to the best outside method, and by how much."""
    sentences = []
    for index, name in enumerate(("`general`", "the example's models")):
        found = [(split, pair[index], other) for split, *pair, other in leads(rows)]
        ratios = {split: ours.error / other.error for split, ours, other in found if ours}
        lost = {split: ratio for split, ratio in ratios.items() if ratio > 1.0}
        worst = max(lost, key=lost.__getitem__, default="")
        by = f"; the largest ratio of errors is {lost[worst]:.2f} on {worst}" if lost else ""
        middle = f"the median ratio is {np.median([*ratios.values()]):.2f}" if ratios else ""
        sentences.append(
            f"`recommended` with {name} loses to the best outside method of the split on "
            f"{len(lost)} of {len(ratios)} splits; {middle}{by}."
        )
    return " ".join(sentences)


def lead_table(rows: Sequence[Row]) -> str:
    """Return, by split, our default and the best outside method."""
    lines = []
    for split, general, example, other in leads(rows):
        cells: list[str] = []
        for ours in (general, example):
            if ours is not None and ours.error < math.inf:
                cells += f"{ours.error:.3f}", _ratio(ours.error, other.error)
            else:
                cells += "-", "-"
        lines.append((split, *cells, f"{_entry(other)} {other.error:.3f}"))
    head = ("split", "`general`", "ratio", "example's model", "ratio", "best outside")
    note = "Error of `recommended`, and its ratio to the best outside method; bold: ours loses."
    return f"**Ours and the others**\n\n{table(head, lines)}\n\n{note}"


def _ratio(ours: float, theirs: float) -> str:
    text = number(ours / theirs)
    return f"**{text}**" if ours > theirs else text


def main(
    out: Annotated[Path, typer.Option(help="Folder for rows.jsonl and measured.md.")],
    data: Annotated[Path, typer.Option(help="Folder of measured logs.")],
    splits: Annotated[str, typer.Option(help="Names or patterns, with commas.")] = "*",
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run every entry on every split and write the tables."""
    out.mkdir(parents=True, exist_ok=True)
    patterns = splits.split(",")
    jobs = {
        f"{split.name} {model} {method}": partial(identify, split, data, model, method)
        for split in read_splits()[1]
        if any(fnmatch(split.name, pattern) for pattern in patterns)
        for model, method in entries(split)
    }
    rows = finish_jobs(out / "rows.jsonl", jobs, Row)
    text = summarise(rows)
    (out / "measured.md").write_text(f"{text}\n", encoding="utf-8")
    if page is not None:
        replace_table(page, MARKS, text)
        replace_table(page, SUMMARY_MARKS, summarise_leads(rows))
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
