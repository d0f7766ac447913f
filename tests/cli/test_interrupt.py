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
from hydrodamp.cli import report, run
from hydrodamp.cli.resume import command_to_resume, differences
from hydrodamp.data.canonical import write_log
from hydrodamp.errors import MethodError
from hydrodamp.identification.online.adaptive import AdaptiveIdentifier
from hydrodamp.report import files
from hydrodamp.report.files import read_comparison
from hydrodamp.report.unfinished import Earlier
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
    """A function that is interrupted at its n-th call, or fails."""

    def __init__(
        self,
        function: Callable[..., object],
        at: int,
        error: BaseException | type[BaseException] = KeyboardInterrupt,
    ) -> None:
        self.function, self.at, self.error, self.calls = function, at, error, 0
        self.lock = threading.Lock()

    def __call__(self, *arguments: object, **more: object) -> object:
        with self.lock:
            self.calls += 1
            number = self.calls
        if number == self.at:
            raise self.error
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


def test_ctrl_c_between_fits_and_replays_keeps_the_fits(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_fits(monkeypatch, 3)
    monkeypatch.setattr(run, "note", Interrupting(run.note, 1))
    broken = call(LINE)
    assert broken.exit_code == 130
    count = len(list((folder / "out" / "fits").iterdir()))
    assert 4 <= count < 8
    assert f"0 of 8 rows and {count} fits without a replay are written to out" in broken.stderr


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


def test_an_interrupted_report_loses_no_row(
    whole: dict[str, object], folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "illustrate", Interrupting(report.illustrate, 1))
    done = call(LINE)
    assert done.exit_code == 130
    assert f"To make those: {command_to_resume()}" in done.stderr
    assert document()["rows"] == whole["rows"]


def test_what_was_drawn_before_an_interruption_stays(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def draw_half(_comparison: object, _vehicle: object, _train: object, home: Path) -> None:
        (home / "report.html").write_text("drawn", "utf-8")
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "illustrate", draw_half)
    assert call(LINE).exit_code == 130
    assert (folder / "out" / "report.html").read_text("utf-8") == "drawn"


def test_finished_rows_are_written_over_an_older_comparison_even_if_that_is_interrupted(
    whole: dict[str, object], folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert call(LINE.replace("linear,coe,prestero,fossen", "linear")).exit_code == 0
    monkeypatch.setattr(files, "save_all", Interrupting(files.save_all, 1))
    assert call(LINE).exit_code == 130
    assert document()["rows"] == whole["rows"]


@pytest.mark.parametrize(
    ("more", "words"),
    [("", "To go on from there: "), (" --rate-unit rad", "That is of another run: name another")],
)
def test_fewer_rows_never_replace_more(
    more: str,
    words: str,
    whole: dict[str, object],
    folder: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left = document("whole")
    interrupt_fits(monkeypatch, 1)
    done = call(LINE.replace("--out out", "--out whole") + more)
    assert done.exit_code == 130
    assert "whole holds more, 8 fits and 8 rows, and stays as it is" in done.stderr
    assert words in done.stderr
    assert (command_to_resume() in done.stderr) == (not more)
    assert document("whole") == left


def test_replays_interrupted_again_never_replace_rows(
    whole: dict[str, object], call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_replays(monkeypatch, 1)
    done = call(LINE.replace("--out out", "--out whole --resume"))
    assert done.exit_code == 130
    assert document("whole")["rows"] == whole["rows"]


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (MethodError("ai: no numbers came out."), 2, "error: ai: no numbers came out."),
        (MemoryError("too large"), 1, "internal failure: MemoryError: too large"),
    ],
)
def test_what_is_finished_outlives_a_failure(
    error: Exception,
    status: int,
    words: str,
    whole: dict[str, object],
    folder: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as patch:
        fitting = Interrupting(AdaptiveIdentifier.identify, 3, error)
        patch.setattr(AdaptiveIdentifier, "identify", lambda *given: fitting(*given))
        broken = call(LINE)
    assert broken.exit_code == status, broken.output
    assert words in broken.stderr
    assert command_to_resume() in broken.stderr
    rows = document()["rows"]
    assert 6 <= len(rows) < 8
    assert rows == [row for row in whole["rows"] if row in rows]
    name = type(error).__name__
    said = f"{len(rows)} of 8 rows: ended by an error ({name})"
    assert document()["provenance"]["unfinished"] == said
    assert call(f"{LINE} --resume").exit_code == 0
    assert document()["rows"] == whole["rows"]


def test_a_failed_replay_loses_no_fit(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = Interrupting(validation.replay, 3, MethodError("no replay."))
    monkeypatch.setattr(validation, "replay", failing)
    broken = call(LINE)
    assert broken.exit_code == 2
    assert "error: no replay." in broken.stderr
    assert len(list((folder / "out" / "fits").iterdir())) == 8


def test_a_failure_before_any_fit_is_only_told(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = Interrupting(AdaptiveIdentifier.identify, 1, MethodError("no numbers."))
    monkeypatch.setattr(AdaptiveIdentifier, "identify", lambda *given: failing(*given))
    line = LINE.replace("ls,ai", "ai").replace("linear,coe,prestero,fossen", "linear")
    broken = call(line)
    assert (broken.exit_code, broken.stderr) == (2, "error: no numbers.\n")
    assert not (folder / "out").exists()


def test_fits_of_the_recommended_method_are_gone_on_with(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = LINE.replace("ls,ai", "recommended").replace("linear,coe,prestero,fossen", "linear")
    with monkeypatch.context() as patch:
        interrupt_replays(patch, 1)
        assert call(line).exit_code == 130
    done = call(f"{line} --resume")
    assert done.exit_code == 0, done.output
    assert document()["provenance"]["resumed"] == "1 of 1 fits are of an earlier run"


def test_the_choice_of_an_unfinished_run_is_qualified(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "So far" not in call(LINE).stdout
    interrupt_fits(monkeypatch, 1)
    shown = call(LINE.replace("--out out", "--out other"))
    assert re.search(r"So far \w+ by ls \(", shown.stdout)


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
    behind = ["compare", "--out", "x", "--", "-log.csv", "--resume"]  # a log of that name
    said = shlex.split(command_to_resume(behind))
    assert said == ["hydrodamp", "compare", "--resume", *behind[1:]]


def test_the_line_to_resume_has_the_quotes_of_its_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    typed = ["demo", "--out", "my folder"]
    assert command_to_resume(typed) == "hydrodamp demo --resume --out 'my folder'"
    monkeypatch.setattr(sys, "platform", "win32")
    assert command_to_resume(typed) == 'hydrodamp demo --resume --out "my folder"'


def test_a_run_without_files_names_none_that_differs() -> None:
    said = {"options": "--seed 0", "versions": "1"}
    earlier = Earlier(Path("out"), {**said, "hydrodamp": hydrodamp.__version__}, 0, ())
    assert differences(earlier, said) == ()
    assert differences(earlier, {**said, "files": "0f  a.csv"}) == (
        "the file a.csv is read, and was not.",
    )


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
        said = read_until(terminal, r"--resume [^\n]*--out out")
        output, _ = process.communicate(timeout=60)
    os.close(terminal)
    assert process.returncode == 130
    assert "Traceback" not in said + output.decode()
    assert f"hydrodamp {line.replace('compare', 'compare --resume')}" in " ".join(said.split())
    rows = read_comparison(folder / "out").rows
    assert 9 <= len(rows) < 16
    assert f"interrupted: {len(rows)} of 16 rows" in said
