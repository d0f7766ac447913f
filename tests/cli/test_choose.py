"""Two models of one name would be one row and one file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.validation.sparse import Sparse

Call = Callable[..., Result]
LINE = "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls --models "


@pytest.mark.parametrize(
    ("key", "listed", "names"),
    [
        ("sparse", "sparse,mine.yaml", "'sparse'"),
        ("Sparse", "mine.yaml,sparse", "'Sparse' and 'sparse'"),
        ("Linear", "linear,mine.yaml", "'linear' and 'Linear'"),
        ("linear", "linear,mine.yaml", "'linear'"),
    ],
)
def test_two_models_of_one_name_are_refused(
    key: str, listed: str, names: str, folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "mine.yaml").write_text(f"name: {key}\nterms: {{X: [u], Y: [v]}}\n", "utf-8")
    monkeypatch.setattr(Sparse, "select", lambda *_: pytest.fail("selected for minutes"))
    done = call(LINE + listed)
    assert done.exit_code == 2, done.output
    words = f"two different models are called {names}: rename the one in your file."
    assert words in done.stderr


def test_a_model_of_ones_own_may_be_called_sparse(folder: Path, call: Call) -> None:
    (folder / "mine.yaml").write_text("name: sparse\nterms: {X: [u], Y: [v]}\n", "utf-8")
    done = call(f"{LINE}linear,mine.yaml")
    assert done.exit_code == 0, done.output
    assert "sparse" in done.stdout
