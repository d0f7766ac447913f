from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

from typer.testing import Result

Call = Callable[..., Result]


def test_lists_the_catalogue_with_the_counts_of_table_1(call: Call) -> None:
    document = json.loads(call("models --json").stdout)
    listed = document["models"]
    counts = {model["model"]: model["n_coefficients"] for model in listed}
    assert list(counts.values()) == [216, 100, 88, 36, 33, 30, 24, 12, 36]
    assert "mcfarland-whitcomb  216" in call("models").stdout
    (selected,) = document["selected_from_a_log"]
    assert (selected["model"], selected["n_coefficients"]) == ("sparse", None)


def test_the_model_of_a_log_is_listed_and_explained(call: Call) -> None:
    assert re.search(r"^sparse[ -]+Selected from a log", call("models").stdout, re.MULTILINE)
    for line in ("models", "models sparse"):
        said = " ".join(call(line).stdout.split())
        assert "sparse` comes with a log" in said or "sparse comes with a log" in said
        assert "compare LOG ... --models sparse" in said
    assert json.loads(call("models sparse --json").stdout)["terms"] is None


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
    said = call("models two.yaml").stdout
    assert "`hydrodamp models two.yaml MODEL` shows the terms of one" in said
    assert "sparse" not in said


def test_shows_one_of_a_file(folder: Path, call: Call) -> None:
    (folder / "two.yaml").write_text(
        "models: [{name: first, terms: {X: u}}, {name: second, terms: {X: u*rpm}}]", "utf-8"
    )
    assert "u*rpm" in call("models two.yaml second").stdout
    assert json.loads(call("models two.yaml first --json").stdout)["model"] == "first"
    done = call("models two.yaml secnd")
    assert done.exit_code == 2
    assert "two.yaml: no model is called 'secnd'" in done.stderr
    assert "Did you mean 'second'?" in done.stderr
    done = call("models linear second")
    assert done.exit_code == 2
    assert "`linear` is a model of the catalogue, no file" in done.stderr


def test_an_unknown_name(call: Call) -> None:
    done = call("models prestreo")
    assert done.exit_code == 2
    assert "Did you mean 'prestero'?" in done.stderr
