"""What users read: help of every command, and results on a small log with numbers masked."""

import re
import shutil
from pathlib import Path

import pytest
import typer

from hydrodamp.cli import options
from hydrodamp.cli.main import app
from hydrodamp.cli.options import examples
from table_rows import rows

COMMAND = typer.main.get_command(app)
COMMANDS = {**COMMAND.commands, **COMMAND.commands["vehicle"].commands}
del COMMANDS["help"]
HERE = Path(__file__).parent
CALLS = (HERE / "printed_calls.txt").read_text("utf-8").splitlines()


def describe_parameter(parameter):
    """Return flags, section and help of a parameter."""
    panel = getattr(parameter, "rich_help_panel", None) or ""
    names = " ".join(parameter.opts) if parameter.param_type_name == "option" else parameter.metavar
    return f"{names} [{panel}] {' '.join((parameter.help or '').split())}"


def mask(text):
    """Return a text without digits, and without the widths that depend on them."""
    text = re.sub(r"\n {2,}(?=\S)", " ", text)
    text = re.sub(r"[-+<]?\.?\d[\d.]*(e[-+]?\d+)?", "#", text)
    return re.sub(r"-{2,}", "--", re.sub(r" {2,}", "  ", text))


@pytest.mark.parametrize("name", sorted(set(COMMANDS) - {"vehicle"}))
def test_help(name, snapshot):
    command = COMMANDS[name]
    lines = [command.help.strip(), *map(describe_parameter, command.params), *examples()[name]]
    assert "\n".join(lines) == snapshot


def test_every_example_has_options_of_its_command():
    for name, lines in examples().items():
        assert len(lines) == 2
        known = {flag for parameter in COMMANDS[name].params for flag in parameter.opts}
        for line in lines:
            assert {word for word in line.split() if re.match(r"--?[a-z]", word)} <= known


def test_options_of_one_meaning_have_one_name():
    for name, command in COMMANDS.items():
        flags = [set(parameter.opts) for parameter in getattr(command, "params", ())]
        for long, short in (("--out", "-o"), ("--vehicle", "-v"), ("--quiet", "-q")):
            assert all(short in each for each in flags if long in each), name
        assert name == "vehicle" or {"--quiet", "-q"} in flags


@rows(("command", "parameter", "given", "completed"))
def test_completion_continues_a_list(command, parameter, given, completed):
    complete = options.complete_list(options.definition(command, parameter)["complete"])
    assert complete(given) == completed


@pytest.mark.parametrize(
    "line", [pytest.param(x, id=x, marks=[pytest.mark.slow] * x.startswith("plan")) for x in CALLS]
)
def test_output(folder, call, line, snapshot, monkeypatch):
    monkeypatch.setattr("hydrodamp.report.plan_report.write_plan", lambda *_: [])
    monkeypatch.setattr("hydrodamp.progress._LINE_INTERVAL", float("inf"))
    shutil.copytree(HERE / "spoilt", folder, dirs_exist_ok=True)
    done = call(line)
    assert mask(f"{done.stdout}\n{done.stderr}") == snapshot
