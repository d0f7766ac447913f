"""A live run under load, each in a process of its own: how fast, how late, how much memory.

``python benchmarks/live_load.py rate --minutes 10`` sends 10 000 samples a second by UDP,
``junk`` a million messages that are none, half of them to the port of MAVLink,
``samples`` takes ten million samples one after the other.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
import time
from collections.abc import Iterable, Iterator
from itertools import count, islice, pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import hydrodamp as hd
from hydrodamp.live.runner import LiveRun
from hydrodamp.live.samples import Row, rows_of
from hydrodamp.live.sources import Source, open_source

MAPPING = Path(__file__).resolve().parents[1] / "examples" / "onboard" / "mapping.yaml"
PERCENTILES = (50.0, 99.0, 99.9, 100.0)
BINS = np.geomspace(1e-6, 10.0, 1401)  # s


class Told:
    """What a run says and counts, and how much memory it has taken, minute by minute."""

    def __init__(self) -> None:
        self.line: dict[str, Any] = {}
        self.summary_lines: list[str] = []
        self.late = np.zeros(len(BINS) + 1, dtype=np.int64)
        self.memory: list[float] = []

    def over(self, rows: Iterable[Row | None]) -> Iterator[Row | None]:
        """Pass rows on; a row is done when the next is asked for."""
        due = 0.0
        for row in rows:
            yield row
            now = time.monotonic()
            if row and "sent" in row:
                self.late[np.searchsorted(BINS, now - float(row["sent"]))] += 1  # type: ignore[arg-type]
            if now >= due:
                self.memory.append(resident())
                due = now + 60.0

    def go(self, rows: Iterable[Row | None], source: Source | None = None) -> None:
        """Run to the end of the rows."""
        craft, model = hd.fleet["vt690"], hd.catalog["prestero"]
        run = LiveRun(
            craft, model, "rls", self.line.update, self.summary_lines.append, output_interval=60.0
        )
        if source is not None:
            run.source_counts = source.counts
        begun = time.process_time()
        run.process_rows(self.over(rows))
        self.busy = time.process_time() - begun

    def table(self) -> str:
        """Return all of it as lines."""
        share = np.cumsum(self.late) / max(1, self.late.sum())
        late = [
            BINS[min(np.searchsorted(share, p / 100), len(BINS) - 1)] * 1e3 for p in PERCENTILES
        ]
        lines = [f"counts {self.line['counts']}", f"processor {self.busy:.0f} s"]
        if self.late.any():
            told = ", ".join(f"{p:g} % {x:.2f}" for p, x in zip(PERCENTILES, late, strict=True))
            lines.append(f"latency [ms]: {told}")
        return "\n".join([*lines, "memory [MB]: " + " ".join(f"{one:.1f}" for one in self.memory)])


def resident() -> float:
    """Return the memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def dive(step: float) -> Iterator[Row]:
    """Yield samples of a campaign for ever, so close together, with a gap between its runs."""
    log = hd.reenact(seed=0, duration=100.0).train
    rows = [{k: v for k, v in row.items() if k != "segment"} for row in rows_of(log)]
    names = [name for name in rows[0] if name != "time"]
    table = np.array([[row[name] for name in names] for row in rows]).reshape(4, -1, len(names))
    clock, between = 0.0, max(1, round(0.1 / step))
    for run in count():
        part = table[run % 4]
        for old, new in pairwise(part):
            for share in np.arange(between) / between:
                clock += step
                sample = (old + share * (new - old)).tolist()
                yield {"time": clock, **dict(zip(names, sample, strict=True))}
        clock += 2.0


def send_samples(port: int, rate: float, seconds: float) -> None:
    """Send samples at a rate; the last word of each is when."""
    out, begun = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.monotonic()
    for k, row in enumerate(islice(dive(1.0 / rate), round(rate * seconds))):
        time.sleep(max(0.0, begun + k / rate - time.monotonic()))
        out.sendto(json.dumps({**row, "sent": time.monotonic()}).encode(), ("127.0.0.1", port))


def junk(random: np.random.Generator) -> Iterator[bytes]:
    """Yield for ever what no port should be sent."""
    good = next(dive(0.1))
    for k in count():
        kind = k % 8
        if kind < 2:
            yield random.bytes(int(random.integers(1, 200)))
        elif kind == 2:
            yield b"\xfd" + random.bytes(int(random.integers(1, 290)))
        elif kind == 3:
            yield json.dumps({**good, "time": k, "u": float("nan")}).encode()
        elif kind == 4:
            yield json.dumps({"temperature": [k], "depth": {"value": "deep"}}).encode()
        elif kind == 5:
            yield b"[" * int(random.integers(1, 3000))
        elif kind == 6:
            yield json.dumps({**good, "time": k * 1e300, "v": 1e308}).encode()
        else:
            yield bytes(60_000) if k % 800 == 7 else b"\n\xfe\x09" * 20


def send_junk(port: int, n: int) -> None:
    """Send junk, slowly enough for it to arrive."""
    out, begun = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.monotonic()
    for k, one in enumerate(islice(junk(np.random.default_rng(port)), n)):
        time.sleep(max(0.0, begun + k / 5000 - time.monotonic()))
        out.sendto(one, ("127.0.0.1", port))


def fed(kind: str, send: Any, *arguments: float) -> Told:
    """Return what a run told of what another process sends to its port."""
    told, first = Told(), next(dive(0.1))
    mapping = MAPPING if kind == "mavlink" else None
    source = open_source(
        f"{kind}://:0",
        mapping,
        allow_remote=False,
        real_time=False,
        on_message=told.summary_lines.append,
    )
    port = int(told.summary_lines[0].rpartition(" ")[2])
    sender = get_context("spawn").Process(target=send, args=(port, *arguments))
    sender.start()

    def rows() -> Iterator[Row | None]:
        if send is send_junk:
            yield first  # as no run begins with junk alone
        for row in source.rows:
            if row is None and not sender.is_alive():
                return
            yield row

    told.go(rows(), source)
    return told


def main() -> None:
    """Do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("rate", "junk", "samples"))
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=10_000.0, help="samples a second")
    parser.add_argument("--n", type=int, help="messages, or samples")
    given = parser.parse_args()
    if given.what == "rate":
        print(fed("udp", send_samples, given.rate, 60.0 * given.minutes).table())
    elif given.what == "junk":
        for kind in ("udp", "mavlink"):
            told = fed(kind, send_junk, (given.n or 1_000_000) // 2)
            print(f"{kind}\n{told.table()}", *told.summary_lines, sep="\n")
    else:
        told = Told()
        told.go(islice(dive(0.02), given.n or 10_000_000))
        print(told.table())


if __name__ == "__main__":
    sys.exit(main())
