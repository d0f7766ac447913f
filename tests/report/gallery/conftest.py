"""A short campaign with its findings, drawn once."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

import hydrodamp as hd

pytest.importorskip("matplotlib", reason="pictures need the extra hydrodamp[report]")

from hydrodamp.report.gallery.examine import examine
from hydrodamp.report.gallery.findings import Findings


@dataclass(frozen=True)
class Examined:
    """A run and what was found of it."""

    vehicle: hd.Vehicle
    train: hd.Log
    table: hd.Comparison
    findings: Findings


@pytest.fixture(scope="session")
def examined() -> Examined:
    """Two models by two methods on runs of 20 s."""
    campaign = hd.reenact(seed=0, duration=20.0)
    models = tuple(hd.catalog[key] for key in ("linear", "fossen"))
    problem = hd.prepare(campaign.vehicle, campaign.train, models)
    fits = [
        fit
        for key in ("weak", "ai")
        for fit in hd.identify_all(problem, models, hd.find_method(key))
    ]
    table = hd.compare(fits, campaign.vehicle, campaign.test)
    findings = examine(table, campaign.vehicle, campaign.train)
    return Examined(campaign.vehicle, campaign.train, table, findings)
