"""The bar while logs are read."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest

from hydrodamp.cli import reading as module
from hydrodamp.cli.reading import reading


def test_the_bytes_of_all_logs_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.csv").write_bytes(b"123")
    (tmp_path / "dive").mkdir()
    for name, content in {"b.dat": b"1", "c.dat": b"22"}.items():
        (tmp_path / "dive" / name).write_bytes(content)
    told: list[object] = []

    def followed(label: str, total: int, *, unit: str) -> AbstractContextManager[None]:
        told.extend((label, total, unit))
        return nullcontext()

    monkeypatch.setattr(module, "followed", followed)
    with reading([str(tmp_path / name) for name in ("a.csv", "dive", "gone.csv", "d.csv")]):
        pass
    assert told == ["reading a.csv, dive, gone.csv", 6, "B"]
