"""Rows of a log, seeded and mutated: numbers, types, order and size.

``python tests/live/row_mutator.py 1000000 | hydrodamp live --vehicle vt690 --model prestero
--source stdin --checkpoint s.json --output-interval 1e4`` must end with
status 0 and a finite estimate.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Sequence
from itertools import count, islice
from random import Random

import hydrodamp as hd
from hydrodamp.live.samples import rows_of

SHARE = 0.1  # of the rows are mutated
NUMBERS = (
    *("0", "-0.0", "1e-320", "1e19", "-1e77", "1e154", "1e160", "1e200", "-1e308", "1e400"),
    *("NaN", "Infinity", "-Infinity", "65535", "32767", "-32768", "4294967295", "9" * 309),
    *("9" * 4000, "9" * 5000, "1e-400", "50", "-50.1", "3.5", "20000"),
)
TYPES = ("true", "false", "null", '"noon"', '""', "[]", "[1, 2]", "{}", '{"value": 1}')
JUNK = (b"", b" ", b"{", b"[" * 3000, b"\xff\xfe\x00", b"nan", b"[1]", b"1,2", b"#", b"time,u")


QUATERNION = ("qw", "qx", "qy", "qz")
#: Changes of a row, by kind; None removes a column, and a function gets the earlier value.
CHANGES = {
    "foreign": None,
    "angles": {**dict.fromkeys(QUATERNION), "roll": 0.1, "pitch": 0.2, "yaw": 0.3},
    "quaternion": {**dict.fromkeys(("roll", "pitch", "yaw")), "qw": 1.0, "qx": 0, "qy": 0, "qz": 0},
    "qw beside angles": {"qw": 1.0},
    "roll beside a quaternion": {"roll": 3.0},
    "upside down": {"qw": 0.0, "qx": 1.0, "qy": 0.0, "qz": 0.0},
    "quaternion of zeros": dict.fromkeys(QUATERNION, 0.0),
    "roll 1e308": {"roll": 1e308},
    "roll 3": {"roll": 3.0},
    "pitch 400": {"pitch": 400.0},
    "other columns": {"Y": 40.0, "eta": 0.1, "heartbeat": 1},
    "rpm": {"rpm": 20_000.0},
    "force": {"X": 5e2},
    "degrees": dict.fromkeys(("roll", "pitch", "yaw"), math.degrees),
    "knots": dict.fromkeys("uvw", lambda x: 1.944 * x),
}
LASTING = {"degrees"}  # from a row on


def poisoned(rows: Sequence[dict], kind: str, n: int, random: Random) -> list[dict[str, object]]:
    """Return rows of which n are changed, but not the first."""
    start = random.randrange(1, len(rows) - n)
    chosen = range(start, len(rows)) if kind in LASTING else random.sample(range(1, len(rows)), n)
    change = CHANGES[kind]
    spoilt = [*rows]
    for k in chosen:
        if change is None:
            spoilt[k] = {"heartbeat": k}
            continue
        new = {name: f(rows[k][name]) if callable(f) else f for name, f in change.items()}
        spoilt[k] = {name: value for name, value in (rows[k] | new).items() if value is not None}
    return spoilt


def endless_rows() -> Iterator[dict[str, object]]:
    """Yield the samples of a campaign for ever, the clock going on, with a gap between rounds."""
    samples = [*rows_of(hd.reenact(seed=0, duration=50.0).train)]
    length = float(samples[-1]["time"]) + 5.0
    for k in count():
        for row in samples:
            yield row | {"time": float(row["time"]) + k * length}


def mutated(seed: int = 0) -> Iterator[bytes]:
    """Yield lines for ever, of which a share is mutated."""
    random, before = Random(seed), b""
    for k, row in enumerate(endless_rows()):
        line = json.dumps(row).encode()
        # The first one says what is measured.
        yield from (line,) if k == 0 or random.random() > SHARE else _mutants(random, row, before)
        before = line


def _mutants(random: Random, row: dict[str, object], before: bytes) -> Iterator[bytes]:
    line, kind = json.dumps(row).encode(), random.randrange(8)
    if kind < 3:  # numbers and types
        names = random.sample([*row], random.choice((1, 1, 1, 2, len(row))))
        fields = {name: json.dumps(value) for name, value in row.items()}
        fields |= {name: random.choice(NUMBERS if kind < 2 else TYPES) for name in names}
        yield ("{" + ", ".join(f'"{name}": {text}' for name, text in fields.items()) + "}").encode()
    elif kind == 3:  # any magnitude
        name = random.choice([name for name in row if name != "segment"])
        value = random.choice((-1.0, 1.0)) * 10.0 ** random.uniform(-30.0, 300.0)
        yield json.dumps(row | {name: value}).encode()
    elif kind == 4:  # order
        yield from (line, before) if before else (line,)
    elif kind == 5:  # time
        shift = random.choice((-1e9, -3.0, 0.9, 60.0, 1e9))
        yield json.dumps(row | {"time": row["time"] + shift}).encode()
    elif kind == 6:  # size
        place = random.randrange(len(line))
        yield random.choice((line[:place], line * 2, line + b" " * 20_000, line[place:] + line))
        yield random.choice((json.dumps({f"x{k}": k for k in range(999)}).encode(), line, b"{}"))
    else:
        yield random.choice(JUNK)
        yield bytes(random.randrange(256) for _ in range(random.randrange(1, 99)))


def main(n: int, seed: int = 0) -> None:
    """Write so many lines on standard output."""
    for line in islice(mutated(seed), n):
        sys.stdout.buffer.write(line.replace(b"\n", b" ") + b"\n")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
