"""The pages of the targets run by copy and paste: their own imports, a folder for each command."""

import re
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).parents[2] / "docs" / "how-to" / "export").glob("*.md"))
BLOCK = re.compile(r"^```(\S+)\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_imports_what_it_uses_and_writes_a_folder_a_command(page):
    blocks = BLOCK.findall(page.read_text("utf-8"))
    python = [text for language, text in blocks if language == "python"]
    if python:
        assert re.search(r"^import hydrodamp as hd$", python[0], flags=re.MULTILINE)
    shell = "\n".join(text for language, text in blocks if language == "sh")
    folders = re.findall(r"--out (\S+)", shell)
    folders += re.findall(r'^.*hd\.export\(.*"(\w+)"(?:, log=log)?\)+$', "\n".join(python), re.M)
    assert len(set(folders)) == len(folders)
    assert len(folders) == len(re.findall(r"hydrodamp export .* --out ", shell)) + "\n".join(
        python
    ).count("hd.export(")
