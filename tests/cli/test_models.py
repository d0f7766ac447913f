import json

import pytest

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


@pytest.mark.slow
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
