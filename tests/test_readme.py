"""The README keeps its word: its Python runs, its commands exist."""

import re
from pathlib import Path

import yaml

import hydrodamp as hd
from hydrodamp.cli.main import app

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
SHELL = "".join(re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL))


def test_the_model_file_can_be_read(tmp_path):
    (block,) = re.findall(r"```yaml\n(.*?)```", README, flags=re.DOTALL)
    (tmp_path / "my-rov.yaml").write_text(block, encoding="utf-8")
    (model,) = hd.read_models(tmp_path / "my-rov.yaml")
    mapping = yaml.safe_load((ROOT / "examples/bluerov2/mapping.yaml").read_text("utf-8"))
    assert set(model.commands) == set(mapping["commands"])
    assert all(any(term.commands for term in terms) for terms in model.terms)


def test_a_shell_finds_the_commands_of_an_environment():
    first = SHELL.index("\nhydrodamp ")
    assert "\n. .venv/bin/activate" in SHELL[:first]


def test_it_names_every_command():
    names = {c.name or c.callback.__name__ for c in app.registered_commands}
    assert not [name for name in names if f"hydrodamp {name}" not in README]
