"""Throw broken files at our own readers until one falls over.

    python studies/fuzz_readers.py -max_total_time=60 -max_len=4000

Guided by coverage (atheris, ``pip install atheris``). A reader may refuse a file with an error of
hydrodamp; anything else is a fault, and the file that shows it is kept. The property tests in
``tests/ingest/formats`` ask for right numbers too.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import atheris

with atheris.instrument_imports(include=["hydrodamp.ingest.formats"]):
    from hydrodamp.ingest.formats import ardupilot, delimited, moos

from hydrodamp.errors import HydrodampError

READERS = (
    (moos.read_file, "a.alog"),
    (delimited.read_file, "a.csv"),
    (ardupilot.read_file, "a.bin"),
)


def main() -> None:
    """Fuzz until libFuzzer's own options say stop."""
    warnings.simplefilter("ignore")
    with TemporaryDirectory() as folder:

        def read_one_input(data: bytes) -> None:
            if not data:
                return
            read, name = READERS[data[0] % len(READERS)]
            path = Path(folder) / name
            path.write_bytes(data[1:])
            try:
                read(path)
            except HydrodampError:
                return

        atheris.Setup(sys.argv, read_one_input)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
