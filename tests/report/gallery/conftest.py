"""A short campaign with its findings, drawn once."""

from __future__ import annotations

import pytest

import hydrodamp as hd

pytest.importorskip("matplotlib", reason="pictures need the extra hydrodamp[report]")

from hydrodamp.report.pictures import illustrate


def draw(table, vehicle, train):
    """Return the pictures of a comparison of fits to training data."""
    return illustrate(table, hd.prepare(vehicle, train, [row.fit.model for row in table.rows]))


@pytest.fixture(scope="session")
def findings(sailed):
    """What is drawn of that campaign."""
    return draw(sailed.table, sailed.vehicle, sailed.train)
