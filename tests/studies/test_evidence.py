"""Pages of evidence: every page has its study, and its numbers are of the present sources."""

from __future__ import annotations

import re
from contextlib import nullcontext

import pytest
import typer

import evidence

PAGES = [
    page
    for page in sorted(evidence.PAGES.glob("*.md"))
    if evidence.MARKS[0] in page.read_text("utf-8")
]


def test_every_page_with_tables_has_a_study():
    assert {page.stem for page in PAGES} == {study.page for study in evidence.STUDIES}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_numbers_are_of_the_sources_that_a_page_states(page):
    text = page.read_text("utf-8").split(evidence.MARKS[0])[1].split(evidence.MARKS[1])[0]
    stated = re.findall(r"sources `(\w+)`", text)
    present = [evidence.source_digest(page.stem)]
    assert stated == present, "python studies/evidence.py makes the tables"


def test_the_digest_is_of_code_and_not_of_docstrings(tmp_path):
    contents = []
    for text in ('"""A."""\nx = 1  # one\n', '"""B."""\n\nx = 1\n', '"""A."""\nx = 2\n'):
        path = tmp_path / "module.py"
        path.write_text(text)
        contents.append(evidence._content(path))
    assert contents[0] == contents[1] != contents[2]


@pytest.mark.parametrize(
    ("code", "minutes", "is_stamped"),
    [
        ("0", 1.0, True),
        ("raise SystemExit(3)", 1.0, False),
        ("import time; time.sleep(60)", 0.0, False),
    ],
)
def test_only_a_page_whose_studies_finished_states_its_sources(
    tmp_path, monkeypatch, code, minutes, is_stamped
):
    page = tmp_path / "sensors.md"
    page.write_text("\n".join(evidence.MARKS))
    monkeypatch.setattr(evidence, "PAGES", tmp_path)
    monkeypatch.setattr(evidence, "STUDIES", (evidence.Study("sensors", f"-c '{code}'"),))
    with nullcontext() if is_stamped else pytest.raises(typer.Exit):
        evidence.main(tmp_path / "out", minutes, tmp_path, "")
    assert (evidence.source_digest("sensors") in page.read_text()) == is_stamped
