"""``hydrodamp datasets``: the licence first, then files that are checked."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from hydrodamp.cli.datasets import datasets
from hydrodamp.cli.output import guarded
from hydrodamp.errors import FileError
from hydrodamp.ingest import datasets as registry
from hydrodamp.ingest.datasets import DataFile, Dataset

Run = Callable[..., Result]
CONTENT = {"a.dat": "time,u\n", "b.dat": "time,v\n"}


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return a function that calls the command, answering what it asks."""
    monkeypatch.chdir(tmp_path)
    app = typer.Typer()
    app.command()(guarded(datasets))

    def call(line: str = "", answer: str = "") -> Result:
        return CliRunner().invoke(app, line.split(), input=answer)

    return call


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dataset:
    """The only dataset there is: two files to download, from this machine."""
    source = tmp_path / "source"
    source.mkdir()
    for name, content in CONTENT.items():
        (source / name).write_text(content, encoding="utf-8")
    files = tuple(DataFile(name, (source / name).as_uri()) for name in CONTENT)
    words = ("My log", "A dive.", "https://example.org", "MIT", "Me", "avl690")
    dataset = Dataset("mine", *words, files)
    monkeypatch.setattr(registry, "datasets", lambda: {"mine": dataset})
    return dataset


def test_lists_what_is_known(run: Run) -> None:
    done = run()
    assert done.exit_code == 0
    for word in ("kvlcc2-hsva", "vt690-field", "bluerov2-kth", "licences"):
        assert word in done.stdout
    listed = json.loads(run("--json").stdout)["datasets"]
    assert [one["name"] for one in listed] == ["kvlcc2-hsva", "vt690-field", "bluerov2-kth"]
    hashes = [file["sha256"] for file in listed[0]["files"]]
    assert (len(hashes), hashes.count("")) == (13, 4)


def test_shows_the_licence_before_it_asks(run: Run, mine: Dataset) -> None:
    done = run("mine", "y\n")
    assert done.exit_code == 0
    assert done.stderr.index("Licence: MIT") < done.stderr.index("Download 2 files")
    assert "2 files downloaded" in done.stderr
    assert done.stdout.splitlines()[-1] == str(Path("datasets", "mine"))
    assert Path("datasets/mine/a.dat").read_text(encoding="utf-8") == CONTENT["a.dat"]
    again = run("mine")
    assert "Download" not in again.stderr
    assert "2 files taken as they are: no checksum is known" in again.stderr


@pytest.mark.parametrize("answer", ["n\n", ""])
def test_nothing_is_downloaded_without_consent(run: Run, mine: Dataset, answer: str) -> None:
    done = run("mine", answer)
    assert done.exit_code == 2
    assert "holds none of the 2 files of 'mine'" in done.stderr
    assert ("say --yes" in done.stderr) == (answer == "")
    assert not Path("datasets").exists()


def test_yes_asks_nothing(run: Run, mine: Dataset) -> None:
    told = json.loads(run("mine --yes --json --folder here").stdout)
    assert told["downloaded"] == told["unchecked"] == ["a.dat", "b.dat"]
    assert (told["folder"], told["mapping"], told["lacking"]) == ("here", "avl690", [])


def test_a_local_folder_serves_without_network(run: Run, mine: Dataset, tmp_path: Path) -> None:
    (tmp_path / "a.dat").write_text("mine", encoding="utf-8")
    done = run("mine --folder .", "n\n")
    assert done.exit_code == 0
    assert "1 file taken as they are: no checksum is known" in done.stderr
    assert "1 file not there" in done.stderr
    assert not (tmp_path / "b.dat").exists()


def test_measured_logs_offline(run: Run, measured_logs: Callable[[str], Path]) -> None:
    folder = measured_logs("vt690_field")
    done = run(f"vt690-field --folder {folder}")
    assert done.exit_code == 0
    assert "do not pass the files on" in done.stderr
    assert "5 files with the checksum that hydrodamp knows" in done.stderr
    assert "--mapping avl690" in done.stderr


def test_an_unknown_name(run: Run) -> None:
    done = run("kvlcc2")
    assert done.exit_code == 2
    assert "Did you mean 'kvlcc2-hsva'?" in done.stderr


def test_a_log_that_has_no_address(run: Run) -> None:
    done = run("bluerov2-kth --yes")
    assert done.exit_code == 2
    assert "They come from https://github.com/SAABmarine-MEX" in done.stderr
    assert FileError.__name__ not in done.stderr
