"""Compare damping models and methods on zigzags of a tanker: ``python compare.py DATA``.

DATA is the folder with the runs HSVA_CPMC_KVLCC2_Z_*.dat. Of nine runs, in the order of their
names, every second one is held out and replayed whole, open loop, from its first sample; the
others are for identification. Any other run that is there is replayed apart. README.md has the
results.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import hydrodamp as hd
from hydrodamp.cli.output import print_results
from hydrodamp.errors import PropulsionWarning
from hydrodamp.report.comparison_tables import detail_tables, summary_tables
from hydrodamp.validation.compare import Row

HERE = Path(__file__).parent
SOURCE = (
    "github.com/martinlarsalbert/System-identification-of-Vessel-Manoeuvring-Models, commit"
    " 4b7ce53, MIT"
)
RUNS = ("05_01", "10_05", "10_10_P", "10_10_S", "15_05", "20_05", "20_10_P", "25_05", "30_05")
TRAIN, TEST = RUNS[::2], RUNS[1::2]
METHODS = "ls,weak,ridge,dissipative,rls,oe,recommended"
CHOSEN = ("tanker", "recommended")


def read(folder: Path, *runs: str) -> hd.Log:
    """Return runs as one log, a segment each."""
    files = [folder / f"HSVA_CPMC_KVLCC2_Z_{run}.dat" for run in runs]
    return hd.read_logs(files, HERE / "mapping.yaml")


def others(folder: Path) -> list[str]:
    """Return the runs of the folder that are not among the nine."""
    found = (path.stem.partition("_Z_")[2] for path in folder.glob("HSVA_CPMC_KVLCC2_Z_*.dat"))
    return sorted(set(found) - set(RUNS))


def percent(row: Row) -> str:
    """Return 100 (1 - rmse/std) of surge, sway and yaw rate."""
    if row.score.diverged:
        return "diverged"
    shares = row.score.fit_by_axis.items()
    return " ".join(f"{name} {share:.0f}" for name, share in shares if share is not None)


def fits(
    vehicle: hd.Vehicle, train: hd.Log, models: Sequence[hd.DampingModel], methods: Sequence[str]
) -> list[hd.Fit]:
    """Return every model by every method, and tell the time each method takes."""
    problem = hd.prepare(vehicle, train, models)
    made: list[hd.Fit] = []
    for key in methods:
        start = perf_counter()
        made += hd.identify_all(problem, models, hd.find_method(key))
        print(f"{key}: {len(models)} models in {perf_counter() - start:.1f} s", flush=True)
    return made


def each_held_out(vehicle: hd.Vehicle, folder: Path, model: hd.DampingModel) -> None:
    """Print what a fit to all other runs makes of each run."""
    for run in RUNS:
        train = read(folder, *(other for other in RUNS if other != run))
        fit = hd.identify(model, vehicle, train, hd.find_method(CHOSEN[1]))
        print(f"{run:8} {percent(hd.compare([fit], vehicle, read(folder, run)).rows[0])}")


def main(arguments: list[str] | None = None) -> int:
    """Compare, print and, if asked to, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the runs")
    parser.add_argument("--out", type=Path, help="folder for comparison.json, tables and fits")
    parser.add_argument("--methods", default=METHODS, help=f"with commas; default {METHODS}")
    parser.add_argument("--models", help="of models.yaml, with commas; all by default")
    parser.add_argument("--each", action="store_true", help="hold out every run in turn, too")
    asked = parser.parse_args(arguments)
    warnings.simplefilter("ignore", PropulsionWarning)  # (eta-1) terms vanish; README says so
    try:
        work(asked)
    except hd.HydrodampError as error:
        print(f"error: {error}\nThe runs are at {SOURCE}.", file=sys.stderr)
        return 2
    return 0


def work(asked: argparse.Namespace) -> None:
    """Do what was asked for."""
    nested = asked.data / "kvlcc2_hsva"
    folder = nested if nested.is_dir() else asked.data
    vehicle = hd.read_vehicle(HERE / "vehicle.yaml")
    models = {model.key: model for model in hd.read_models(HERE / "models.yaml")}
    chosen = asked.models.split(",") if asked.models else list(models)
    train, test = read(folder, *TRAIN), read(folder, *TEST)
    print(f"Data: {SOURCE}.\nTrained on {', '.join(TRAIN)}; held out {', '.join(TEST)}, whole.")
    made = fits(vehicle, train, [models[key] for key in chosen], asked.methods.split(","))
    table = hd.compare(made, vehicle, test)
    print_results(*detail_tables(table), *summary_tables(table))
    print("\n100 (1 - rmse/std) in %, held-out runs together:")
    for row in table.rows:
        print(f"{row.fit.method:12} {row.fit.model.key:22} {percent(row)}")
    best = [fit for fit in made if (fit.model.key, fit.method) == CHOSEN]
    for run in others(folder) if best else ():
        told = percent(hd.compare(best, vehicle, read(folder, run)).rows[0])
        print(f"Another run, {run}, {' by '.join(CHOSEN)}: {told}")
    if asked.out:
        hd.write_comparison(table, asked.out)
    if asked.each:
        print(f"\n{' by '.join(CHOSEN)}, each run held out in turn, fitted to all others, in %:")
        each_held_out(vehicle, folder, models[CHOSEN[0]])


if __name__ == "__main__":
    raise SystemExit(main())
