"""Ctrl-C and --resume: what is finished is kept, and the rest is all that is done again."""

from __future__ import annotations

import functools
import json
import os
import pty
import re
import select
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

import hydrodamp
from hydrodamp.cli import report
from hydrodamp.cli.resume import command_to_resume
from hydrodamp.data.canonical import write_log
from hydrodamp.identification.online.adaptive import AdaptiveIdentifier
from hydrodamp.report import files
from hydrodamp.report.files import read_comparison
from hydrodamp.simulation.campaign import reenact as campaign
from hydrodamp.validation import compare as validation

from .conftest import as_log, motion

Call = Callable[..., Result]
SOURCE = Path(hydrodamp.__file__).resolve().parents[1]
LINE = (
    "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls,ai "
    "--models linear,coe,prestero,fossen --out out"
)


class Interrupting:
    """A function that is interrupted at its n-th call."""

    def __init__(self, function: Callable[..., object], at: int) -> None:
        self.function, self.at, self.calls = function, at, 0
        self.lock = threading.Lock()

    def __call__(self, *arguments: object, **more: object) -> object:
        with self.lock:
            self.calls += 1
            number = self.calls
        if number == self.at:
            raise KeyboardInterrupt
        return self.function(*arguments, **more)


def interrupt_fits(patch: pytest.MonkeyPatch, at: int) -> None:
    fitting = Interrupting(AdaptiveIdentifier.identify, at)
    patch.setattr(AdaptiveIdentifier, "identify", lambda *given: fitting(*given))


def interrupt_replays(patch: pytest.MonkeyPatch, at: int) -> None:
    patch.setattr(validation, "replay", Interrupting(validation.replay, at))


def document(folder: str = "out") -> dict[str, object]:
    return json.loads((Path(folder) / "comparison.json").read_text("utf-8"))


