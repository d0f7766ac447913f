"""Public logs by name: fetched from a server of our own, checked by hashlib."""

from __future__ import annotations

import dataclasses
import hashlib
import re
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from hydrodamp.errors import FileError
from hydrodamp.ingest.datasets import DataFile, Dataset, check_folder, datasets, fetch, find_dataset
from hydrodamp.ingest.mapping import read_mapping
from table_rows import rows

CONTENT = {"a.dat": b"time,u\n0,1\n" * 20_000, "b.dat": b"time,v\n0,2\n"}


class Quiet(SimpleHTTPRequestHandler):
    """A server that writes nothing, and sends half of what is called so."""

    def log_message(self, *words: object) -> None:
        """Say nothing."""

    def do_GET(self) -> None:
        if not self.path.endswith("half"):
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Length", "100")
        self.end_headers()
        self.wfile.write(b"x" * 50)


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


@rows("name, place, counts")
def test_measured_logs_are_those_of_the_registry(measured_logs, name, place, counts) -> None:
    checked = check_folder(find_dataset(name), measured_logs(place))
    assert [len(checked.verified), len(checked.unchecked), len(checked.lacking)] == counts


def test_what_is_there_is_checked_and_not_downloaded_again(served: Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    first = fetch(served, folder)
    assert (first.verified, first.unchecked, first.lacking) == (("a.dat",), ("b.dat",), ())
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == CONTENT
    (folder / "b.dat").write_bytes(b"mine")
    assert fetch(served, folder) == first
    assert (folder / "b.dat").read_bytes() == b"mine"


def test_files_that_changed_are_named_together(served: Dataset, tmp_path: Path) -> None:
    twice = dataclasses.replace(served.files[0], name="c.dat")
    dataset = dataclasses.replace(served, files=(*served.files, twice))
    for name in ("a.dat", "c.dat"):
        (tmp_path / name).write_bytes(b"other")
    with pytest.raises(FileError, match="2 faults") as caught:
        fetch(dataset, tmp_path)
    assert "`a.dat` does not match the SHA-256 checksum" in str(caught.value)


@rows("sha256, name, says")
def test_a_file_that_is_not_whole_is_not_kept(
    served: Dataset, tmp_path: Path, sha256: str, name: str, says: str
) -> None:
    file = served.files[1]
    wrong = dataclasses.replace(file, sha256=sha256, url=file.url.replace("b.dat", name))
    with pytest.raises(FileError, match=says):
        fetch(dataclasses.replace(served, files=(served.files[0], wrong)), tmp_path / "x")
    assert [path.name for path in (tmp_path / "x").iterdir()] == ["a.dat"]
