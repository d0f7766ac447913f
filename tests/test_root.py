"""The root of the repository holds what CONTRIBUTING lists."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


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
