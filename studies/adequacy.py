"""Count the forms of models that the default judges right, where the truth is known.

    python studies/adequacy.py --out FOLDER [--draws N] [--page PAGE]

Logs are those of the slender hull and of the ROV of the study of coverage, of 45 s and 120 s runs,
with and without pushes. From each, the true form is identified and a wrong one, which lacks one or
three random terms whose true coefficient is at least ``MIN_SIZE`` standard deviations of the
Cramér-Rao bound. Campaigns of the benchmark are other hulls, and those that no model explains.
Right is *adequate* for the true form, anything else for another. Finished rows stand in
``FOLDER/rows.jsonl`` and are not computed again.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

import hydrodamp as hd
from benchmark_campaign import Logs
from benchmark_campaigns import ROV, SEEN, models_of, tether
from benchmark_tables import table
from conditions import COLOURED
from consistency import MODEL, bound_covariance, true_coefficients
from hydrodamp.files import save_text
from hydrodamp.identification.adequacy import Form
from hydrodamp.simulation.campaign.reenact import Campaign, CampaignSetup
from tables import finish_jobs, replace_table

MARKS = ("<!-- adequacy -->", "<!-- end of adequacy -->")
"""Marks of the page between which the tables stand."""

DURATIONS, LEVELS = (45.0, 120.0), (0.0, 1.0)
"""Durations of a run [s]; pushes in published ones."""

FIRST_SEED = 9000
"""Seed of the first draw."""

MIN_SIZE, N_MISSING = 2.0, (1, 3)
"""Least true coefficient of a missing term over its bound; missing terms of even and odd draws."""

SIZES = (2.0, 5.0, 10.0, np.inf)
"""Edges of the classes of missing terms."""

TRUE_FORM, LACKS_ONE, LACKS_THREE, OUTSIDE = "true", "lacks one", "lacks three", "outside"

OTHER_HULLS = (
    "sname2022/60s/3x",
    "sname2022/80s/coloured-pushed",
    "remus/60s/0.3x",
    "remus/90s/coloured-pushed",
    "remus-theory/60s/2x",
)
"""Campaigns of the benchmark whose truth is a table of terms."""

NO_MODEL = (
    "crossflow/60s/3x",
    "crossflow/80s/coloured-pushed",
    "crossflow/100s/2x/coloured-pushed",
    "drifting/60s/2x",
    "lag-0.3s/80s/coloured-pushed",
    "lag-0.12s/110s/5Hz",
    "tanker/100s/3x/accelerations",
    "tanker/150s/coloured-pushed",
)
"""Campaigns of the benchmark that no model explains: strips in crossflow, lags, a ship."""

WRONG_MODELS = ("prestero", "gertler-hagen", "tanker", "fossen+rp")
"""Models that are identified from them."""


class Row(NamedTuple):
    """What the default says of a form."""

    hull: str
    duration: float
    push: float
    draw: int
    model: str
    form: str
    missing: Sequence[str]
    size: float
    result: str
    axes: Sequence[str]
    terms: Sequence[str]

    @property
    def is_right(self) -> bool:
        """Whether the result is that of the form."""
        is_adequate = self.result == Form.ADEQUATE.word
        is_judged = self.result not in ("none", "failed")
        return is_judged and is_adequate == (self.form == TRUE_FORM)


def drop_terms(model: hd.DampingModel, labels: Sequence[str]) -> hd.DampingModel:
    """Return a model without some terms."""
    is_kept = iter([label not in labels for label in model.labels])
    terms = tuple(tuple(term for term in row if next(is_kept)) for row in model.terms)
    return replace(model, terms=terms)


def judge(problem: hd.Problem, model: hd.DampingModel) -> tuple[str, list[str], list[str]]:
    """Return the form, the axes that lack terms and the terms that are suggested."""
    try:
        adequacy = hd.find_method("recommended").identify(problem, model).adequacy
    except np.linalg.LinAlgError:
        return "failed", [], []
    if adequacy is None:
        return "none", [], []
    named = {axis: test.terms for axis, test in adequacy.tests.items() if test.terms}
    return adequacy.form.word, list(named), [label for terms in named.values() for label in terms]


def simulate(hull: str, duration: float, level: float, draw: int) -> Iterator[Row]:
    """Yield the rows of a log: the true form and a wrong one."""
    if hull == "slender":
        conditions = COLOURED.push_times(level)
        setup = CampaignSetup.of("sname")
        logs: Campaign | Logs = setup.simulate([FIRST_SEED + draw], duration, conditions)[0]
        model, truth = MODEL, true_coefficients()
    else:
        conditions = tether(1.0, coloured=True).push_times(level)
        tethered = ROV(FIRST_SEED + draw, duration, conditions)()
        assert tethered.true is not None
        logs, model, truth = tethered, tethered.true.model, tethered.true.coefficients
    problem = hd.prepare(logs.vehicle, replace(logs.train, acceleration=None), [model])
    bound = np.sqrt(np.diag(bound_covariance(problem, model, truth, conditions)))
    sizes = dict(zip(model.labels, np.abs(truth) / bound, strict=True))
    large = [label for label, size in sizes.items() if size >= MIN_SIZE]
    n_missing = N_MISSING[draw % 2]
    random = np.random.default_rng([draw, int(duration), int(level)])
    missing = random.choice(large, n_missing, replace=False).tolist()
    least = min(sizes[label] for label in missing)
    log = hull, duration, level, draw, model.key
    yield Row(*log, TRUE_FORM, [], 0.0, *judge(problem, model))
    form = LACKS_ONE if n_missing == 1 else LACKS_THREE
    yield Row(*log, form, missing, least, *judge(problem, drop_terms(model, missing)))


def sail(name: str) -> Iterator[Row]:
    """Yield the rows of a campaign of the benchmark."""
    logs = SEEN[name]()
    models = [model for model in models_of(name) if model.key in WRONG_MODELS]
    for model in [logs.true.model] if logs.true else models:
        problem = hd.prepare(logs.vehicle, replace(logs.train, acceleration=None), [model])
        form = TRUE_FORM if logs.true else OUTSIDE
        yield Row(name, 0.0, 0.0, 0, model.key, form, [], 0.0, *judge(problem, model))


def right_table(rows: Sequence[Row]) -> str:
    """Return the share of right results by group."""
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        hull, push = (row.hull, f"{row.push:g}") if row.duration else ("benchmark", "")
        groups.setdefault((hull, row.form, push), []).append(row)
    groups["all", "", ""] = list(rows)
    lines = []
    for group, some in sorted(groups.items()):
        results = [row.result for row in some]
        right = f"{100 * np.mean([row.is_right for row in some]):.0f}"
        lines.append(
            [*group, str(len(some)), right, *(str(results.count(form.word)) for form in Form)]
        )
    return table(["hull", "form", "pushes", "fits", "right [%]", *(f.word for f in Form)], lines)


def missing_table(rows: Sequence[Row]) -> str:
    """Return what is found where one term is missing, by its size."""
    lines = []
    for low, high in itertools.pairwise(SIZES):
        some = [row for row in rows if row.form == LACKS_ONE and low <= row.size < high]
        axes = [row.missing[0][0] for row in some]
        counts = (
            len(some),
            sum(row.is_right for row in some),
            sum(axis in row.axes for axis, row in zip(axes, some, strict=True)),
            sum([axis] == list(row.axes) for axis, row in zip(axes, some, strict=True)),
            sum(row.missing[0] in row.terms for row in some),
        )
        lines.append([f"{low:g} to {high:g}", *map(str, counts)])
    head = ["size", "fits", "right", "axis is named", "axis is named alone", "term is named"]
    return table(head, lines)


def wrong_table(rows: Sequence[Row]) -> str:
    """Return the fits that are judged wrong."""
    lines = []
    for row in rows:
        if not row.is_right:
            said = " ".join([row.result, *row.axes, *row.terms])
            missing = " ".join(row.missing)
            cells = [row.hull, f"{row.duration:g}", f"{row.push:g}", row.model, row.form]
            cells += [missing, f"{row.size:.1f}", said]
            lines.append([cell.replace("|", r"\|") for cell in cells])
    return table(["log", "run [s]", "pushes", "model", "form", "missing", "size", "result"], lines)


def summarise(rows: Sequence[Row]) -> str:
    """Return all tables."""
    parts = {
        "Forms that are judged right": right_table(rows),
        "One missing term, by its coefficient over the bound": missing_table(rows),
        "Fits that are judged wrong": wrong_table(rows),
    }
    return "\n\n".join(f"**{title}**\n\n{text}" for title, text in parts.items())


def main(
    out: Annotated[Path, typer.Option(help="Folder of the rows.")],
    draws: Annotated[int, typer.Option(min=1, help="Draws of each simulated log.")] = 4,
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run what is missing and print the tables."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    logs = itertools.product(range(draws), DURATIONS, ("slender", "ROV"), LEVELS)
    jobs = {name: partial(sail, name) for name in (*OTHER_HULLS, *NO_MODEL)} | {
        f"{hull}/{duration:g}s/{level:g}/{draw}": partial(simulate, hull, duration, level, draw)
        for draw, duration, hull, level in logs
    }
    text = summarise(finish_jobs(out / "rows.jsonl", jobs, Row))
    save_text(text, out / "adequacy.md")
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
