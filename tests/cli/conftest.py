"""A planar vehicle, its logs and a way to call the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from hydrodamp.cli.main import app
from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log

VEHICLE = """\
name: planar
axes: [X, Y, N]
mass_matrix: [[20, 0, 0], [0, 30, 0], [0, 0, 5]]
weight: 100
buoyancy: 100
actuators:
  - {kind: matrix, commands: [ahead, turn], wrench: [[10, 0, 0, 0, 0, 0], [0, 2, 0, 0, 0, 4]]}
"""
MASS = np.array([20.0, 30.0, 5.0])
DAMPING = np.array([[-8.0, 0.0, 0.0], [0.0, -40.0, 3.0], [0.0, 2.0, -6.0]])


def motion(seed: int, n: int = 400, step: float = 0.1) -> dict[str, np.ndarray]:
    """Return columns of a run: M dnu/dt = H(M nu) nu + K nu + B c, commands held for 2 s."""
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform([0.2, -1.0], [1.0, 1.0], (n // 20 + 1, 2)), 20, axis=0)[:n]
    gains = np.array([[10.0, 0.0], [0.0, 2.0], [0.0, 4.0]])
    nu = np.zeros((n, 3))
    nu[0] = (0.5, 0.0, 0.0)

    def rate(state: np.ndarray, command: np.ndarray) -> np.ndarray:
        u, v, r = state
        px, py = MASS[0] * u, MASS[1] * v
        coriolis = np.array([py * r, -px * r, px * v - py * u])
        return (coriolis + DAMPING @ state + gains @ command) / MASS

    for k in range(n - 1):
        state = nu[k]
        for _ in range(5):
            h = step / 5
            k1 = rate(state, commands[k])
            k2 = rate(state + h / 2 * k1, commands[k])
            k3 = rate(state + h / 2 * k2, commands[k])
            k4 = rate(state + h * k3, commands[k])
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        nu[k + 1] = state
    return {
        "time": step * np.arange(n),
        **dict(zip(("u", "v", "r"), nu.T, strict=True)),
        "ahead": commands[:, 0],
        "turn": commands[:, 1],
    }


def as_log(columns: dict[str, np.ndarray], names: list[str] | None = None) -> Log:
    """Return the columns as a log."""
    velocity = {name: columns[name] for name in "uvwpqr" if name in columns}
    reserved = {"time", *velocity}
    commands = {name: values for name, values in columns.items() if name not in reserved}
    return Log.from_arrays(columns["time"], velocity, commands=commands, segment=names)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in, with `planar.yaml`, `a.csv`, `b.csv` and the joined `ab.csv`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "planar.yaml").write_text(VEHICLE, encoding="utf-8")
    first, second = motion(1), motion(2)
    write_log(as_log(first), tmp_path / "a.csv")
    write_log(as_log(second), tmp_path / "b.csv")
    both = {name: np.concatenate([first[name], second[name]]) for name in first}
    write_log(as_log(both, ["one"] * 400 + ["two"] * 400), tmp_path / "ab.csv")
    return tmp_path


@pytest.fixture
def call() -> Callable[..., Result]:
    """Return a function that calls the command line as a shell would split its line."""

    def run(line: str, *more: str) -> Result:
        return CliRunner().invoke(app, [*line.split(), *more])

    return run


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures and no report: they take longer than all the rest."""
    monkeypatch.setattr("hydrodamp.cli.report.illustrate", lambda *_: ())
