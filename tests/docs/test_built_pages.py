"""The pages as published: each page, formula, public name, command and model is there."""

import io
import re
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest

import hydrodamp as hd
from chromium import needs_chromium, open_chromium
from hydrodamp.basis.term import AXES
from hydrodamp.data.channels import RESERVED

pytestmark = pytest.mark.slow

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The HTML pages, with their notebooks run, and the warnings of the build."""
    pytest.importorskip("sphinx", reason="the pages need the extra hydrodamp[docs]")
    from sphinx.application import Sphinx
    from sphinx.util.docutils import docutils_namespace, patch_docutils

    out, log = tmp_path_factory.mktemp("docs"), io.StringIO()
    with warnings.catch_warnings(), patch_docutils(str(DOCS)), docutils_namespace():
        warnings.simplefilter("ignore")  # of the tools; what they report of a page is in `log`
        # One process: with several, the build returns 0 although a page failed.
        app = Sphinx(DOCS, DOCS, out, out / "doctrees", "html", status=None, warning=log)
        app.build()
    standard = app.env.domains["std"]
    return SimpleNamespace(
        folder=out,
        pages={name: out / f"{name}.html" for name in app.env.found_docs},
        names=set(app.env.domains["py"].objects),
        options=set(standard.progoptions),
        labels=set(standard.labels),
        log=log.getvalue(),
    )


def test_every_source_has_its_page_and_no_warning(built):
    sources = {
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in DOCS.rglob("*.md")
        if not {"_build", "jupyter_execute"} & {*path.parts}
    }
    assert built.log == ""
    assert sources <= built.pages.keys()
    assert not [name for name, page in built.pages.items() if not page.is_file()]


@needs_chromium
def test_every_formula_is_rendered(built):
    missing = ".math:not(:has(mjx-container)), .math mjx-merror"
    wrong, n_formulas = {}, 0
    with open_chromium() as browser:
        page = browser.new_page()
        for name, path in built.pages.items():
            page.goto(path.as_uri())
            if page.locator(".math").count():
                page.wait_for_function("window.MathJax?.startup?.promise")
                page.evaluate("MathJax.startup.promise")
                n_formulas += page.locator(".math mjx-container").count()
                wrong |= {name: texts} if (texts := page.locator(missing).all_inner_texts()) else {}
    assert n_formulas
    assert not wrong


def test_every_public_name_is_documented(built):
    left_out = {f"hydrodamp.{name}" for name in hd.__all__} - built.names
    assert not left_out


def test_every_command_and_every_option_is_documented(built):
    import typer

    from hydrodamp.cli.main import app

    wanted = {
        (name.replace(" ", "-"), option)
        for name, command in leaves(typer.main.get_command(app), "hydrodamp")
        for one in command.params
        for option in one.opts[:1]
        if option.startswith("--")
    }
    assert wanted
    assert not wanted - built.options


def leaves(command, name):
    inside = getattr(command, "commands", None)
    if inside is None:
        return [(name, command)]
    return [leaf for key, one in inside.items() for leaf in leaves(one, f"{name} {key}")]


def test_every_model_is_documented(built):
    assert not {f"model-{key}" for key in hd.catalog} - built.labels


def test_every_method_has_a_line_in_how_to_choose_one():
    page = (DOCS / "how-to/choose-a-method.md").read_text(encoding="utf-8")
    assert not [key for key in hd.METHODS if f"`{key}`" not in page]


def test_every_symbol_and_column_is_in_the_nomenclature():
    page = (DOCS / "reference/nomenclature.md").read_text(encoding="utf-8")
    assert not [word for word in (*AXES, *RESERVED) if not re.search(rf"\b{word}\b", page)]
