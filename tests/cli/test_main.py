import json
import subprocess
import sys

import pytest

import hydrodamp
from hydrodamp.cli.demo import DEMO_METHODS
from hydrodamp.cli.options import definition
from hydrodamp.export.export import TARGETS
from hydrodamp.ingest.mapping.log_mapping import presets
from hydrodamp.vehicle.file import fleet


def test_version(call):
    assert call("--version").stdout == f"hydrodamp {hydrodamp.__version__}\n"


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from hydrodamp.cli.main import app\n"
        "try: app(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pydantic', 'yaml', 'rich', 'starlette', 'uvicorn', 'jinja2'}\n"
        "print(*sorted((heavy | {'hydrodamp.app'}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == ""


def test_names_are_those_of_the_tables():
    assert f"({', '.join(fleet)})" in definition("identify", "vehicle")["help"]
    assert f": {', '.join(hydrodamp.METHODS)}." in definition("identify", "method")["help"]
    assert f": {', '.join(TARGETS)}." in definition("export", "target")["help"]
    assert set(DEMO_METHODS.split(",")) < set(hydrodamp.METHODS)


def test_help_of_a_command_has_two_forms(call):
    assert call("help compare").stdout == call("compare --help").stdout
    assert call("help").stdout == call("--help").stdout
    assert "list[" not in call("help compare").stdout


@pytest.mark.parametrize(
    ("kind", "names", "word"),
    [
        ("methods", hydrodamp.METHODS, "weak form"),
        ("vehicles", fleet, "weight:"),
        ("presets", presets(), "velocity:"),
        ("targets", TARGETS, "Parameters"),
    ],
)
def test_names_that_options_accept_are_listed_and_explained(call, kind, names, word):
    listed = json.loads(call(f"list {kind} --json").stdout)[kind]
    assert [*listed] == [*names]
    assert all(text and "\n" not in text for text in listed.values())
    assert all(name in call(f"list {kind}").stdout for name in names)
    last = [*names][-1]
    assert word in call(f"list {kind} {'weak' if kind == 'methods' else last}").stdout
    assert json.loads(call(f"list {kind} {last} --json").stdout)["name"] == last


def test_kinds_of_names_are_counted(call):
    counted = json.loads(call("list --json").stdout)["kinds"]
    assert counted["vehicles"] == str(len(fleet))
    assert "datasets" in call("list").stdout


@pytest.mark.slow
def test_a_dash_reads_the_log_from_standard_input(folder):
    line = [sys.executable, "-m", "hydrodamp", "convert", "-", "--out", "again.csv"]
    source = (folder / "a.csv").read_bytes()
    done = subprocess.run(line, input=source, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (folder / "again.csv").is_file()
    empty = subprocess.run(line, input=b"", capture_output=True, check=False)
    assert (empty.returncode, b"standard input is empty" in empty.stderr) == (2, True)
