"""``hydrodamp list datasets``: the licence first, then files that are checked."""

import json
from pathlib import Path

import pytest

from hydrodamp.ingest import datasets as registry
from hydrodamp.ingest.datasets import DataFile, Dataset

CONTENT = {"a.dat": "time,u\n", "b.dat": "time,v\n"}


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """The only dataset there is: two files to download, from this machine."""
    monkeypatch.chdir(tmp_path)
    source = tmp_path / "source"
    source.mkdir()
    for name, content in CONTENT.items():
        (source / name).write_text(content, encoding="utf-8")
    files = tuple(DataFile(name, (source / name).as_uri()) for name in CONTENT)
    words = ("My log", "A dive.", "https://example.org", "MIT", "Me", "avl690")
    dataset = Dataset("mine", *words, files)
    monkeypatch.setattr(registry, "datasets", lambda: {"mine": dataset})


def test_lists_what_is_known(call):
    done = call("list datasets")
    for word in ("kvlcc2-hsva", "vt690-field", "bluerov2-kth", "licence"):
        assert word in done.stdout
    listed = json.loads(call("list datasets --json").stdout)["datasets"]
    names = ["kvlcc2-hsva", "vt690-field", "bluerov2-kth", "esso-osaka"]
    assert [one["name"] for one in listed] == names
    hashes = [file["sha256"] for file in listed[0]["files"]]
    assert (len(hashes), hashes.count("")) == (13, 4)


@pytest.mark.usefixtures("mine")
def test_nothing_is_downloaded_without_consent(call):
    done = call("list datasets mine", 2)
    assert "Licence: MIT" in done.stderr
    assert "none of the 2 files of 'mine'" in done.stderr
    assert "--yes" in done.stderr
    assert not Path("datasets").exists()


@pytest.mark.usefixtures("mine")
def test_yes_downloads_what_is_not_there(call):
    told = json.loads(call("list datasets mine --yes --json --out here").stdout)
    assert told["downloaded"] == told["unchecked"] == ["a.dat", "b.dat"]
    assert (told["folder"], told["mapping"], told["lacking"]) == ("here", "avl690", [])
    Path("here/b.dat").unlink()
    done = call("list datasets mine --out here")
    assert "1 of 2 files not verified" in done.stderr
    assert "1 of 2 files missing" in done.stderr
    done = call("list datasets mine --out here --yes")
    assert "1 of 2 files downloaded" in done.stderr
    assert done.stdout == "here\n"
    assert Path("here/b.dat").read_text(encoding="utf-8") == CONTENT["b.dat"]
