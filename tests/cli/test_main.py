from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

from typer.testing import Result

import hydrodamp

Call = Callable[..., Result]


def test_version(call: Call) -> None:
    assert call("--version").stdout == f"hydrodamp {hydrodamp.__version__}\n"


def test_help_names_every_command(call: Call) -> None:
    done = call("--help")
    assert done.exit_code == 0
    for command in ("demo", "models", "probe", "compare", "identify", "simulate", "vehicle"):
        assert f"\n  {command} " in done.stdout


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from hydrodamp.cli.main import app\n"
        "try: app(['--help'])\n"
        "except SystemExit: pass\n"
        "print(*sorted({'numpy', 'scipy', 'pydantic', 'yaml', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == ""


def test_python_m_hydrodamp() -> None:
    line = [sys.executable, "-m", "hydrodamp", "models", "liner"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert "Did you mean 'linear'?" in done.stderr
