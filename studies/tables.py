"""Rows of studies, and their tables in the pages of the documentation."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from rich.progress import track

from hydrodamp.files import save_text

Row = TypeVar("Row")


def replace_table(page: Path, marks: tuple[str, str], text: str) -> None:
    """Replace what a page has between two marks."""
    old = page.read_text("utf-8")
    before, after = old.split(marks[0])[0], old.split(marks[1])[1]
    save_text(f"{before}{marks[0]}\n{text}\n{marks[1]}{after}", page)


def finish_jobs(
    path: Path, jobs: Mapping[str, Callable[[], Iterable[Row]]], row: Callable[..., Row]
) -> list[Row]:
    """Return the rows of a file of finished jobs and of those that it lacks, which it gets."""
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    done = {name: [row(*each) for each in rows] for name, rows in map(json.loads, lines)}
    for name in track([name for name in jobs if name not in done], "identify"):
        done[name] = list(jobs[name]())
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([name, done[name]]) + "\n")
    return [each for rows in done.values() for each in rows]
