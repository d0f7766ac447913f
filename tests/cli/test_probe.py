from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from typer.testing import Result

from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log

Call = Callable[..., Result]


def test_tells_segments_columns_and_verdict(folder: Path, call: Call) -> None:
    done = call("probe ab.csv --vehicle planar.yaml")
    assert done.exit_code == 0, done.output
    for word in ("ab.csv: 800 samples", "one", "two", "ahead", "std", "Verdict: Fit for the job"):
        assert word in done.stdout


def test_without_a_vehicle_names_what_is_missing(folder: Path, call: Call) -> None:
    document = json.loads(call("probe a.csv b.csv --json").stdout)
    assert not document["fit"]
    assert any("velocities w p q" in each for each in document["missing"])
    assert any("attitude" in each for each in document["missing"])
    assert len(document["segments"]) == 2


def test_commands_of_no_actuator_are_no_hindrance(folder: Path, call: Call) -> None:
    text = (folder / "planar.yaml").read_text("utf-8").split("actuators")[0]
    (folder / "bare.yaml").write_text(text, "utf-8")
    document = json.loads(call("probe a.csv --vehicle bare.yaml --json").stdout)
    assert document["fit"]
    assert any("no actuator of 'planar' takes: ahead turn" in x for x in document["reservations"])


def test_says_what_will_not_be_determined(folder: Path, call: Call) -> None:
    time = 0.5 * np.arange(40)
    still = {"u": 1.0 + 0.1 * np.sin(time), "v": 0.001 * np.cos(time), "r": np.sin(time)}
    columns = {"ahead": np.ones(40), "turn": np.sin(time)}
    write_log(Log.from_arrays(time, still, commands=columns), folder / "dull.csv")
    said = json.loads(call("probe dull.csv --vehicle planar.yaml --json").stdout)["reservations"]
    for word in ("v hardly varies", "u never changes sign", "never change: ahead", "0.25 s apart"):
        assert any(word in each for each in said), word
    assert any("only 19.5 s" in each for each in said)


def test_a_log_that_drives_nothing(folder: Path, call: Call) -> None:
    write_log(Log(np.arange(5.0), np.ones((5, 6)) * np.arange(5.0)[:, None]), folder / "no.csv")
    for line in ("probe no.csv --json", "probe no.csv --vehicle planar.yaml --json"):
        document = json.loads(call(line).stdout)
        assert any("X Y Z K M N" in each for each in document["missing"])
