"""A season of short dives with a fin or two at work, fouled from one day on."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd

MODEL = hd.catalog["prestero"]


@dataclass(frozen=True)
class Fleet:
    """A vehicle, one log of it, and what its damping is."""

    vehicle: hd.Vehicle
    log: hd.Log
    truth: hd.Damping

    def dive(self, seed: int, drag: float = 1.0) -> hd.Log:
        """Sail the commands of the log again, with so many times its drag, and measure it."""
        damping = replace(self.truth, coefficients=drag * self.truth.coefficients)
        sailed = hd.simulate(self.vehicle, damping, self.log).velocity
        noise = np.random.default_rng(seed).standard_normal(sailed.shape)
        return replace(self.log, velocity=sailed + noise * [0.01, 0.01, 0.01, 0.001, 0.001, 0.001])

    def season(self, folder: Path, days: int, dives: int = 2, fouled: int | None = None) -> Path:
        """Write the dives of some days, with a fifth more drag from one of them on."""
        folder.mkdir(exist_ok=True)
        for day in range(days):
            drag = 1.2 if fouled is not None and day >= fouled else 1.0
            for dive in range(dives):
                name = f"auv_2026-05-{day + 1:02d}_dive{dive}.csv"
                hd.write_log(self.dive(100 * day + dive, drag), folder / name)
        return folder


@pytest.fixture(scope="session")
def fleet():
    """Four runs of 40 s; the truth is what the weak form makes of them."""
    campaign = hd.reenact(seed=0, duration=40.0)
    truth = hd.identify(MODEL, campaign.vehicle, campaign.exact_train, hd.WeakForm()).damping
    return Fleet(campaign.vehicle, campaign.train, truth)


@pytest.fixture(scope="session")
def threads():
    with ThreadPoolExecutor(2) as executor:
        yield executor


@pytest.fixture(scope="session")
def season(fleet, tmp_path_factory):
    """Three days of two dives each."""
    return fleet.season(tmp_path_factory.mktemp("season") / "logs", days=3)
