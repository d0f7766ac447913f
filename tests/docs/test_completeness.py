"""Nothing is left out: every public name, every command and every model has its place."""

import io
import re
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest

import hydrodamp as hd
from hydrodamp.data.channels import RESERVED

pytestmark = pytest.mark.slow

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The environment of a build that writes no page and runs no notebook, and its warnings."""
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_nb")
    from sphinx.application import Sphinx
    from sphinx.util.docutils import docutils_namespace, patch_docutils

    out, said = tmp_path_factory.mktemp("docs"), io.StringIO()
    settings = {"nb_execution_mode": "off"}
    with warnings.catch_warnings(), patch_docutils(str(DOCS)), docutils_namespace():
        warnings.simplefilter("ignore")  # of the tools; what they say of a page is in `said`
        app = Sphinx(
            DOCS, DOCS, out, out / "doctrees", "dummy", settings, status=None, warning=said
        )
        app.build()
    names = set(app.env.domains["py"].objects)
    standard = app.env.domains["std"]
    return SimpleNamespace(
        names=names,
        options=set(standard.progoptions),
        labels=set(standard.labels),
        said=said.getvalue(),
    )


def test_the_pages_build_without_a_warning(built):
    assert built.said == ""


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
    assert not [word for word in (*hd.AXES, *RESERVED) if not re.search(rf"\b{word}\b", page)]
