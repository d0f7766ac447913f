"""A short re-enacted campaign, and what a live run makes of rows."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import pytest

import hydrodamp as hd
from hydrodamp.live.runner import LiveRun

MODEL = hd.catalog["prestero"]


@dataclass
class Heard:
    """What a run told."""

    lines: list = field(default_factory=list)
    sentences: list = field(default_factory=list)
    run: LiveRun | None = None

    @property
    def counts(self):
        return {name: n for name, n in self.lines[-1]["counts"].items() if n}

    @property
    def coefficients(self):
        return [one["value"] for one in self.lines[-1]["coefficients"].values()]


def heard(rows, vehicle, method="rls", model=MODEL, **settings):
    told = Heard()

    def tell(line):
        told.lines.append(json.loads(json.dumps(line, allow_nan=False)))

    told.run = LiveRun(vehicle, model, method, tell, told.sentences.append, **settings)
    told.run.process_rows(rows)
    return told


@pytest.fixture(scope="session")
def dive():
    """Four runs of 50 s, commands as recorded."""
    campaign = hd.reenact(seed=0, duration=50.0)
    return campaign.vehicle, campaign.train
