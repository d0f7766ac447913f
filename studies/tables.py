"""Rows of studies, and their tables in the pages of the documentation."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

import typer
from rich.progress import track

from hydrodamp.files import save_text

Row = TypeVar("Row")

TABLES = "<!-- tables -->", "<!-- end of tables -->"
"""Marks of a page with one set of tables."""


def replace_table(page: Path, marks: tuple[str, str], text: str) -> None:
    """Replace what a page has between two marks."""
    before, first, rest = page.read_text("utf-8").partition(marks[0])
    _, last, after = rest.partition(marks[1])
    if not last:
        raise typer.BadParameter(f"{page} lacks a line {marks[0]}, or {marks[1]} after it")
    save_text(f"{before}{first}\n{text}\n{last}{after}", page)


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
