"""The bar while logs are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hydrodamp.cli import reading as module
from hydrodamp.cli.reading import reading


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What the bar was told: its label and total, then its steps."""
    told: list[object] = []

    @contextmanager
    def progress(label: str, total: int | None, *, unit: str) -> Iterator[Callable[..., None]]:
        told.append((label, total, unit))
        yield lambda *, steps: told.append(steps)

    monkeypatch.setattr(module, "progress", progress)
    return told


def test_bytes_are_counted_over_several_logs(tmp_path: Path, shown: list[object]) -> None:
    (tmp_path / "a.csv").write_bytes(b"123")
    (tmp_path / "dive").mkdir()
    for name, content in {"b.dat": b"1", "c.dat": b"22"}.items():
        (tmp_path / "dive" / name).write_bytes(content)
    paths = [str(tmp_path / name) for name in ("a.csv", "dive", "gone.csv")]
    with reading(paths) as done:
        for path in paths:
            done(path)
    assert shown == [("reading a.csv, dive, gone.csv", 6, "B"), 3, 3, 0]


def test_of_one_log_nobody_can_tell_how_much_is_read(tmp_path: Path, shown: list[object]) -> None:
    (tmp_path / "a.csv").write_bytes(b"123")
    with reading([str(tmp_path / "a.csv")]):
        pass
    assert shown == [("reading a.csv", None, "B")]
