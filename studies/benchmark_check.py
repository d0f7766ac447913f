"""Check that the campaigns of the benchmark are sane: ``python studies/benchmark_check.py``.

A line a campaign: how it is sampled, how far its vehicle goes, and two floors. ``exact`` is the
error of a replay of what really happened, by the true coefficients where the water is a table of
terms, attitude simulated, and otherwise, starting again every second, by the wrench that the exact
accelerations ask for, straight from sample to sample; ``noisy`` is that of the true coefficients on
the test log that methods are scored on.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from typing import Annotated

import numpy as np
import typer

import hydrodamp as hd
from benchmark_campaign import Campaign, Logs
from benchmark_campaigns import campaigns
from benchmark_tables import table
from hydrodamp.kernels.core import coriolis
from hydrodamp.simulation.replay import AttitudeSource, Horizon, horizon_scores


@dataclass(frozen=True)
class Sanity:
    """What a campaign is like; speeds [m/s], angles [deg] and rates [deg/s] at their largest."""

    campaign: str
    samples: int
    rate: float
    speeds: tuple[float, float, float]
    rates: tuple[float, float, float]
    roll: float
    pitch: float
    exact: float | None
    noisy: float | None

    @classmethod
    def of(cls, campaign: Campaign) -> Sanity:
        """Return what a campaign is like."""
        train, test = campaign.train, campaign.test
        largest = np.max(np.abs(np.vstack((train.velocity, test.velocity))), axis=0)
        largest[3:] = np.degrees(largest[3:])
        down = np.vstack((train.down, test.down))
        return cls(
            campaign=campaign.name,
            samples=train.n,
            rate=float(1.0 / np.median(np.diff(train.time))),
            speeds=tuple(largest[:3].tolist()),
            rates=tuple(largest[3:].tolist()),
            roll=float(np.degrees(np.max(np.abs(np.arctan2(down[:, 1], down[:, 2]))))),
            pitch=float(np.degrees(np.max(np.abs(np.arcsin(np.clip(down[:, 0], -1, 1)))))),
            exact=exact_floor(campaign.logs),
            noisy=noisy_floor(campaign.logs),
        )

    @property
    def cells(self) -> tuple[str, ...]:
        """The line of a table."""
        three = (" ".join(f"{one:.2g}" for one in some) for some in (self.speeds, self.rates))
        floors = ("" if one is None else f"{one:.2g}" for one in (self.exact, self.noisy))
        size = (f"`{self.campaign}`", str(self.samples), f"{self.rate:.3g}")
        return (*size, *three, f"{self.roll:.0f}", f"{self.pitch:.0f}", *floors)


HEAD = (
    *("campaign", "samples", "rate [Hz]", "u v w [m/s]", "p q r [deg/s]"),
    *("roll [deg]", "pitch [deg]", "exact", "noisy"),
)


def exact_floor(logs: Logs) -> float | None:
    """Return the error of a replay of what really happened."""
    exact, body = logs.exact, logs.body
    if exact is None or body is None:
        return None
    if logs.true is not None:
        return _error(body, logs.true, exact, attitude="simulated")
    assert exact.acceleration is not None
    mass = np.nan_to_num(body.mass_matrix)
    wrench = exact.acceleration @ mass - coriolis(mass, exact.velocity)
    wrench -= body.restoring_wrench(exact.down)
    log = replace(exact, wrench=wrench, command_names=(), commands=np.empty((exact.n, 0)))
    nothing = hd.Damping(hd.DampingModel.from_table({"X": "u"}, key="nothing"), np.zeros(1))
    return _error(replace(body, actuators=()), nothing, log, 1.0)


def noisy_floor(logs: Logs) -> float | None:
    """Return the error of the true coefficients on the test log."""
    if logs.true is None or logs.body is None or logs.test.wrench is not None:
        return None
    return _error(logs.body, logs.true, logs.test)


def _error(
    vehicle: hd.Vehicle,
    damping: hd.Damping,
    log: hd.Log,
    horizon: Horizon = "run",
    attitude: AttitudeSource = "measured",
) -> float | None:
    found = horizon_scores(vehicle, damping, log, [horizon], attitude=attitude)
    return found[0].score.rms


def main(pattern: Annotated[str, typer.Argument(help="Names of campaigns.")] = "*") -> None:
    """Print a line a campaign."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    found = (Sanity.of(one) for one in campaigns() if fnmatch(one.name, pattern))
    print(table(HEAD, (one.cells for one in found)))


if __name__ == "__main__":
    typer.run(main)
