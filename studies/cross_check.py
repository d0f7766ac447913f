"""Compare coefficients and standard errors with an implementation that shares no code.

    python studies/cross_check.py --out FOLDER --data DATA [--page PAGE]

``independent.py`` gets the training runs of the tanker as canonical CSV and gives equation error
and output error; the methods of this project are `ls` and `oe`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import hydrodamp as hd
from benchmark_campaigns import EXAMPLES, load_module
from benchmark_tables import table
from tables import replace_table

MARKS = "<!-- cross-check -->", "<!-- end of cross-check -->"
EXAMPLE = EXAMPLES / "kvlcc2"
METHODS = {"ls": "equation error", "oe": "output error"}
HEADER = "coefficient", "independent", "std. error", "hydrodamp", "std. error", "difference / error"


def main(
    out: Annotated[Path, typer.Option(help="Folder of the log and the independent results.")],
    data: Annotated[Path, typer.Option(help="Folder with kvlcc2_hsva.")],
    page: Annotated[Path | None, typer.Option(help="Page to insert the tables into.")] = None,
) -> None:
    """Run both and print the tables."""
    warnings.simplefilter("ignore", hd.HydrodampWarning)
    out.mkdir(parents=True, exist_ok=True)
    example = load_module(EXAMPLE / "compare.py")
    train, test = (
        example.read(data / "kvlcc2_hsva", *runs) for runs in (example.TRAIN, example.TEST)
    )
    vehicle = hd.read_vehicle(EXAMPLE / "vehicle.yaml")
    [model] = (each for each in hd.read_models(EXAMPLE / "models.yaml") if each.key == "tanker")
    hd.write_log(train, out / "train.csv")
    path = out / "independent.json"
    if not path.is_file():
        call = [
            sys.executable,
            str(Path(__file__).with_name("independent.py")),
            str(out / "train.csv"),
        ]
        path.write_text(subprocess.run(call, capture_output=True, text=True, check=True).stdout)
    theirs = json.loads(path.read_text("utf-8"))
    problem = hd.prepare(vehicle, train, model)
    parts = []
    for key, name in METHODS.items():
        fit = hd.find_method(key).identify(problem, model)
        known = fit.damping
        assert known.covariance is not None
        pairs = dict(zip(theirs["labels"], zip(*theirs[name], strict=True), strict=True))
        values = np.array([pairs[label] for label in model.labels]).T
        errors = np.sqrt(np.diag(known.covariance))
        columns = *values, known.coefficients, errors, (values[0] - known.coefficients) / errors
        rows = zip(model.labels, np.array(columns).T.tolist(), strict=True)
        body = [(f"`{label}`", *(f"{value:.3g}" for value in row)) for label, row in rows]
        independent = replace(fit, damping=replace(known, coefficients=values[0], covariance=None))
        shares = [
            ", ".join(
                f"{axis} {share:.0f}" for axis, share in row.score.fit_by_axis.items() if share
            )
            for row in hd.compare([independent, fit], vehicle, test).rows
        ]
        parts.append(
            f"## {name.capitalize()}, `{key}`\n\n{table(HEADER, body)}\n\nFit of the held-out "
            f"runs [%]: independent {shares[0]}; hydrodamp {shares[1]}."
        )
    text = "\n\n".join(parts)
    if page is not None:
        replace_table(page, MARKS, text)
    typer.echo(text)


if __name__ == "__main__":
    typer.run(main)
