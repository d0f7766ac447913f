"""The verb and the card: whole or not at all, exact or said what was lost."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import Drive
from hydrodamp.export.fidelity import wrench_errors
from hydrodamp.export.scripts import Python
from hydrodamp.export.target import NotRun

PUBLISHED = hd.published["vt690-sname2022"]


@dataclass(frozen=True)
class Linear(Python):
    """A target that holds linear damping alone."""

    key: ClassVar[str] = "linear"
    meant: ClassVar[str] = "a target of linear terms"
    factor: float = 1.0

    def holds(self, craft):
        return hd.catalog["linear"]

    def write(self, craft):
        damping = replace(craft.damping, coefficients=self.factor * craft.damping.coefficients)
        return super().write(replace(craft, damping=damping))


@pytest.mark.parametrize("with_log", [True, False])
def test_an_exact_export_is_the_same_but_for_rounding(sailed, tmp_path, with_log):
    log = sailed.test if with_log else None
    card = hd.export(PUBLISHED, sailed.vehicle, "python", tmp_path / "a", log=log)
    assert card.exact
    assert max(card.wrench_error.values()) < 1e-10
    assert "the same but for rounding" in str(card)
    assert card.power["source"] == card.power["target"]
    assert (card.replays is not None) == with_log
    if card.replays:
        assert card.replays.source_to_target.rms < 1e-12
        assert card.replays.source_to_log.rms == pytest.approx(card.replays.target_to_log.rms)
    written = json.loads((tmp_path / "a" / "fidelity.json").read_text("utf-8"))
    assert (written["target"], written["exact"]) == ("python", True)


def test_a_recorded_wrench_takes_the_place_of_actuators(sailed, tmp_path):
    log = sailed.exact_test
    named = {name: log.command(name) for name in log.command_names}
    bare = replace(sailed.vehicle, weight=0.0, buoyancy=0.0)
    wrench = bare.known_wrench(log.velocity, log.down, named)
    driven = replace(log, wrench=wrench, commands=np.empty((log.n, 0)), command_names=())
    card = hd.export(PUBLISHED, sailed.vehicle, "python", tmp_path / "a", log=driven)
    assert card.inputs == ("wrench",)
    assert card.replays.source_to_target.rms < 1e-12


def test_a_vehicle_of_three_degrees_of_freedom(planar, tmp_path):
    boat, damping, log = planar
    card = hd.export(damping, boat, "python", tmp_path / "a", log=log)
    assert set(card.wrench_error) == {"X", "Y", "N"}
    assert card.replays.target_to_log.rms < 1e-12


def test_terms_a_target_cannot_hold_are_fitted_where_the_log_sailed(sailed, tmp_path):
    card = hd.export(PUBLISHED, sailed.vehicle, Linear(), tmp_path / "a", log=sailed.test)
    assert not card.exact
    assert "X_u|u|" in card.projected
    assert 0.1 < card.wrench_error["X"] < 50.0
    assert card.replays.source_to_target.rms > 0.01
    assert "cannot hold" in str(card)
    with pytest.raises(hd.MethodError, match="velocities, and there are none"):
        hd.export(PUBLISHED, sailed.vehicle, Linear(), tmp_path / "b")
    again = hd.export(
        *(PUBLISHED, sailed.vehicle, Linear(), tmp_path / "b"),
        box=hd.operating_box(Drive.of(Craft.of(sailed.vehicle, PUBLISHED), sailed.test).problem),
    )
    assert again.projected == card.projected


def test_a_projection_that_diverges_is_refused_unless_forced(sailed, tmp_path):
    wild, out = Linear(factor=-5.0), tmp_path / "a"
    with pytest.raises(hd.MethodError, match=r"the replay diverges .* the source's does not"):
        hd.export(PUBLISHED, sailed.vehicle, wild, out, log=sailed.test)
    assert not [*tmp_path.iterdir()]
    card = hd.export(PUBLISHED, sailed.vehicle, wild, out, log=sailed.test, force=True)
    assert card.replays.target_to_log.diverged
    assert "diverged after" in str(card)


def test_what_could_not_be_run_is_said(sailed, tmp_path):
    class Elsewhere(Python):
        def read(self, folder, craft):
            raise NotRun("its simulator is not installed")

    card = hd.export(PUBLISHED, sailed.vehicle, Elsewhere(), tmp_path / "a", log=sailed.test)
    assert "Not run here: its simulator is not installed." in str(card)
    assert card.replays is None
    assert card.wrench_error["X"] < 1e-10
    assert "Wrench at the log's samples, by formula and not from the files: the same" in str(card)


def test_nothing_is_overwritten(sailed, tmp_path):
    out = tmp_path / "deep" / "a"
    hd.export(PUBLISHED, sailed.vehicle, "python", out)
    before = sorted(out.iterdir())
    (out / "mine.txt").write_text("kept until --force")
    with pytest.raises(hd.FileError, match="holds an earlier export"):
        hd.export(PUBLISHED, sailed.vehicle, "python", out)
    hd.export(PUBLISHED, sailed.vehicle, "python", out, force=True)
    assert sorted(out.iterdir()) == before
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.tex").write_text("mine")
    with pytest.raises(hd.FileError, match="no export of hydrodamp"):
        hd.export(PUBLISHED, sailed.vehicle, "python", tmp_path / "b", force=True)


@pytest.mark.parametrize(
    ("target", "name"),
    [("python", "class"), ("casadi", "mpc"), ("c", "batch"), ("octave", "3 a"), ("fmu", "été */")],
)
def test_any_name_and_words_make_files_that_run(tmp_path, target, name):
    words = 'a "thesis" \\ of """1999""" */\nand more'
    vehicle = replace(hd.fleet["vt690"], name=name, source=words)
    damping = replace(PUBLISHED, vehicle=None)
    card = hd.export(damping, vehicle, target, tmp_path / "a")
    if card.not_run:
        assert "is not installed" in card.not_run or "compiler" in card.not_run
    assert max(card.wrench_error.values()) < 1e-9


def test_targets_are_found_by_name():
    with pytest.raises(hd.MethodError, match="Did you mean 'python'"):
        hd.find_target("pyhton")


def test_terms_of_propulsion_need_to_know_it(sailed, tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "X_u^2(eta-1)": 2.0})
    still = replace(sailed.vehicle, actuators=())
    log = replace(sailed.test, wrench=np.zeros((sailed.test.n, 6)), propulsion_ratio=None)
    with pytest.warns(hd.PropulsionWarning), pytest.raises(hd.ProblemError, match="record `eta`"):
        hd.export(damping, still, "python", tmp_path / "a", log=log)


def test_an_axis_that_the_source_does_not_damp_counts():
    craft = Craft.of(hd.fleet["vt690"], hd.Damping.from_dict(None, {"X_u": -4.0}))
    velocity = np.random.default_rng(0).normal(size=(50, 6))
    down, none = np.tile([0.0, 0.0, 1.0], (50, 1)), np.zeros((50, len(craft.inputs)))
    at = States(velocity, down, none, np.zeros((50, 6)))
    other = np.zeros((50, 6))
    other[:, 1] = -2.0 * velocity[:, 1]
    found = wrench_errors(craft, at, craft.acceleration(at) + other @ craft.inverse)
    size = np.sqrt(np.mean(velocity**2, axis=0))
    assert set(found) == {"X", "Y"}
    assert found["X"] == pytest.approx(0.0, abs=1e-9)
    assert found["Y"] == pytest.approx(100.0 * 2.0 * size[1] / (4.0 * size[0]))


def test_an_export_takes_no_place_but_its_own(tmp_path, monkeypatch):
    out = tmp_path / "a"
    hd.export(PUBLISHED, hd.fleet["vt690"], "python", out)
    monkeypatch.chdir(out)
    with pytest.raises(hd.FileError, match="is the folder that you are in"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "python", ".", force=True)
    (out / "deeper").mkdir()
    monkeypatch.chdir(out / "deeper")
    with pytest.raises(hd.FileError, match="is the folder that you are in"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "python", "..", force=True)
    (tmp_path / "b").symlink_to(out)
    with pytest.raises(hd.FileError, match="is a link"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "python", tmp_path / "b", force=True)


def test_an_earlier_export_stays_where_the_new_one_cannot_take_its_place(tmp_path, monkeypatch):
    out, rename = tmp_path / "a", Path.rename
    hd.export(PUBLISHED, hd.fleet["vt690"], "python", out)
    (out / "mine.txt").write_text("here still")

    def fails(path, place):
        if path.name == "export":
            raise OSError(28, "No space left on device")
        return rename(path, place)

    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(hd.FileError, match="No space left"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "python", out, force=True)
    assert (out / "mine.txt").read_text() == "here still"
