"""Which data are in both parts is said, whatever names they were given by."""

import json

import pytest

from table_rows import rows

pytestmark = pytest.mark.usefixtures("undrawn")
LINE = "compare --vehicle planar.yaml --models linear --methods ls"


@pytest.mark.slow
@rows(("parts", "shared"))
def test_shared_data_are_warned_of_and_written_down(folder, call, parts, shared):
    done = call(f"{LINE} {parts} --out out")
    said = f"Training and test data share {shared}:" if shared else "data share"
    if shared == "all test data":
        said = "Errors are those of the training data"
    assert (f"warning: {said}" in done.stderr) == bool(shared)
    assert (said[1:] in " ".join(done.stdout.split())) == bool(shared)
    document = json.loads((folder / "out" / "comparison.json").read_text("utf-8"))
    assert document["provenance"].get("overlap", "") == shared
    assert (said[1:] in (folder / "out" / "table.md").read_text("utf-8")) == bool(shared)
