import subprocess
import sys

import hydrodamp
from hydrodamp.cli.compare import DEMO_METHODS
from hydrodamp.cli.options import definition
from hydrodamp.vehicle.file import fleet


def test_version(call):
    assert call("--version").stdout == f"hydrodamp {hydrodamp.__version__}\n"


def test_help_names_every_command(call):
    done = call("--help")
    for command in ("demo", "models", "probe", "compare", "identify", "simulate", "vehicle"):
        assert f"\n  {command} " in done.stdout


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from hydrodamp.cli.main import app\n"
        "try: app(['--help'])\n"
        "except SystemExit: pass\n"
        "print(*sorted({'numpy', 'scipy', 'pydantic', 'yaml', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == ""


def test_python_m_hydrodamp():
    line = [sys.executable, "-m", "hydrodamp", "models", "liner"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert "Did you mean 'linear'?" in done.stderr


def test_names_are_those_of_the_tables():
    assert f"({', '.join(fleet)})" in definition("identify", "vehicle")["help"]
    assert f": {', '.join(hydrodamp.METHODS)}." in definition("identify", "method")["help"]
    assert f": {', '.join(hydrodamp.TARGETS)}." in definition("export", "target")["help"]
    assert set(DEMO_METHODS.split(",")) < set(hydrodamp.METHODS)
