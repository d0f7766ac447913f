"""Transcripts of wrong calls: a message, status 2, or 1 where the call says so; nothing is written.

`refused_calls.txt` has the calls; `spoilt` has the files that they name beside those of `folder`.
"""

import os
import re
import shutil
from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.identification.stepwise import StepwiseSelection

from .conftest import TRUTH, write_boat

HERE = Path(__file__).parent
LINES = (HERE / "refused_calls.txt").read_text("utf-8").splitlines()
CALLS = [
    pytest.param(line, id=line, marks=[pytest.mark.slow] * line.startswith("batch a.csv"))
    for line in LINES
    if not line.startswith("#")
]


@pytest.fixture(scope="module")
def files(planar, tmp_path_factory):
    home = tmp_path_factory.mktemp("refused")
    for source in (planar, HERE / "spoilt"):
        shutil.copytree(source, home, dirs_exist_ok=True)
    write_boat(home)
    shutil.copy(home / "a.csv", home / "c.report.html")
    os.link(home / "a.csv", home / "link.csv")
    hd.write_damping(hd.Damping.from_dict(None, TRUTH), home / "d.json")
    hd.write_damping(hd.published["vt690-sname2022"], home / "vt690.json")
    return home, {path: path.read_bytes() for path in home.rglob("*.*")}


@pytest.mark.parametrize("line", CALLS)
def test_a_wrong_call_is_refused_in_a_sentence_and_writes_nothing(
    files, call, line, snapshot, monkeypatch
):
    home, before = files
    monkeypatch.chdir(home)
    monkeypatch.setattr(StepwiseSelection, "select", lambda *_: pytest.fail("selected for minutes"))
    status, words = re.fullmatch(r"(?:(1) )?(.*)", line).groups()
    done = call(words, int(status or 2))
    assert status or done.stdout == ""
    assert "Traceback" not in done.output
    assert {path: path.read_bytes() for path in home.rglob("*.*")} == before
    assert not (home / "season").exists()
    assert " ".join(done.stderr.split()) == snapshot
