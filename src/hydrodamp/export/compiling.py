"""hydrodamp's own C files beside an export, and the compilers that may be here."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np

from hydrodamp.export.target import NotRun
from hydrodamp.files import save_all

#: What a vehicle's header stands on, and what is there for the estimators on board.
SOURCES = ("atoms.c", "attitude.c", "cholesky.c", "motion.c")
HEADERS = ("batch.h", "onboard.h")
ON_BOARD = ("adaptive.c", "blocks.c", "recursive.c", "steps.c")

#: The same bits everywhere: no contraction to fused multiply-add, no reordered sums.
STRICT = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror")

_CORTEX_M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")


def own_files(names: Sequence[str]) -> dict[str, bytes]:
    """Return some of hydrodamp's own C files, unchanged."""
    folder = files("hydrodamp.kernels").joinpath("csrc")
    return {name: folder.joinpath(name).read_bytes() for name in names}


def compiler() -> str:
    """Return the C compiler that is here, or say that there is none."""
    found = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if found is None:
        raise NotRun("no C compiler (cc, gcc or clang) is installed")
    return found


def shared(folder: Path, sources: Sequence[str], flags: Sequence[str], library: Path) -> str:
    """Compile a shared library, every warning an error; return what compiled it."""
    call = [compiler(), *STRICT, "-fPIC", "-shared", *flags, *sources, "-lm", "-o", str(library)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotRun(f"{call[0]} refused it: {done.stderr.strip().rstrip('.')}")
    return version_of(call[0])


def version_of(command: str) -> str:
    """Return the first line of what a program says of itself."""
    return _said([command, "--version"]).splitlines()[0]


def size_of(contents: Mapping[str, bytes], flags: Sequence[str]) -> str:
    """Tell what sources take on a Cortex-M7, else on this machine; nothing where no gcc can."""
    kits = {"arm-none-eabi-": _CORTEX_M7, "": ()}
    found = (_size_by(prefix, kit, contents, flags) for prefix, kit in kits.items())
    return next(filter(None, found), "")


def _size_by(
    prefix: str, kit: Sequence[str], contents: Mapping[str, bytes], flags: Sequence[str]
) -> str:
    if not shutil.which(f"{prefix}gcc"):
        return ""
    with tempfile.TemporaryDirectory() as place:
        save_all({Path(place, name): content for name, content in contents.items()})
        sources = [name for name in contents if name.endswith(".c")]
        call = [f"{prefix}gcc", *STRICT, "-Os", "-fstack-usage", *kit, *flags, "-c"]
        if subprocess.run([*call, *sources], cwd=place, capture_output=True).returncode:
            return ""  # a cross compiler without its C library
        told = _said([f"{prefix}size", *(f"{Path(name).stem}.o" for name in sources)], place)
        rows = np.array([line.split()[:3] for line in told.splitlines()[1:]], dtype=int)
        frames = " ".join(each.read_text() for each in Path(place).glob("*.su"))
    code, data, unset = rows.sum(axis=0).tolist()
    # No function calls itself, so that all frames together are more than there ever are.
    stack = sum(map(int, re.findall(r"\t(\d+)\t", frames)))
    processor = "a Cortex-M7" if prefix else "this machine"
    return (
        f"By {prefix}gcc -Os for {processor}: {code} bytes of code and constants, {data + unset} "
        f"bytes of variables, at most {stack} bytes of stack for a step."
    )


def _said(call: Sequence[str], place: str = ".") -> str:
    return subprocess.run(call, cwd=place, capture_output=True, text=True, check=True).stdout
