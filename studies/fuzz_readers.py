"""Mutated logs of every format, read in processes of bounded memory and time.

    PYTHONPATH=tests python studies/fuzz_readers.py --first 0 --n 1000 --out fuzz_0.json

Bytes of a small log are changed, cut, repeated and spliced; every fourth file is compressed after
it. A reader answers with a recording or an error of hydrodamp. A file that ends otherwise (crash,
time limit, traceback, warning of NumPy) is kept in the folder `fuzz_0.faults`.
"""

from __future__ import annotations

import gc
import gzip
import json
import os
import resource
import signal
import struct
import sys
import tempfile
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from subprocess import CompletedProcess
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import typer

from hydrodamp.errors import HydrodampError, HydrodampWarning
from hydrodamp.ingest.formats import arrays, files
from hydrodamp.ingest.inspection.probe import probe
from writers import Dataflash, RosBag, Ulog

MEMORY_BYTES = 2 << 30  # of address space beyond that at the start
TIME_LIMIT_SECONDS = 15  # of CPU; a reader that waits has ten times as long
BATCH = 20  # files of a child process: a fork takes as long as two files
PROBED_SHARE = 8  # one file in so many is also probed, which takes ten times as long
OUTCOMES = ("read", "refused", "traceback", "warning")
N_ROWS = 60


