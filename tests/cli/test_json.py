"""Standard output of ``--json`` has a format, a version and the schema of the package."""

import json
from importlib.resources import files

import jsonschema
import pytest

CALLS = {
    "compare": "compare ab.csv --vehicle planar.yaml --train one --test two --models linear "
    "--methods ls --out out",
    "folds": "compare ab.csv --folds 2 --vehicle planar.yaml --models linear --methods ls "
    "--out out",
    "identify": "identify a.csv --train 0:30 --vehicle planar.yaml --model linear --method weak "
    "--out d.json",
    "convert": "convert ab.csv --out c.csv",
    "batch": "batch a.csv b.csv --vehicle planar.yaml --model linear --group-by folder "
    "--out season",
}


@pytest.fixture(scope="module")
def validator():
    schema = files("hydrodamp.report").joinpath("results.schema.json").read_text("utf-8")
    jsonschema.Draft202012Validator.check_schema(json.loads(schema))
    return jsonschema.Draft202012Validator(json.loads(schema))


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("name", CALLS)
def test_json_has_format_version_and_paths(folder, call, validator, name):
    document = json.loads(call(f"{CALLS[name]} --json").stdout)
    validator.validate(document)
    assert document["format"].startswith("hydrodamp-")
    name_of_file = {"compare": "out/comparison.json", "folds": "out/validation.json"}
    if name in {**name_of_file, "identify": ""}:
        text = (folder / name_of_file.get(name, "d.json")).read_text("utf-8")
        assert json.loads(text) == {key: each for key, each in document.items() if key != "paths"}
    for path in document["paths"].values():
        assert (folder / path).exists() or path.endswith("report.html"), path
    if name == "compare":
        page = json.loads(call("report out --force --json").stdout)
        validator.validate(page)
        assert page["verdict"] == document["verdict"]


def test_the_schema_refuses_an_unknown_light(validator):
    axes = {"u": {"light": "blue", "fit": 1.0, "standard_error": None, "reason": ""}}
    errors = [*validator.iter_errors({"format": "hydrodamp-report", "version": 1, "paths": {},
                                      "verdict": {"axes": axes}})]  # fmt: skip
    assert any("'blue' is not one of" in error.message for error in errors)
