from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

from typer.testing import Result

import hydrodamp
from hydrodamp.cli import options
from hydrodamp.vehicle.fleet import fleet

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


def test_names_are_those_of_the_tables() -> None:
    assert options.FLEET.split(", ") == list(fleet)
    assert set(options.DEMO_METHODS.split(",")) < set(hydrodamp.METHODS)


def test_the_words_of_help_reach_the_reader(call: Call) -> None:
    for command in ("identify", "compare"):
        said = "".join(call(f"{command} --help").stdout.split())  # lines break at hyphens too
        assert "".join(options.KEYS.split()) in said
        assert "".join(options.FLEET.split()) in said
