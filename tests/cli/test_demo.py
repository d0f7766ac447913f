import functools
import json

import pytest

import hydrodamp as hd


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_our_table_stands_beside_the_papers(folder, call, monkeypatch):
    monkeypatch.setattr(hd, "reenact", functools.partial(hd.reenact, duration=5.0))
    monkeypatch.setattr("hydrodamp.cli.compare.DEMO_METHODS", "ls,ai")
    done = call("demo --out out --truth crossflow --seed 3 --json")
    document = json.loads(done.stdout)
    assert document.pop("paths")["damping"] == "out/damping.json"
    assert document == json.loads((folder / "out" / "comparison.json").read_text("utf-8"))
    assert len(document["rows"]) == 16
    assert document["provenance"]["truth"] == "crossflow"
    assert document["provenance"]["seed"] == "3"
    table = (folder / "out" / "table.md").read_text("utf-8")
    for word in ("paper LS", "never published", "not converged"):
        assert word in table

    monkeypatch.setattr("hydrodamp.cli.compare.DEMO_METHODS", "ls")
    shown = call("demo --truth crossflow --seed 3", 1).stdout
    for word in ("Truth 'crossflow'", "seed 3", "paper LS"):
        assert word in shown
