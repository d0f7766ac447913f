"""Tables of studies in the pages of the documentation."""

from __future__ import annotations

from pathlib import Path

from hydrodamp.files import save_text


def replace_table(page: Path, marks: tuple[str, str], text: str) -> None:
    """Replace what a page has between two marks."""
    old = page.read_text("utf-8")
    before, after = old.split(marks[0])[0], old.split(marks[1])[1]
    save_text(f"{before}{marks[0]}\n{text}\n{marks[1]}{after}", page)
