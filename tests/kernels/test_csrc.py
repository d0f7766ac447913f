"""The C files alone: strict C99 in both precisions, no allocation, the same bits everywhere."""

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hydrodamp.kernels

CSRC = Path(hydrodamp.kernels.__file__).parent / "csrc"
SOURCES = sorted(CSRC.glob("*.c"))
STRICT = ["-std=c99", "-O3", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]

# One surge step of the identifier and one replay, in whatever hd_real is.


@pytest.fixture(scope="module")
def compiler():
    found = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    if found is None:
        pytest.skip("no C compiler here")
    return found


SAME_BITS = {
    "-DNDEBUG": "e37dfedf9bdfe2889e3a44ab3e023de8",
    "-DHD_FLOAT": "c3d80ed581fcc5855b586354bf770c43",
}


@pytest.fixture(scope="module")
def objects(compiler, tmp_path_factory):
    """The files compiled in both precisions, where a warning is an error."""
    made = {}
    for real in SAME_BITS:
        folder = tmp_path_factory.mktemp("objects")
        subprocess.run([compiler, *STRICT, real, "-c", *map(str, SOURCES)], cwd=folder, check=True)
        made[real] = [str(path) for path in sorted(folder.glob("*.o"))]
    return made


ELSEWHERE = {
    "x86_64-linux-musl": (),
    "aarch64-linux-musl": ("qemu-aarch64",),
    "arm-linux-musleabihf": ("qemu-arm",),
    "x86_64-windows-gnu": ("wine",),
}


def printed(compiler, core, real, folder, runner=()):
    """The hash of what same_bits.c prints, linked with the core."""
    source, program = Path(__file__).with_name("same_bits.c"), folder / "program.exe"
    flags = [*STRICT, real, f"-I{CSRC}", "-lm", "-o", str(program)]
    subprocess.run([*compiler, str(source), *core, *flags], check=True)
    done = subprocess.run([*runner, str(program)], capture_output=True, text=True, check=True)
    lines = "".join(f"{line}\n" for line in done.stdout.splitlines())
    return hashlib.md5(lines.encode()).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("real", SAME_BITS)
def test_the_bits_are_those_of_every_other_machine(compiler, objects, tmp_path, real):
    assert printed((compiler,), objects[real], real, tmp_path) == SAME_BITS[real]


@pytest.mark.skipif("HYDRODAMP_CROSS" not in os.environ, reason="`make cross` runs it")
@pytest.mark.parametrize("real", SAME_BITS)
@pytest.mark.parametrize("target", ELSEWHERE)
def test_the_bits_are_the_same_elsewhere(tmp_path, target, real):
    runner = ELSEWHERE[target]
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("zig is not installed")
    if runner and shutil.which(runner[0]) is None:
        pytest.skip(f"{runner[0]} is not installed")
    zig = (sys.executable, "-m", "ziglang", "cc", "-target", target)
    core = [str(path) for path in SOURCES]
    assert printed(zig, core, real, tmp_path, runner) == SAME_BITS[real]


@pytest.mark.parametrize("source", [*SOURCES, *CSRC.glob("*.h")], ids=lambda path: path.name)
def test_neither_allocates_nor_prints(source):
    text = re.sub(r"/\*.*?\*/", "", source.read_text(), flags=re.DOTALL)
    assert not re.search(r"\b(malloc|calloc|realloc|free|printf|fopen|alloca)\s*\(", text)
    assert set(re.findall(r"#include\s*[<\"](.+?)[>\"]", text)) <= {
        "onboard.h",
        "batch.h",
        "math.h",
        "stddef.h",
        "stdint.h",
    }
