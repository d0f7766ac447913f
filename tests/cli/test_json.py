"""Standard output of ``--json`` has a format, a version and the schema of the package."""

import json
from importlib.resources import files

import jsonschema
import pytest

from table_rows import rows


@pytest.fixture(scope="module")
def validator():
    schema = files("hydrodamp.report").joinpath("results.schema.json").read_text("utf-8")
    jsonschema.Draft202012Validator.check_schema(json.loads(schema))
    return jsonschema.Draft202012Validator(json.loads(schema))


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@rows(("line", "file"))
def test_json_has_format_version_and_paths(folder, ask, validator, line, file):
    document = ask(line)
    validator.validate(document)
    assert document["format"].startswith("hydrodamp-")
    for path in document["paths"].values():
        assert (folder / path).exists() or path.endswith("report.html"), path
    if file:
        written = json.loads((folder / file).read_text("utf-8"))
        assert written == {key: each for key, each in document.items() if key != "paths"}
    if file == "out/comparison.json":
        page = ask("report out --force")
        validator.validate(page)
        assert page["verdict"] == document["verdict"]


def test_the_schema_refuses_an_unknown_light(validator):
    axes = {"u": {"light": "blue", "fit": 1.0, "standard_error": None, "reason": ""}}
    errors = [*validator.iter_errors({"format": "hydrodamp-report", "version": 1, "paths": {},
                                      "verdict": {"axes": axes}})]  # fmt: skip
    assert any("'blue' is not one of" in error.message for error in errors)
