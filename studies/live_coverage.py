"""Measure how often intervals on board cover the truth: ``python studies/live_coverage.py``.

Every campaign of the benchmark whose water is a table of terms is identified with those terms,
sample by sample. A coefficient counts where it is told to be determined at the end of the training
log. Campaigns whose vehicle is told wrongly are listed apart.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import hydrodamp as hd
from benchmark_campaign import Campaign
from benchmark_campaigns import campaigns
from hydrodamp.live.estimator import estimate_line, start, update
from hydrodamp.live.samples import rows_of
from tables import replace_table

MISTOLD = ("wrench", "fins")
"""What the names of campaigns have in them whose vehicle is told wrongly."""

WRONG = "wrong vehicle data"

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "live" / "index.md"
"""Where the table stands, between these marks."""

MARKS = ("<!-- coverage -->", "<!-- end of coverage -->")

WIDTH = 1.959964
"""Standard errors from the middle of a 95 % interval to its ends."""


def misses(campaign: Campaign) -> np.ndarray:
    """Return the misses of determined coefficients at the end, in standard errors."""
    logs = campaign.logs
    assert logs.true is not None
    rows = rows_of(logs.train)
    model = logs.true.model.restricted_to(logs.vehicle.axes)
    first = next(rows)
    state, _ = update(start(logs.vehicle, model, "rls", first), first)
    for row in rows:
        state, _ = update(state, row)
    told = estimate_line(state)["coefficients"]
    return np.array(
        [
            (one["value"] - logs.true[label]) / one["standard_error"]
            for label, one in told.items()
            if one["grade"] == "determined" and one["standard_error"] is not None
        ]
    )


def table(found: Iterable[tuple[str, np.ndarray]]) -> str:
    """Return coverage by vehicle and altogether, as Markdown."""
    families: dict[str, list[np.ndarray]] = {}
    for name, one in found:
        wrong = any(word in name for word in MISTOLD)
        families.setdefault(WRONG if wrong else name.partition("/")[0], []).append(one)
    right = [one for name, some in families.items() if name != WRONG for one in some]
    lines = ["| vehicle | campaigns | determined | covered |", "|---|---|---|---|"]
    for name, some in (*families.items(), ("all with correct vehicle data", right)):
        joined = np.concatenate(some)
        covered = f"{100.0 * np.mean(np.abs(joined) < WIDTH):.0f} %"
        lines.append(f"| {name} | {len(some)} | {len(joined)} | {covered} |")
    return "\n".join(lines)


def main() -> None:
    """Measure, print, and put the table on its page."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    known = (campaign for campaign in campaigns() if campaign.logs.true is not None)
    text = table((campaign.name, misses(campaign)) for campaign in known)
    print(text)
    replace_table(PAGE, MARKS, text)


if __name__ == "__main__":
    main()
