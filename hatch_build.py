"""Compile the C core: for a wheel or an editable install, in place, or for another platform.

The system's C compiler does it where one works, else the one in the ``ziglang`` wheel, which
is asked for at build time only then. ``python hatch_build.py`` builds in place, ``python
hatch_build.py wheels`` makes a wheel for every platform of ``TARGETS`` with zig.
"""

from __future__ import annotations

import functools
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

ROOT = Path(__file__).resolve().parent
KERNELS = ROOT / "src" / "hydrodamp" / "kernels"
# The same bits everywhere: no contraction to fused multiply-add, no reordered sums.
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fPIC", "-DNDEBUG", "-shared")
ZIG = (sys.executable, "-m", "ziglang", "cc")
# What zig calls a platform, and the tag of its wheel.
TARGETS = {
    "x86_64-linux-gnu.2.17": "manylinux_2_17_x86_64.manylinux2014_x86_64",
    "aarch64-linux-gnu.2.17": "manylinux_2_17_aarch64.manylinux2014_aarch64",
    "x86_64-linux-musl": "musllinux_1_1_x86_64",
    "aarch64-linux-musl": "musllinux_1_1_aarch64",
    "x86_64-windows-gnu": "win_amd64",
    "aarch64-windows-gnu": "win_arm64",
    "x86_64-macos.11.0": "macosx_11_0_x86_64",
    "aarch64-macos.11.0": "macosx_11_0_arm64",
}
TARGET = "HYDRODAMP_TARGET"  # the environment variable that chooses one of them


class CoreBuildHook(BuildHookInterface[Any]):
    """Puts the compiled core into the wheel, or beside its sources where they are edited."""

    def dependencies(self) -> list[str]:
        """Return what the build needs besides: zig, where there is no compiler."""
        needed = self.target_name == "wheel" and (os.environ.get(TARGET) or not compiler())
        return ["ziglang>=0.12"] if needed else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile before the wheel is put together."""
        if self.target_name != "wheel":
            return
        target = os.environ.get(TARGET, "")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{TARGETS[target] if target else native_tag()}"
        if version == "editable":
            compile_to(KERNELS / library_name())
            return
        self.folder = tempfile.TemporaryDirectory()
        made = Path(self.folder.name, library_name(target))
        compile_to(made, target)
        build_data["force_include"][str(made)] = f"hydrodamp/kernels/{made.name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the library that is in the wheel now."""
        if folder := getattr(self, "folder", None):
            folder.cleanup()


@functools.cache
def compiler() -> tuple[str, ...] | None:
    """Return the first C compiler of the system that makes a shared library, or None."""
    named = shlex.split(os.environ.get("CC", ""))
    for command in filter(None, [named, ["cc"], ["gcc"], ["clang"]]):
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder, "try.c")
            source.write_text("#include <math.h>\n#include <stdint.h>\nint64_t one(void);\n")
            call = [*command, *FLAGS, str(source), "-o", str(Path(folder, "try"))]
            try:
                done = subprocess.run(call, capture_output=True, check=False)
            except OSError:
                continue
            if done.returncode == 0:
                return tuple(command)
    return None


def compile_to(library: Path, target: str = "") -> None:
    """Compile the C files to a shared library, for the platform of a target where given."""
    command = (*ZIG, "-target", target) if target else compiler() or ZIG
    sources = sorted(str(path) for path in (KERNELS / "csrc").glob("*.c"))
    math = [] if "windows" in target or library.suffix == ".dll" else ["-lm"]
    strip = ["-s"] if library.suffix != ".dylib" else []
    print("compiling the core:", shlex.join(command), file=sys.stderr)
    subprocess.run([*command, *FLAGS, *strip, *sources, *math, "-o", str(library)], check=True)


def library_name(target: str = "") -> str:
    """Return what the library is called on a target, by default on this machine."""
    system = target or sys.platform
    suffix = "dll" if "win" in system and "darwin" not in system else "so"
    return f"_core.{'dylib' if 'macos' in system or system == 'darwin' else suffix}"


def native_tag() -> str:
    """Return the platform tag of a wheel that is made for this machine alone."""
    tags = list(platform_tags())
    return tags[-1] if sys.platform == "linux" else tags[0]


def outdated(library: Path) -> bool:
    """Return whether a source, or this file, is newer than the library."""
    sources = [*(KERNELS / "csrc").iterdir(), Path(__file__)]
    made = library.stat().st_mtime if library.exists() else 0.0
    return any(source.stat().st_mtime > made for source in sources)


def main(words: list[str]) -> None:
    """Build in place, or all wheels."""
    library = KERNELS / library_name()
    if words == ["wheels"]:
        for target in TARGETS:
            call = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
            subprocess.run(call, cwd=ROOT, env={**os.environ, TARGET: target}, check=True)
    elif outdated(library):
        compile_to(library)


if __name__ == "__main__":
    main(sys.argv[1:])
