from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from typer.testing import Result

Call = Callable[..., Result]


def test_lists_the_catalogue_with_the_counts_of_table_1(call: Call) -> None:
    listed = json.loads(call("models --json").stdout)["models"]
    counts = {model["model"]: model["n_coefficients"] for model in listed}
    assert list(counts.values()) == [216, 100, 88, 36, 33, 30, 24, 12, 36]
    assert "mcfarland-whitcomb  216" in call("models").stdout


def test_shows_one_with_terms_source_and_note(call: Call) -> None:
    done = call("models coe")
    assert done.exit_code == 0
    for word in ("X Z M", "w|w|", "Source:", "Note:"):
        assert word in done.stdout
    assert json.loads(call("models coe --json").stdout)["terms"]["K"] == ["v|v|", "p|p|", "r|r|"]


def test_shows_those_of_a_file(folder: Path, call: Call) -> None:
    (folder / "two.yaml").write_text(
        "models: [{name: a, terms: {X: u}}, {name: b, terms: {X: u*rpm}}]", "utf-8"
    )
    listed = json.loads(call("models two.yaml --json").stdout)["models"]
    assert [model["commands"] for model in listed] == [[], ["rpm"]]


def test_an_unknown_name(call: Call) -> None:
    done = call("models prestreo")
    assert done.exit_code == 2
    assert "Did you mean 'prestero'?" in done.stderr
