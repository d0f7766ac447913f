import json
import re

import hydrodamp as hd


def test_lists_the_catalogue_with_its_counts(call):
    document = json.loads(call("list models --json").stdout)
    listed = document["models"]
    counts = {model["model"]: model["n_coefficients"] for model in listed}
    assert counts == {key: model.n_coefficients for key, model in hd.catalog.items()}
    assert list(counts) == list(hd.catalog)
    assert "mcfarland-whitcomb  216" in call("list models").stdout
    of_log = {each["model"]: each["n_coefficients"] for each in document["made_from_a_log"]}
    assert of_log == {"general": None, "sparse": None}


def test_the_model_of_a_log_is_listed_and_explained(call):
    assert re.search(r"^sparse[ -]+Selected from a log", call("list models").stdout, re.MULTILINE)
    for line in ("list models", "list models sparse"):
        said = " ".join(call(line).stdout.split())
        assert "sparse: stepwise selection of terms" in said
        assert "--models sparse` of `compare`" in said
    assert json.loads(call("list models sparse --json").stdout)["terms"] is None


def test_shows_one_with_terms_source_and_note(call):
    done = call("list models coe")
    for word in ("X Z M", "w|w|", "source:", "note:"):
        assert word in done.stdout
    assert json.loads(call("list models coe --json").stdout)["terms"]["K"] == [
        "v|v|",
        "p|p|",
        "r|r|",
    ]


def test_shows_those_of_a_file_or_one_of_them(folder, call):
    (folder / "two.yaml").write_text(
        "models: [{name: a, terms: {X: u}}, {name: b, terms: {X: u*rpm}}]", "utf-8"
    )
    document = json.loads(call("list models two.yaml --json").stdout)
    assert [model["commands"] for model in document["models"]] == [[], ["rpm"]]
    said = call("list models two.yaml").stdout
    assert "`hydrodamp list models two.yaml:NAME` shows the terms of a model" in said
    assert "sparse" not in said
    assert "u*rpm" in call("list models two.yaml:b").stdout
    assert json.loads(call("list models two.yaml:a --json").stdout)["model"] == "a"


def test_a_model_of_a_file_goes_by_its_name(folder, call):
    (folder / "two.yaml").write_text(
        "models: [{name: heavy, terms: {X: u|u|}}, {name: light, terms: {X: u}}]", "utf-8"
    )
    line = "compare ab.csv --vehicle planar.yaml --train one --test two --methods ls --json"
    document = json.loads(call(f"{line} --models linear,two.yaml:light").stdout)
    assert [row["model"] for row in document["rows"]] == ["linear", "light"]
    assert "two.yaml" in document["provenance"]["files"]
    one = call("identify a.csv --vehicle planar.yaml --method ls --json --model two.yaml:heavy")
    assert set(json.loads(one.stdout)["coefficients"]) == {"X_u|u|"}
