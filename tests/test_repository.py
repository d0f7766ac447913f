"""README and CONTRIBUTING agree with the repository: model, commands, files of the root."""

import re
import subprocess
from pathlib import Path

import pytest
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


def test_it_names_every_command_and_links_its_page():
    names = {c.name or c.callback.__name__ for c in app.registered_commands}
    assert not [name for name in names if f"hydrodamp {name}" not in README]
    pages = {f"docs/how-to/{name}.md" for name in names}
    assert not [page for page in pages if (ROOT / page).exists() and f"({page})" not in README]


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no git checkout")
def test_the_root_holds_only_what_contributing_lists():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    table = text.split("| in the root |")[1].split("\n\n")[0]
    listed = {
        name for row in table.splitlines() for name in re.findall("`([^`]+)`", row.split("|")[1])
    }
    call = ["git", "ls-files", "-z"]
    files = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {name.split("/")[0] for name in files.split("\0") if name} == listed
