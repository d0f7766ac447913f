"""The pages keep their word: their Python runs, their commands and names exist."""

from __future__ import annotations

import doctest
import re
import shlex
import warnings
from pathlib import Path
from typing import Any

import pytest
import typer

import hydrodamp as hd
from hydrodamp.cli.main import app
from hydrodamp.identification.fit_files import read_fit

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    *sorted(set(DOCS.rglob("*.md")) - set((DOCS / "_build").rglob("*.md"))),
]
BLOCK = re.compile(r"^```(\S+)[^\n]*\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)


def blocks(page, language):
    """Return the blocks of a language, each with the line it begins at."""
    text = page.read_text(encoding="utf-8")
    found = (one for one in BLOCK.finditer(text) if one.group(1) == language)
    return [(text.count("\n", 0, one.start(2)), one.group(2)) for one in found]


def called(page):
    return page.relative_to(ROOT).as_posix()


def code(page):
    """Return what a reader would run: blocks of Python, or cells that the build runs too."""
    return blocks(page, "python") + blocks(page, "{code-cell}")


NOTEBOOKS = DOCS / "notebooks"
"""Run whenever the pages are built, and there alone, for they draw."""

WITH_PYTHON = [page for page in PAGES if code(page) and page.parent != NOTEBOOKS]


@pytest.mark.parametrize("page", WITH_PYTHON, ids=called)
def test_the_python_of_a_page_runs(page, dive, sailed_once, capsys):
    if "import pandas" in page.read_text("utf-8"):
        pytest.importorskip("pandas", reason="the page needs the extra hydrodamp[pandas]")
    names: dict[str, Any] = {"hd": hd, "__name__": "__main__"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hd.HydrodampWarning)  # said to a reader, no fault
        for line, block in code(page):
            exec(compile("\n" * line + script(block), called(page), "exec"), names)
    if page.name == "README.md":
        assert read_fit("result/damping.json").vehicle == names["vehicle"]


def script(block):
    """Return a block without prompts and without what it prints."""
    prompted = doctest.DocTestParser().get_examples(block)
    return "".join(example.source for example in prompted) or block


def calls(page):
    """Yield the commands of a page's shell blocks, word by word."""
    for _, block in blocks(page, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words:
                yield words


def command_of(words):
    """Return the command that is called, and the words left over."""
    command, rest = typer.main.get_command(app), words[1:]
    while rest and rest[0] in getattr(command, "commands", {}):
        command, rest = command.commands[rest[0]], rest[1:]
    return command, rest


CALLS = [(called(page), words) for page in PAGES for words in calls(page)]
OURS = [(page, words) for page, words in CALLS if words[0] == "hydrodamp"]


@pytest.mark.parametrize(("page", "words"), OURS, ids=[" ".join(words) for _, words in OURS])
def test_a_command_of_a_page_exists(page, words):
    command, rest = command_of(words)
    assert not getattr(command, "commands", None), f"{page}: no such command"
    options = {name: one for one in command.params for name in one.opts}
    given = {word for word in rest if word.startswith("--")}
    assert not given - set(options), page
    missing = {name for name, one in options.items() if one.required and name.startswith("--")}
    assert not missing - given, page
    places = [one for one in command.params if one.param_type_name == "argument"]
    assert any(not one.required for one in places) or len(values(rest, options)) >= len(places)


def values(rest, options):
    """Return the words that are neither an option nor its value."""
    found, words = [], iter(rest)
    for word in words:
        if not word.startswith("--"):
            found.append(word)
        elif not options[word].is_flag:
            next(words)
    return found


@pytest.mark.parametrize(
    ("page", "words"),
    [call for call in CALLS if call[1][0] == "python"],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_a_script_of_a_page_exists(page, words):
    assert (DOCS.parent / words[1]).is_file(), page


def test_files_in_yaml_blocks_are_models_where_they_have_terms(tmp_path):
    for number, (_, block) in enumerate(blocks(DOCS / "how-to/extend/model.md", "yaml")):
        file = tmp_path / f"{number}.yaml"
        file.write_text(block, encoding="utf-8")
        assert hd.read_models(file)[0].n_coefficients


def test_every_name_after_hd_on_a_page_is_public():
    """Also in prose, where nothing runs."""
    public = {*hd.__all__, "__all__", "__version__"}
    for page in PAGES:
        names = re.findall(r"\bhd\.([A-Za-z_]\w*)", page.read_text(encoding="utf-8"))
        assert not {*names} - public, page
