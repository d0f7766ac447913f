"""A short campaign with its findings, drawn once."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

import hydrodamp as hd

pytest.importorskip("matplotlib", reason="pictures need the extra hydrodamp[report]")

from hydrodamp.report.files import ReportContent
from hydrodamp.report.pictures import illustrate


def draw(table, vehicle, train):
    """Return the pictures of a comparison of fits to training data."""
    return illustrate(table, hd.prepare(vehicle, train, [row.fit.model for row in table.rows]))


@dataclass(frozen=True)
class Examined:
    """A run and what was found of it."""

    vehicle: hd.Vehicle
    train: hd.Log
    table: hd.Comparison
    findings: ReportContent


@pytest.fixture(scope="session")
def examined(sailed):
    """Three models by two methods on runs of 20 s."""
    findings = draw(sailed.table, sailed.vehicle, sailed.train)
    return Examined(sailed.vehicle, sailed.train, sailed.table, findings)
