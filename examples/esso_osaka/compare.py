"""Replay held-out runs of a tanker model on a pond: ``python compare.py DATA``.

DATA is the folder with the runs. Models are identified on the training set TZRB+ of Wakita et al.
(2022), doi 10.1007/s00773-021-00867-1, and replay its test set TZRB whole, open loop, from the
first sample; both without their berthing tests.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import hydrodamp as hd
from hydrodamp.cli.output import print_results
from hydrodamp.errors import FileError
from hydrodamp.report.comparison_tables import summary_tables

HERE = Path(__file__).parent
SOURCE = "github.com/NAOE-5thLab/FRT-DS-ESSO, commit e694dfd, CC BY-NC 4.0"
KINDS = ("random", "turn", "zigzag")
TEST = ("random_06-Aug-2020_16_24_25_3", "turn_14-Oct-2020_15_06_53", "zigzag_31-Jul-2020_13_42_53")
METHODS = "weak,oe,recommended"


def read(paths: list[Path]) -> hd.Log:
    """Return runs as one log, a segment each, with the commands of models.yaml."""
    log = hd.read_logs(paths, HERE / "mapping.yaml")
    names = ("propeller", "rudder", "wind_u", "wind_v")
    revolutions, rudder, wind_u, wind_v = (log.command(name) for name in names)
    commands = {
        "ahead": np.maximum(revolutions, 0.0),
        "astern": np.minimum(revolutions, 0.0),
        "fin": np.sin(rudder),
        "wind_x": -wind_u,
        "wind_y": -wind_v,
        "wind": np.hypot(wind_u, wind_v),
    }
    columns = np.column_stack(list(commands.values()))
    return replace(log, command_names=tuple(commands), commands=columns)


def split(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the training and the test runs; raise if a test run is absent."""
    test = [folder / f"{name}.csv" for name in TEST]
    if absent := [path.name for path in test if not path.is_file()]:
        raise FileError(f"{folder}: no file {', '.join(absent)}")
    runs = sorted(path for kind in KINDS for path in folder.glob(f"{kind}_*.csv"))
    return [path for path in runs if path not in test], test


def main(arguments: list[str] | None = None) -> int:
    """Identify, replay and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the runs")
    parser.add_argument("--out", type=Path, help="folder for comparison.json, tables and fits")
    parser.add_argument("--methods", default=METHODS, help=f"with commas; default {METHODS}")
    asked = parser.parse_args(arguments)
    nested = asked.data / "esso_osaka"
    try:
        compare(nested if nested.is_dir() else asked.data, asked.methods.split(","), asked.out)
    except hd.HydrodampError as error:
        print(f"error: {error}\nThe runs are at {SOURCE}.", file=sys.stderr)
        return 2
    return 0


def compare(folder: Path, methods: list[str], out: Path | None) -> None:
    """Print the errors on all held-out runs together, and on each."""
    vehicle, models = hd.read_vehicle(HERE / "vehicle.yaml"), hd.read_models(HERE / "models.yaml")
    train, test = split(folder)
    print(f"Data: {SOURCE}.\nTrained on {len(train)} runs, {len(test)} held out, whole.")
    problem = hd.prepare(vehicle, read(train), models)
    fits = [fit for key in methods for fit in hd.identify_all(problem, models, hd.find_method(key))]
    table = hd.compare(fits, vehicle, read(test))
    print_results(*summary_tables(table))
    for path in test:
        print(f"\n{path.stem}, 100 (1 - rmse/std) in %:")
        for row in hd.compare(fits, vehicle, read([path])).rows:
            shares = ((axis, share) for axis, share in row.score.fit_by_axis.items())
            percent = " ".join(f"{axis} {share:.0f}" for axis, share in shares if share is not None)
            print(f"{row.fit.method:12} {row.fit.model.key:12} {percent}")
    if out:
        hd.write_comparison(table, out)


if __name__ == "__main__":
    raise SystemExit(main())
