"""Compare damping models on measured runs of a BlueROV2: ``python compare.py DATA``.

DATA is the folder with run_11_10_52.csv and its three siblings. They are public but not ours to
pass on (no licence is stated): github.com/SAABmarine-MEX/saabmarineMEX_learning, commit dda3f3d.
Two runs are for identification, the other two are replayed whole, open loop, from their first
sample. README.md says how models and methods were chosen, and how often the test was seen.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import hydrodamp as hd
from hydrodamp.cli.output import print_results
from hydrodamp.errors import PropulsionWarning
from hydrodamp.report.comparison_tables import detail_tables, summary_tables

HERE = Path(__file__).parent
TRAIN, TEST = ("run_11_40_38", "run_11_57_50"), ("run_11_10_52", "run_11_46_03")
CHOSEN = ("tank", "ls")
SOURCE = "github.com/SAABmarine-MEX/saabmarineMEX_learning, commit dda3f3d, no licence stated"


def fits(models: tuple[hd.DampingModel, ...], vehicle: hd.Vehicle, train: hd.Log) -> list[hd.Fit]:
    """Return every model by every method, under the keys of the table."""
    problem = hd.prepare(vehicle, train, models)
    ways = (
        *((key, hd.find_method(key)) for key in ("ls", "ai", "ai-composite")),
        ("ls-smoothed", hd.LeastSquares(hd.SavitzkyGolay())),
    )
    return [
        replace(fit, method=key)
        for key, method in ways
        for fit in hd.identify_all(problem, models, method)
    ]


def main(arguments: list[str] | None = None) -> int:
    """Compare, print and, if asked to, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the four runs")
    parser.add_argument("--out", type=Path, help="folder for comparison.json, tables and fits")
    parser.add_argument("--attitude", choices=("measured", "simulated"), default="measured")
    asked = parser.parse_args(arguments)
    warnings.simplefilter("ignore", PropulsionWarning)  # models.yaml says it of gertler-hagen
    try:
        nested = asked.data / "bluerov2_kth"
        folder = nested if nested.is_dir() else asked.data
        runs = {name: folder / f"{name}.csv" for name in TRAIN + TEST}
        vehicle = hd.read_vehicle(HERE / "vehicle.yaml")
        models = hd.read_models(HERE / "models.yaml")
        train = hd.read_logs([runs[name] for name in TRAIN], HERE / "mapping.yaml")
        test = hd.read_logs([runs[name] for name in TEST], HERE / "mapping.yaml")
        table = hd.compare(fits(models, vehicle, train), vehicle, test, attitude=asked.attitude)
        if asked.out:
            hd.write_comparison(table, asked.out)
    except hd.HydrodampError as error:
        print(f"error: {error}\nThe runs are at {SOURCE}.", file=sys.stderr)
        return 2
    print(f"Data: {SOURCE}.\nTrained on {', '.join(TRAIN)}; tested on {', '.join(TEST)}, whole.\n")
    print_results(*detail_tables(table), *summary_tables(table))
    shares = table.row(*CHOSEN).score.fit_by_axis.items()
    words = ", ".join(f"{name} {share:.0f}" for name, share in shares if share is not None)
    print(f"\nChosen on the training runs, {' by '.join(CHOSEN)}: 100 (1 - rmse/std) = {words} %")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
