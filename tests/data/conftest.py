"""Small recordings whose motion is known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log


@pytest.fixture
def swim() -> Log:
    """Ten seconds of yawing to and fro at 10 Hz, attitude and rates in accord."""
    time = np.arange(0.0, 10.0, 0.1)
    yaw = 0.5 * np.sin(time)
    velocity = np.zeros((100, 6))
    velocity[:, 0] = 1 + 0.1 * np.cos(time)
    velocity[:, 5] = 0.5 * np.cos(time)
    return Log.from_arrays(
        time,
        velocity,
        attitude=quaternion_from_euler(np.column_stack((0 * time, 0 * time, yaw))),
        commands={"rudder": 0.1 * np.sign(np.sin(time)), "rpm": np.full(100, 1500.0)},
        source="swim.csv",
    )


@pytest.fixture
def csv_file(tmp_path: Path) -> Callable[..., Path]:
    """Write text to a CSV file and return its path."""

    def write(text: str, name: str = "log.csv") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def bluerov2_runs(measured_logs: Callable[[str], Path]) -> list[Path]:
    """The BlueROV2 tank runs, where the data folder is at hand."""
    return sorted(measured_logs("bluerov2_kth").glob("run_*.csv"))
