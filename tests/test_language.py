"""Names and prose use the terms of the field: counts of other words, each with a ceiling."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "hydrodamp").rglob("*.py"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
PAGES += sorted(path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts)
WORDS = tomllib.loads(Path(__file__).with_name("words.toml").read_text("utf-8"))


def words(name):
    """Return a list of the file of words."""
    return frozenset(WORDS[name].split())


PARTICIPLES = words("participles")
FILLERS = words("fillers")
GENERIC = words("generic")
COLLOQUIAL = re.compile(
    r"\b(alike|apart|beside|comes? to rest|house|is said|are said|leaves over|left over|makes small"
    r"|neighbours?|ran away|reckon\w*|rooms?|run(?:s|ning)? away|sail(?:s|ed|ing)?|stands?|stood"
    r"|tells?|telling|told|by turns|waters?|whither|witness\w*)\b",
    re.IGNORECASE,
)


def definitions(tree):
    """Yield the names of functions and classes; properties are values."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            decorators = {
                getattr(name, "id", getattr(name, "attr", "")) for name in node.decorator_list
            }
            if not decorators & {"property", "cached_property"}:
                yield node.name


def variables(tree):
    """Yield the names that functions bind."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id


def strings(tree):
    """Yield docstrings and messages."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) > 15:
            yield node.value


@pytest.fixture(scope="module")
def trees():
    return [ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES]


def named(trees, names, words):
    """Return the names that are one of the words."""
    return [name for tree in trees for name in names(tree) if name.strip("_") in words]


def test_functions_and_classes_are_not_named_by_a_participle(trees):
    assert named(trees, definitions, PARTICIPLES | FILLERS) == []


def test_variables_are_not_named_by_a_filler_word(trees):
    assert named(trees, variables, FILLERS) == []


def test_constants_say_what_they_limit(trees):
    assert named(trees, variables, GENERIC) == []


def test_messages_and_docstrings_are_technical_english(trees):
    found = [word for tree in trees for text in strings(tree) for word in COLLOQUIAL.findall(text)]
    assert len(found) <= 12  # water and dead reckoning, meant literally


def test_pages_are_technical_english():
    texts = (re.sub(r"```.*?```", "", path.read_text("utf-8"), flags=re.DOTALL) for path in PAGES)
    found = [word for text in texts for word in COLLOQUIAL.findall(text)]
    assert len(found) <= 4  # water, meant literally
