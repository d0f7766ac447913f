"""Public logs by name: fetched from a server of our own, checked by hashlib."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import json
import re
import sys
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.ingest.datasets.fetching import fetch, look
from hydrodamp.ingest.datasets.lock import LOCK
from hydrodamp.ingest.datasets.registry import DataFile, Dataset, datasets, find_dataset
from hydrodamp.ingest.mapping import read_mapping

CONTENT = {"a.dat": b"time,u\n0,1\n", "b.dat": b"time,v\n0,2\n"}


class Quiet(SimpleHTTPRequestHandler):
    """A server that writes nothing."""

    def log_message(self, *words: object) -> None:
        """Say nothing."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Dataset]:
    """A dataset of two files on this machine; the first has a checksum."""
    source = tmp_path / "source"
    source.mkdir()
    for name, content in CONTENT.items():
        (source / name).write_bytes(content)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=source)) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        base = f"http://127.0.0.1:{server.server_port}/"
        known = hashlib.sha256(CONTENT["a.dat"]).hexdigest()
        files = (DataFile("a.dat", f"{base}a.dat", known), DataFile("b.dat", f"{base}b.dat"))
        words = dict.fromkeys(("title", "note", "page", "licence", "citation", "mapping"), "-")
        yield Dataset("mine", **words, files=files)
        server.shutdown()
        thread.join()


def test_the_registry_is_whole() -> None:
    for name, dataset in datasets().items():
        assert dataset.name == name
        assert all(dataclasses.asdict(dataset).values())
        assert read_mapping(dataset.mapping)
        names = [file.name for file in dataset.files]
        assert names == sorted(set(names))
        for file in dataset.files:
            assert file.name == Path(file.name).name
            assert re.fullmatch(r"|[0-9a-f]{64}", file.sha256)
            assert re.fullmatch(rf"|https://.*/[0-9a-f]{{40}}/.*/{re.escape(file.name)}", file.url)
            assert not file.sha256 or file.url


def test_an_unknown_name() -> None:
    with pytest.raises(FileError, match="Did you mean 'vt690-field'"):
        find_dataset("vt690")


@pytest.mark.parametrize(
    ("name", "place", "counts"),
    [
        ("kvlcc2-hsva", "kvlcc2_hsva", (9, 0, 4)),
        ("vt690-field", "vt690_field", (5, 0, 0)),
        ("bluerov2-kth", "bluerov2_kth", (0, 4, 0)),
    ],
)
def test_measured_logs_are_those_of_the_registry(measured_logs, name, place, counts) -> None:
    found = look(find_dataset(name), measured_logs(place))
    assert (len(found.verified), len(found.unchecked), len(found.lacking)) == counts


def test_downloads_once_and_records_what_has_no_checksum(served: Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    first = fetch(served, folder)
    assert first.downloaded == ("a.dat", "b.dat")
    assert (first.verified, first.locked, first.recorded) == (("a.dat",), ("b.dat",), ("b.dat",))
    assert {name: (folder / name).read_bytes() for name in CONTENT} == CONTENT
    lock = json.loads((folder / LOCK).read_text(encoding="utf-8"))
    assert lock["sha256"] == {"b.dat": hashlib.sha256(CONTENT["b.dat"]).hexdigest()}
    again = fetch(served, folder)
    assert (again.downloaded, again.recorded, again.lacking) == ((), (), ())
    assert (again.verified, again.locked) == (("a.dat",), ("b.dat",))


def test_bytes_are_told_as_they_come(served: Dataset, tmp_path: Path) -> None:
    content = b"x" * 2500
    (tmp_path / "source" / "a.dat").write_bytes(content)
    known = hashlib.sha256(content).hexdigest()
    files = (dataclasses.replace(served.files[0], sha256=known), served.files[1])
    told: list[tuple[str, int, int]] = []
    fetch(
        dataclasses.replace(served, files=files),
        tmp_path / "x",
        lambda *words: told.append(words),
    )
    sizes = {"a.dat": 2500, "b.dat": len(CONTENT["b.dat"])}
    assert list(dict.fromkeys(name for name, _, _ in told)) == ["a.dat", "b.dat"]
    for name, size in sizes.items():
        own = [(done, of) for file, done, of in told if file == name]
        assert {of for _, of in own} == {size}
        assert [done for done, _ in own] == sorted(done for done, _ in own)
        assert own[-1] == (size, size)
    assert told[0] == ("a.dat", 1024, 2500)


def test_what_is_there_is_not_downloaded_and_not_recorded(served: Dataset, tmp_path: Path) -> None:
    (tmp_path / "b.dat").write_bytes(b"mine")
    found = fetch(served, tmp_path)
    assert found.downloaded == ("a.dat",)
    assert found.unchecked == ("b.dat",)
    assert (tmp_path / "b.dat").read_bytes() == b"mine"
    assert not (tmp_path / LOCK).exists()


def test_files_that_changed_are_named_together(served: Dataset, tmp_path: Path) -> None:
    fetch(served, tmp_path)
    for name in CONTENT:
        (tmp_path / name).write_bytes(b"other")
    with pytest.raises(FileError, match="2 faults") as told:
        fetch(served, tmp_path)
    assert "`a.dat` is not the file that the registry knows" in str(told.value)
    assert f"`b.dat` is not the file that `{LOCK}` knows" in str(told.value)


def test_another_file_than_known_is_not_kept(served: Dataset, tmp_path: Path) -> None:
    wrong = dataclasses.replace(served.files[0], sha256="0" * 64)
    with pytest.raises(FileError, match="was not kept"):
        fetch(dataclasses.replace(served, files=(wrong,)), tmp_path / "x")
    assert list((tmp_path / "x").iterdir()) == []


def test_a_file_that_is_not_on_the_server(served: Dataset, tmp_path: Path) -> None:
    gone = dataclasses.replace(served.files[1], name="c.dat", url=served.files[1].url + ".gone")
    with pytest.raises(FileError, match="cannot be downloaded: 404"):
        fetch(dataclasses.replace(served, files=(*served.files, gone)), tmp_path / "x")
    assert sorted(path.name for path in (tmp_path / "x").iterdir()) == ["a.dat", "b.dat", LOCK]


def test_a_folder_that_cannot_be_made(served: Dataset, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match="cannot be made"):
        fetch(served, tmp_path / "file" / "below")


def test_without_pooch_what_is_there_can_still_be_used(
    served: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(FileError, match=re.escape('pip install "hydrodamp[logs]"')):
        fetch(served, tmp_path)
    for name, content in CONTENT.items():
        (tmp_path / name).write_bytes(content)
    assert fetch(served, tmp_path).verified == ("a.dat",)


def test_nothing_is_imported_before_it_is_used() -> None:
    module = importlib.import_module("hydrodamp.ingest.datasets.fetching")
    assert "pooch" not in vars(module)


@pytest.mark.parametrize("text", ["[]", '{"sha256": [1]}', '{"sha256": {"a": 1}}'])
def test_a_lock_file_that_is_none(served: Dataset, tmp_path: Path, text: str) -> None:
    (tmp_path / LOCK).write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match="Remove it to record anew"):
        look(served, tmp_path)


def test_a_file_that_cannot_be_read(served: Dataset, tmp_path: Path) -> None:
    (tmp_path / "a.dat").mkdir()
    with pytest.raises(FileError, match="cannot be read"):
        look(served, tmp_path)
