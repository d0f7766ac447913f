"""A Parquet file larger than memory should hold, part by part through the triangle."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROWS, COLUMNS = 8_000_000, 16
"""Random numbers do not compress: 1.02 GB."""

STREAM = r"""
import dataclasses, re, sys, warnings
from pathlib import Path
import hydrodamp as hd
warnings.simplefilter("ignore")
model, triangle = hd.catalog["linear"], None
vehicle = dataclasses.replace(hd.fleet["vt690"], actuators=())
for log in hd.read_parts(sys.argv[1]):
    part = hd.accumulate(hd.prepare(vehicle, log, model))
    triangle = part if triangle is None else triangle.merge(part)
peak = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())[1]
print(triangle.n_samples, float(peak) / 1e6)
"""


def test_a_gigabyte_of_parquet(benchmark, ledger, tmp_path):
    """Peak memory of a process of its own, without its parent's; written in row groups."""
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak is read from /proc")
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    from pyarrow import parquet

    names = ["time", "roll", "pitch", "yaw", *"uvwpqr", *"XYZKMN"]
    rng, path = np.random.default_rng(0), tmp_path / "long.parquet"
    group = 500_000
    schema = pyarrow.schema([(name, pyarrow.float64()) for name in names])
    with parquet.ParquetWriter(path, schema, compression="none", use_dictionary=False) as file:
        for start in range(0, ROWS, group):
            columns = 0.1 * rng.standard_normal((COLUMNS, group))
            columns[0] = 0.1 * np.arange(start, start + group)
            file.write_table(pyarrow.table(dict(zip(names, columns, strict=True)), schema=schema))
    size = path.stat().st_size / 1e9
    assert size > 1.0

    def stream() -> str:
        done = subprocess.run(
            [sys.executable, "-c", STREAM, str(path)], capture_output=True, text=True, check=True
        )
        return done.stdout

    samples, peak = benchmark.pedantic(stream, rounds=1).split()
    assert int(samples) == ROWS
    what = "Parquet through the triangle, part by part: peak memory against the file"
    ledger.within(what, float(peak), size, target=1.0 / size, unit="GB")