def write_seeds(folder: Path) -> dict[str, bytes]:
    """Write a log of each format; return the contents by name."""
    import h5py
    import scipy.io
    from pyarrow import parquet, table

    time = 100.0 + 0.1 * np.arange(N_ROWS)
    columns = {name: np.sin(0.1 * k + time) for k, name in enumerate("uvwpqr")}
    state = {"time": time, **columns, "yaw": 0.1 * time, "rpm": 900.0 + 0 * time}
    rows = [[*state], *np.column_stack([*state.values()]).round(4).tolist()]
    lines = [[*map(str, row)] for row in rows]
    for name, mark in (
        ("log.csv", ","),
        ("semicolons.csv", ";"),
        ("log.tsv", "\t"),
        ("a.dat", " "),
    ):
        text = "\n".join(map(mark.join, lines)) + "\n"
        text = text.replace(".", ",") if mark == ";" else text
        (folder / name).write_text(text, "utf-8")
    words = [
        [*line, f"2024-05-01 10:{k // 60:02}:{k % 60:02}", '"on"'] for k, line in enumerate(lines)
    ]
    comments = "# a log\n" + "\n".join(map(",".join, words)) + "\n"
    (folder / "words.csv").write_bytes(comments.encode("utf-16"))
    postings = (
        f"{t:.2f} NAV_X pNav {x:.3f}\n{t:.2f} MODE pHelm on"
        for t, x in zip(time, columns["u"], strict=True)
    )
    (folder / "log.alog").write_text("%% LOGSTART 1000.5\n" + "\n".join(postings) + "\n", "utf-8")
    np.savez(folder / "log.npz", **state)
    np.save(folder / "log.npy", np.column_stack([*state.values()]))
    scipy.io.savemat(folder / "log.mat", {"log": state})
    with h5py.File(folder / "log.h5", "w") as file:
        for key, values in state.items():
            file.create_dataset(f"nav/{key}", data=values, compression="gzip")
    parquet.write_table(table({**state, "mode": ["on"] * N_ROWS}), folder / "log.parquet")
    _write_autopilot_logs(folder, time)
    bag = RosBag()
    bag.ros1(folder / "log.bag", bag.twists(N_ROWS, old=True))
    for kind in ("MCAP", "SQLITE3"):
        storage = next(bag.ros2(folder / kind, bag.twists(N_ROWS), kind).glob("*[3p]"))
        storage.rename(folder / f"log{storage.suffix}")
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def _write_autopilot_logs(folder: Path, time: np.ndarray) -> None:
    from pymavlink.dialects.v20 import common

    dataflash, ulog, vehicle = Dataflash(), Ulog(1_000_000), common.MAVLink(None, 3, 1)
    for kind, name, letters, fields in (
        (130, "UNIT", "QbZ", "TimeUS,Id,Label"),
        (131, "MULT", "Qbd", "TimeUS,Id,Mult"),
        (132, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
        (140, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw"),
        (141, "IMU", "QBff", "TimeUS,I,GyrX,GyrZ"),
        (142, "XKF1", "Qfffg", "TimeUS,VN,VE,VD,D"),
        (143, "MSG", "QZ", "TimeUS,Message"),
    ):
        dataflash.define(kind, name, letters, fields)
    dataflash.write_message("UNIT", 0, ord("E"), b"rad/s")
    dataflash.write_message("MULT", 0, ord("0"), 1.0)
    dataflash.write_message("FMTU", 0, 141, b"s#EE", b"F-00")
    dataflash.write_message("MSG", 0, b"ArduSub")
    ulog.define("vehicle_attitude", "float[4] q;uint8_t reset;uint8_t[3] _padding0")
    ulog.define("vehicle_local_position", "float x;float vx;double ref")
    ulog.announce(0, "vehicle_attitude")
    ulog.announce(1, "vehicle_local_position")
    packets = b""
    for k, second in enumerate(time.tolist()):
        stamp = round(1e6 * second)
        dataflash.write_message("ATT", stamp, 0.1 * k, -0.2 * k, 3.0 * k)
        for sensor in (0, 1):
            dataflash.write_message("IMU", stamp, sensor, 0.1 * k, 0.5)
        dataflash.write_message("XKF1", stamp, 1.0, 0.1 * k, 0.0, 2.0)
        ulog.send(0, stamp, "4fB", 1.0, 0.0, 0.0, 0.1, k)
        ulog.send(1, stamp, "2fd", 1.0 * k, 1.0, 50.0)
        message = vehicle.attitude_encode(round(1e3 * second), 0.1, 0, 0.1 * k, 0, 0, 0.25)
        packets += struct.pack(">Q", 1_700_000_000_000_000 + stamp) + message.pack(vehicle)
    dataflash.save(folder / "log.bin")
    ulog.save(folder / "log.ulg")
    (folder / "log.tlog").write_bytes(packets)


def mutate(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a content with some bytes changed, cut, repeated or spliced."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, to = sorted(rng.integers(0, len(data) + 1, 2).tolist())
        length = int(rng.integers(1, 17))
        match rng.integers(10):
            case 0 | 7 | 8 | 9:
                data[at : at + 1] = bytes([rng.integers(256)])
            case 1:
                data[at : at + length] = rng.bytes(length)
            case 2:
                data[at : at + length] = rng.choice([b"\0", b"\xff", b"\x7f", b"9"]) * length
            case 3:
                data[at:at] = data[at : at + 8 * length]
            case 4:
                del data[at : at + length]
            case 5:
                data[at : at + length] = data[to : to + length]
            case 6 if rng.random() < 0.3:
                del data[at:]
        data = data or bytearray(b"\0")
    return bytes(data)


def mutated_file(number: int, seeds: dict[str, bytes], folder: Path) -> tuple[Path, bytes]:
    """Return the path and the content of a mutated file by its number."""
    rng, key = np.random.default_rng(number), [*seeds][number % len(seeds)]
    content, path = mutate(seeds[key], rng), folder / f"mutated_{number}_{key}"
    if rng.integers(4) == 0:
        content, path = gzip.compress(content), path.with_name(f"{path.name}.gz")
    return path, content


def read_in_child(numbers: range, seeds: dict[str, bytes], folder: Path) -> Iterator[str]:
    """Read files in a child process; yield their outcomes, the last of which may end the child."""
    source, sink = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(source)
        _limit_memory()
        for number in numbers:
            path, content = mutated_file(number, seeds, folder)
            path.write_bytes(content)
            outcome = _read(path, probed=number // len(seeds) % PROBED_SHARE == 0)
            path.unlink()
            os.write(sink, bytes([OUTCOMES.index(outcome)]))
        os._exit(0)
    os.close(sink)
    with os.fdopen(source, "rb") as stream:
        yield from (OUTCOMES[code] for code in stream.read())
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        received = os.WTERMSIG(status)
        is_late = received in (signal.SIGALRM, signal.SIGPROF)
        yield "time limit" if is_late else signal.Signals(received).name


def _limit_memory() -> None:
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _read(path: Path, *, probed: bool) -> str:
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT_SECONDS)
    signal.alarm(10 * TIME_LIMIT_SECONDS)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        outcome = "read"
        try:
            recording = files.read_files(path)
            if probed:
                probe(recording)
        except HydrodampError:
            outcome = "refused"
        except BaseException:
            traceback.print_exc()
            return "traceback"
    foreign = [it for it in caught if not issubclass(it.category, HydrodampWarning)]
    for it in foreign:
        print(f"{path.name}: {it.filename}:{it.lineno}: {it.message}", file=sys.stderr)
    return "warning" if foreign else outcome


def run_forked(command: list[str], *, input: bytes, **_: bool) -> CompletedProcess[bytes]:
    """Run the code of a Python command in a fork, which has its imports, not in a new process."""
    with ExitStack() as stack:
        streams = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(3)]
        streams[0].write(input)
        streams[0].seek(0)
        child = os.fork()
        if child == 0:
            for number, stream in enumerate(streams):
                os.dup2(stream.fileno(), number)
            sys.stdin, sys.stdout, sys.stderr = (os.fdopen(k, "w" if k else "r") for k in range(3))
            status = 1
            try:
                exec(command[2], {})
                status = 0
            except BaseException:
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        status = os.waitpid(child, 0)[1]
        for stream in streams[1:]:
            stream.seek(0)
        code = os.waitstatus_to_exitcode(status)
        return CompletedProcess(command, code, streams[1].read(), streams[2].read())


def main(first: int = 0, n: int = 1000, out: Path = Path("fuzz.json"), only: str = "") -> None:
    """Read ``n`` mutated files from number ``first``, and write the counts of outcomes."""
    counts: dict[str, Counter[str]] = {}
    faults = out.with_suffix(".faults")
    with (
        # an attacker writes the right checksum
        patch.object(zipfile.ZipExtFile, "_update_crc", lambda *_: None),
        patch.object(arrays, "subprocess", SimpleNamespace(run=run_forked)),
        tempfile.TemporaryDirectory() as name,
    ):
        folder = Path(name)
        seeds = {key: it for key, it in write_seeds(folder).items() if only in key}
        for key in seeds:
            probe(files.read_files(folder / key))  # imports what the children need
        gc.freeze()
        number = first
        while number < first + n:
            numbers = range(number, min(number + BATCH, first + n))
            for outcome in read_in_child(numbers, seeds, folder):
                path, content = mutated_file(number, seeds, folder)
                kind = Path(path.name.removesuffix(".gz")).suffix
                counts.setdefault(kind, Counter())[outcome] += 1
                number += 1
                if outcome not in OUTCOMES[:2]:
                    print(f"{path.name}: {outcome}", file=sys.stderr)
                    faults.mkdir(exist_ok=True)
                    (faults / path.name).write_bytes(content)
            out.write_text(json.dumps(counts, indent=1), "utf-8")


if __name__ == "__main__":
    typer.run(main)
