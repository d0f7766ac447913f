import functools
import json

import pytest

import hydrodamp as hd


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_our_table_stands_beside_the_papers(folder, call, monkeypatch):
    monkeypatch.setattr(hd, "reenact", functools.partial(hd.reenact, duration=5.0))
    monkeypatch.setattr("hydrodamp.cli.demo.DEMO_METHODS", "ls,ai")
    done = call("demo --out out --truth crossflow --seed 3 --json")
    document = json.loads(done.stdout)
    assert document.pop("paths")["damping"] == "out/damping.json"
    assert len(document["rows"]) == 16
    assert document["provenance"]["truth"] == "crossflow"
    assert document["provenance"]["seed"] == "3"
    table = (folder / "out" / "table.md").read_text("utf-8")
    for word in ("paper LS", "never published", "not converged"):
        assert word in table

    monkeypatch.setattr("hydrodamp.cli.demo.DEMO_METHODS", "ls")
    shown = call("demo --truth crossflow --seed 3", 1).stdout
    for word in ("Truth 'crossflow'", "seed 3", "paper LS"):
        assert word in shown


@pytest.mark.slow
def test_the_measured_log_of_the_package_is_compared(call, monkeypatch):
    monkeypatch.setattr("hydrodamp.cli.demo.MEASURED_MODELS", "general")
    monkeypatch.setattr("hydrodamp.cli.demo.MEASURED_METHODS", "oe")
    (row,) = json.loads(call("demo --measured --json").stdout)["rows"]
    assert all(row["fit_by_axis"][name] > 70.0 for name in "uvr")
    assert call("demo --measured --seed 3", 2).stdout == ""
