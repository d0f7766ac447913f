"""A planar vehicle, its logs and a way to call the command line."""

import itertools
import json
import os
import re
import select
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import hydrodamp as hd
from hydrodamp.cli.main import app
from hydrodamp.data.log import Segment
from hydrodamp.report.files import ReportContent

VEHICLES = Path(__file__).with_name("vehicles")
TRUTH = {"X_u": -8.0, "Y_v": -40.0, "Y_r": 3.0, "N_v": 2.0, "N_r": -6.0}


def motion(vehicle, seed, name="1", n=400):
    """Return a run at 10 Hz under commands that are held for 2 s."""
    held = np.random.default_rng(seed).uniform([0.2, -1.0], [1.0, 1.0], (n // 20, 2))
    log = hd.Log(
        0.1 * np.arange(n),
        np.eye(n, 6) * 0.5,  # from 0.5 m/s ahead
        ("u", "v", "r"),
        commands=np.repeat(held, 20, axis=0),
        command_names=("ahead", "turn"),
        segments=(Segment(name, 0, n),),
    )
    return replace(
        log, velocity=hd.simulate(vehicle, hd.Damping.from_dict(None, TRUTH), log).velocity
    )


@pytest.fixture(scope="session")
def planar(tmp_path_factory):
    """A folder with `planar.yaml`, `a.csv`, `b.csv` and the joined `ab.csv`."""
    home = tmp_path_factory.mktemp("planar")
    shutil.copy(VEHICLES / "planar.yaml", home)
    vehicle = hd.read_vehicle(home / "planar.yaml")
    for name, runs in {"a": {"1": 1}, "b": {"1": 2}, "ab": {"one": 1, "two": 2}}.items():
        logs = (motion(vehicle, seed, segment) for segment, seed in runs.items())
        hd.write_log(hd.concatenate(logs), home / f"{name}.csv")
    return home


@pytest.fixture
def folder(planar, tmp_path, monkeypatch):
    """A copy of that folder to be in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    shutil.copytree(planar, tmp_path, dirs_exist_ok=True)
    return tmp_path


def write_boat(folder):
    """Write the files of a boat with rudder and propeller, and of its damping."""
    shutil.copy(VEHICLES / "boat.yaml", folder)
    known = {"X_u|u|": -8.0, "Y_v": -30.0, "Y_uv": -20.0, "N_r": -4.0, "N_ur": -8.0}
    hd.write_damping(hd.Damping.from_dict(None, known), folder / "boat.json")


@pytest.fixture
def boat(folder):
    write_boat(folder)
    return folder


@pytest.fixture
def bare(folder):
    """Return the folder, with the file of the vehicle without its actuators."""
    text = (folder / "planar.yaml").read_text("utf-8")
    (folder / "bare.yaml").write_text(text.partition("actuators:")[0], "utf-8")
    return folder


@pytest.fixture
def ask(call):
    """Return a function that returns what the command line prints for machines."""
    return lambda line, status=0: json.loads(call(f"{line} --json", status).stdout)


@pytest.fixture
def call():
    """Return a function that calls the command line as a shell would, and checks the status."""

    def invoke(line, status=0):
        done = CliRunner().invoke(app, line.split())
        assert done.exit_code == status, done.output
        return done

    return invoke


def add_commands(log, **columns):
    """Return a log with more commands."""
    named = {name: log.command(name) for name in log.command_names} | columns
    return replace(log, commands=np.column_stack([*named.values()]), command_names=tuple(named))


def interrupted_at(number, function):
    """Return a function that is interrupted at its n-th call, whatever thread makes it."""
    calls = itertools.count(1)

    def run(*given, **more):
        if next(calls) == number:
            raise KeyboardInterrupt
        return function(*given, **more)

    return run


@pytest.fixture
def undrawn(monkeypatch):
    """No pictures and no report: they take longer than all the rest."""
    monkeypatch.setattr("hydrodamp.cli.report.draw_diagnostics", lambda *_: ReportContent())
    monkeypatch.setattr("hydrodamp.cli.report.render_report", lambda *_: None)


def read_until(stream, pattern):
    """Return what a terminal shows until it shows a pattern; fail where it ends before."""
    seen = ""
    while not re.search(pattern, seen):
        assert select.select([stream], [], [], 60.0)[0], seen
        try:
            seen += os.read(stream, 65536).decode("utf-8", "replace")
        except OSError:  # the other end is closed
            pytest.fail(seen)
        seen = re.sub("\x1b\\[[0-9;?]*[A-Za-z]", "", seen)
    return seen
