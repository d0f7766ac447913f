"""What each target makes of each model: the tables of `docs/evidence/export-fidelity.md`.

    python studies/exports.py --page docs/evidence/export-fidelity.md

Two vehicles are identified and sailed on: the paper's, by fins and propeller, and an ROV by a
recorded wrench. Where a program is not installed, what its target wrote is not run.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from itertools import accumulate
from operator import mul
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.spatial.transform import Rotation

import hydrodamp as hd
from hydrodamp.export.export import TARGETS
from hydrodamp.export.fidelity import Fidelity
from tables import TABLES, replace_table

RATE = 100.0
"""Of the ROV's integration; a tenth of it is kept [Hz]."""


@dataclass(frozen=True)
class Sailed:
    """A vehicle with what is identified and what is sailed on."""

    title: str
    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log

    def damping(self, model: hd.DampingModel) -> hd.Damping:
        """Return what least squares finds."""
        return hd.identify(model, self.vehicle, self.train, hd.LeastSquares()).damping


def torpedo(length: float, sailed: float) -> Sailed:
    """Return the paper's vehicle in its campaign, measured without noise."""
    train, test = hd.reenact(duration=length), hd.reenact(duration=sailed)
    return Sailed("vt690, fins and propeller", train.vehicle, train.exact_train, test.exact_test)


def rov(length: float, sailed: float) -> Sailed:
    """Return a BlueROV2 Heavy that is pushed on all axes at once, at frequencies of their own."""
    vehicle, truth = hd.fleet["bluerov2-heavy"], hd.published["bluerov2-heavy"]
    n = int(RATE * length)
    time = np.arange(n) / RATE
    waves = np.arange(1, 5)[:, None] * (1.0 + 0.17 * np.arange(6)) * 2.0 * np.pi / 30.0
    phase = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, waves.shape)
    push = np.sin(time[:, None, None] * waves + phase).sum(axis=1) * [9.0, 9.0, 9.0, 0.2, 0.2, 1.0]
    level = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    still = hd.Log(time, np.zeros((n, 6)), wrench=push, attitude=level)
    velocity = hd.simulate(vehicle, truth, still, attitude="simulated").velocity
    turns = 0.5 * (velocity[1:, 3:] + velocity[:-1, 3:]) / RATE
    attitude = list(accumulate(Rotation.from_rotvec(turns), mul, initial=Rotation.identity()))
    quaternions = np.array([each.as_quat(scalar_first=True) for each in attitude])
    kept = slice(None, None, 10)
    log = hd.Log(time[kept], velocity[kept], wrench=push[kept], attitude=quaternions[kept])
    train, test = log.between(0.0, length / 2.0), log.between(length / 2.0, length / 2.0 + sailed)
    return Sailed("bluerov2-heavy, a recorded wrench", vehicle, train, test)


@dataclass(frozen=True)
class Cell:
    """One model, one target."""

    card: Fidelity | None
    refused: str = ""

    @cached_property
    def wrench(self) -> str:
        """The largest wrench error over the axes."""
        if self.card is None:
            return "refused"
        error = max(self.card.wrench_error.values())
        return ("" if self.card.exact else "≈ ") + _short(error)

    @cached_property
    def replay(self) -> str:
        """The error of equation 24 between source and target."""
        if self.card is None:
            return "refused"
        if self.card.replays is None:
            return "not run"
        found = self.card.replays
        rms = found.source_to_target.rms
        if rms is None:
            return "as its source" if found.source_to_log.diverged else "diverges"
        return _short(rms)


def _short(value: float) -> str:
    return f"{value:.0e}" if 0.0 < value < 0.01 else f"{value:.2g}"


def exported(sailed: Sailed, damping: hd.Damping, target: str) -> Cell:
    """Return what a target makes of a damping."""
    with tempfile.TemporaryDirectory() as place:
        try:
            out = Path(place, "export")
            return Cell(
                hd.export(damping, sailed.vehicle, target, out, log=sailed.test, force=True)
            )
        except hd.HydrodampError as error:
            return Cell(None, str(error))


def tables(sailed: Sailed, models: list[hd.DampingModel], targets: list[str]) -> Iterator[str]:
    """Yield the tables of a vehicle."""
    yield f"## {sailed.title}\n"
    dampings = [sailed.damping(model) for model in models]
    cells = {
        target: [exported(sailed, damping, target) for damping in dampings] for target in targets
    }
    head = (
        f"| target | {' | '.join(model.title for model in models)} |\n|---|{'---|' * len(models)}"
    )
    for title, kind in (
        ("Wrench error, largest over the axes [% of the damping's rms]:", "wrench"),
        ("Replay RMS, target against source [eq. 24]:", "replay"),
    ):
        yield f"{title}\n\n{head}"
        for target, row in cells.items():
            yield f"| `{target}` | {' | '.join(getattr(cell, kind) for cell in row)} |"
        yield ""
    for said in sorted({cell.refused for row in cells.values() for cell in row if cell.refused}):
        yield f"Refused: {said}\n"


def run_by() -> str:
    """Return the programs that ran what was written."""
    found = []
    for name in ("casadi", "fmpy", "dartpy", "mujoco"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"no {name}")
    return ", ".join(found)


def main(
    page: Annotated[Path | None, typer.Option(help="A page whose tables are replaced.")] = None,
    length: Annotated[float, typer.Option(help="Of each log identified on [s].")] = 120.0,
    sailed: Annotated[float, typer.Option(help="Of each run sailed on [s].")] = 10.0,
    models: Annotated[list[str] | None, typer.Option("--model", help="Repeatable.")] = None,
    targets: Annotated[list[str] | None, typer.Option("--target", help="Repeatable.")] = None,
) -> None:
    """Print the tables."""
    which = [hd.catalog[key] for key in models or hd.PAPER_MODELS]
    lines = [f"Run with {run_by()}.\n"]
    for one in (torpedo(length, sailed), rov(length, sailed)):
        lines += tables(one, which, list(targets or TARGETS))
    text = "\n".join(lines)
    if page is not None:
        replace_table(page, TABLES, text)
    print(text)


if __name__ == "__main__":
    typer.run(main)