def lasting(words: dict[str, str]) -> dict[str, str]:
    """Return what a run and its resumption must say alike."""
    return {key: text for key, text in words.items() if key not in ("command", "resumed")}


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures and no report: they take longer than all the rest."""
    monkeypatch.setattr(report, "illustrate", lambda *_: ())


@pytest.fixture
def whole(folder: Path, call: Call) -> dict[str, object]:
    """What comes out when nothing interrupts."""
    assert call(LINE.replace("--out out", "--out whole")).exit_code == 0
    return document("whole")


@pytest.mark.parametrize(
    ("interrupt", "at"),
    [(interrupt_fits, 1), (interrupt_fits, 3), (interrupt_replays, 1), (interrupt_replays, 6)],
)
def test_a_resumed_run_ends_where_an_uninterrupted_one_does(
    interrupt: Callable[[pytest.MonkeyPatch, int], None],
    at: int,
    whole: dict[str, object],
    folder: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as patch:
        interrupt(patch, at)
        broken = call(LINE)
    assert broken.exit_code == 130, broken.output
    part = document()
    rows = [row for row in whole["rows"] if row in part["rows"]]
    assert part["rows"] == rows
    assert len(rows) < 8
    assert part["provenance"]["unfinished"] == f"{len(rows)} of 8 rows: interrupted"
    assert len(read_comparison("out").rows) == len(rows)
    assert f"{len(rows)} of 8 rows" in broken.stderr
    assert command_to_resume() in broken.stderr
    assert "Unfinished" in (folder / "out" / "table.txt").read_text("utf-8")

    done = call(f"{LINE} --resume")
    assert done.exit_code == 0, done.output
    again = document()
    assert again["rows"] == whole["rows"]
    assert lasting(again["provenance"]) == lasting(whole["provenance"])
    for name in ("table.txt", "table.csv"):
        assert (folder / "out" / name).read_bytes() == (folder / "whole" / name).read_bytes()
    for path in (folder / "whole" / "fits").iterdir():
        assert (folder / "out" / "fits" / path.name).read_bytes() == path.read_bytes()


def test_fits_that_were_not_replayed_are_kept(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupt_replays(patch, 1)
        assert call(LINE).exit_code == 130
    assert len(list((folder / "out" / "fits").iterdir())) == 8
    with monkeypatch.context() as patch:
        interrupt_fits(patch, 1)
        done = call(f"{LINE} --resume")
    assert done.exit_code == 0, done.output
    assert document()["provenance"]["resumed"] == "8 of 8 fits are of an earlier run"


def test_a_finished_folder_is_replayed_without_fitting(
    whole: dict[str, object], call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_fits(monkeypatch, 1)
    done = call(LINE.replace("--out out", "--out whole --resume"))
    assert done.exit_code == 0, done.output
    assert document("whole")["rows"] == whole["rows"]


def test_without_a_folder_what_is_finished_is_shown(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_fits(monkeypatch, 1)
    shown = call(LINE.replace("--out out", ""))
    assert shown.exit_code == 130
    assert "Unfinished, " in shown.stdout
    assert "prestero" in shown.stdout
    assert "nothing is written. With `--out DIR`" in shown.stderr
    assert "Traceback" not in shown.output


def test_an_interruption_while_writing_leaves_the_folder_as_it_was(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupt_fits(patch, 1)
        call(LINE)
    left = {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()}
    with monkeypatch.context() as patch:
        interrupt_replays(patch, 7)
        patch.setattr(files, "save_together", Interrupting(files.save_together, 1))
        done = call(f"{LINE} --resume")
    assert done.exit_code == 130
    assert "out is as it was before" in done.stderr
    assert left == {
        path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()
    }


def test_an_interrupted_report_loses_no_row(
    whole: dict[str, object], folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "illustrate", Interrupting(report.illustrate, 1))
    done = call(LINE)
    assert done.exit_code == 130
    assert "`hydrodamp report out` makes report.html" in done.stderr
    assert document()["rows"] == whole["rows"]


def test_nothing_finished_writes_nothing(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_fits(monkeypatch, 1)
    done = call(LINE.replace("ls,ai", "ai").replace("linear,coe,prestero,fossen", "linear"))
    assert done.exit_code == 130
    assert "nothing is written" in done.stderr
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("--train one", "--train two", "--train was one and is two."),
        ("ls,ai", "ls,rls", "--methods was ls,ai and is ls,rls."),
        (",coe", "", "--models was linear,coe,prestero,fossen and is linear,prestero,fossen."),
        ("--out", "--rate-unit rad --out", "--rate-unit was deg and is rad."),
        ("--out", "--mapping mavros --out", "--mapping was not given and is mavros."),
        ("--out out", "--out nowhere", "nowhere holds no comparison.json"),
        ("--out out", "", "name it with `--out DIR`"),
    ],
)
def test_another_run_is_not_resumed(
    before: str, after: str, words: str, folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupt_fits(patch, 1)
        call(LINE)
    left = document()
    done = call(f"{LINE.replace(before, after)} --resume")
    assert done.exit_code == 2, done.output
    assert words in done.stderr
    assert document() == left


@pytest.mark.parametrize("name", ["ab.csv", "planar.yaml"])
def test_a_changed_input_is_not_resumed(
    name: str, folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupt_fits(patch, 1)
        call(LINE)
    with (folder / name).open("a", encoding="utf-8") as stream:
        stream.write("\n")
    done = call(f"{LINE} --resume")
    assert done.exit_code == 2
    assert f"the file {name} has changed" in done.stderr


def test_a_folder_that_does_not_say_how_it_was_made_is_not_resumed(
    whole: dict[str, object], folder: Path, call: Call
) -> None:
    words = {key: text for key, text in whole["provenance"].items() if key != "options"}
    path = folder / "whole" / "comparison.json"
    for provenance, said in ((words, "does not say with what options"), ([], "no provenance")):
        path.write_text(json.dumps({**whole, "provenance": provenance}), "utf-8")
        done = call(LINE.replace("--out out", "--out whole --resume"))
        assert done.exit_code == 2
        assert said in done.stderr


def test_the_demo_resumes_with_its_seed_and_its_truth(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    brief = functools.partial(campaign.reenact, duration=12.0)
    monkeypatch.setattr(campaign, "reenact", brief)
    with monkeypatch.context() as patch:
        interrupt_fits(patch, 11)  # all of ai, two and more of ai-scaled
        broken = call("demo --out out --seed 3")
    assert broken.exit_code == 130, broken.output
    assert 16 <= len(read_comparison("out").rows) < 32
    other = call("demo --out out --seed 4 --truth crossflow --resume")
    assert other.exit_code == 2
    assert "--seed was 3 and is 4." in other.stderr
    assert "--truth was sname and is crossflow." in other.stderr


def test_the_line_to_resume_is_what_was_typed() -> None:
    typed = ["compare", "my log.csv", "--out", "x", "--resume"]
    assert shlex.split(command_to_resume(typed)) == ["hydrodamp", *typed]


def read_until(stream: int, pattern: str) -> str:
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


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal")
def test_a_bar_shows_rate_and_time_left_and_ctrl_c_keeps_the_rows(folder: Path) -> None:
    first, second = motion(1, 4000), motion(2, 4000)
    rng = np.random.default_rng(0)
    for name in "uvr":
        first[name] = first[name] + 0.01 * rng.standard_normal(4000)
    both = {name: np.concatenate([first[name], second[name]]) for name in first}
    write_log(as_log(both, ["one"] * 4000 + ["two"] * 4000), folder / "ab.csv")
    line = "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls,oe --out out"
    terminal, other_end = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "hydrodamp", *line.split()],
        stdout=subprocess.PIPE,
        stderr=other_end,
        env={**os.environ, "COLUMNS": "120", "TERM": "xterm", "PYTHONPATH": str(SOURCE)},
    ) as process:
        os.close(other_end)
        bar = r"by oe \(2 of 2\) \S+ +[1-7]/8 \d+\.\d(/s| s each) 0:\d\d:\d\d \d\d:\d\d left"
        read_until(terminal, bar)
        process.send_signal(signal.SIGINT)
        said = read_until(terminal, "--resume")
        output, _ = process.communicate(timeout=60)
    os.close(terminal)
    assert process.returncode == 130
    assert "Traceback" not in said + output.decode()
    assert f"hydrodamp {line} --resume" in " ".join(said.split())
    rows = read_comparison(folder / "out").rows
    assert 9 <= len(rows) < 16
    assert f"interrupted: {len(rows)} of 16 rows" in said
