"""What a season costs by part, and how many samples go through at how much memory.

``python benchmarks/season_load.py --logs 10000`` folds so many logs of 8004 samples of Parquet
in two processes, and says how much memory each took; then one log is taken apart.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path
from tempfile import TemporaryDirectory

from pyarrow import parquet

import hydrodamp as hd
from hydrodamp.batch.sufficient_statistics import summarise_address

MODEL, VEHICLE, WHOLE = hd.catalog["prestero"], hd.fleet["vt690"], 1e10


def cost(work: Callable[[], object], rounds: int = 50) -> float:
    """Return the processor time of one of many rounds [s]."""
    work()
    begun = time.process_time()
    for _ in range(rounds):
        work()
    return (time.process_time() - begun) / rounds


def by_part(path: Path, log: hd.Log) -> str:
    """Return what each part of a log takes, and the hours of a core for a whole."""
    problem = hd.prepare(VEHICLE, log, [MODEL])
    parts = {"pyarrow alone": cost(lambda: parquet.read_table(path))}
    parts["read"] = cost(lambda: hd.read_log(path))
    parts["prepare"] = cost(lambda: hd.prepare(VEHICLE, log, [MODEL]))
    statistics = {}
    for key, method in {"ls": hd.LeastSquares(), "weak": hd.WeakForm()}.items():
        parts[f"rows, {key}"] = cost(lambda way=method: way.equations.rows(problem))  # type: ignore[misc]
        parts[f"whole, {key}"] = cost(
            lambda key_method=method: summarise_address(str(path), VEHICLE, [MODEL], key_method)  # type: ignore[misc]
        )
        statistics[key] = summarise_address(str(path), VEHICLE, [MODEL], method)
    parts["merge of two"] = cost(lambda: statistics["weak"].merge(statistics["ls"]))
    hours = WHOLE / log.n / 3600.0
    return "\n".join(
        f"{name:16} {1e3 * one:8.2f} ms {hours * one:8.2f} core-hours for {WHOLE:g} samples"
        for name, one in parts.items()
    )


def many(folder: Path, log: hd.Log, n: int) -> str:
    """Fold so many logs; return how long it took and how much memory."""
    for k in range(n):  # at other times each: a log counts once
        hd.write_log(replace(log, time=log.time + k), folder / f"dive{k}.parquet")
    begun = time.monotonic()
    (one,) = hd.batch(folder, VEHICLE, MODEL, by=["folder"], workers=2).fits
    took = time.monotonic() - begun
    for child in active_children():
        child.join()
    most = [resource.getrusage(who).ru_maxrss / 1e3 for who in (-1, 0)]
    return (
        f"{one.n_logs} logs of {one.fit.n_samples} samples in {took:.0f} s; "
        f"at most {most[0]:.0f} MB a worker, {most[1]:.0f} MB for the first process"
    )


def main() -> None:
    """Do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, nargs="+", default=[1250, 12500])
    log = hd.reenact(seed=0).train
    with TemporaryDirectory() as where:
        hd.write_log(log, path := Path(where) / "log.parquet")
        for n in parser.parse_args().logs:
            (folder := Path(where) / str(n)).mkdir()
            print(many(folder, log, n))
        print(by_part(path, log))


if __name__ == "__main__":
    main()
