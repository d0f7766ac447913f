import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hydrodamp.cli.main import app
from hydrodamp.report import page as pages, pictures as drawing

pytestmark = pytest.mark.slow

LINE = (
    "compare ab.csv --vehicle planar.yaml --train one --test two --models linear --methods ls "
    "--out out"
)
BARE = ("identifiability.json", "band.npz", "comparison.json", "replays.npz")


@pytest.fixture(scope="module")
def compared(planar, tmp_path_factory):
    """A folder of results, with pictures and report."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("jinja2")
    home = tmp_path_factory.mktemp("compared")
    shutil.copytree(planar, home, dirs_exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(home)
        done = CliRunner().invoke(app, LINE.split())
    assert done.exit_code == 0, done.output
    assert done.stderr.endswith("written to out\nwritten to out/report.html\n")
    return home / "out"


@pytest.fixture
def results(compared, folder):
    """A copy of it."""
    return Path(shutil.copytree(compared, folder / "out"))


def test_the_report_is_made_again_as_it_was(results, call):
    for name in (*BARE, "figures/index.json"):
        assert (results / name).exists()
    first = (results / "report.html").read_bytes()
    assert "out/report.html: exists already" in call("report out", 2).stderr
    done = call("report out --force")
    assert done.stderr == "written to out/report.html\n"
    assert (results / "report.html").read_bytes() == first
    for words in (b"Usable: linear by ", b"fit ", b'"label":"r [deg/s]"'):
        assert words in first
    assert b'"label":"w [m/s]"' not in first  # a locked velocity is not drawn


def test_without_the_extra_all_else_is_done_and_a_note_says_how_to_get_it(
    folder, call, monkeypatch
):
    with monkeypatch.context() as bare:
        bare.setattr(pages, "find_spec", lambda _: None)
        bare.setattr(drawing, "find_spec", lambda _: None)
        done = call(LINE)
        assert "hydrodamp[report]" in call("report out", 2).stderr  # a page is all it is for
        alone = call("identify a.csv --vehicle planar.yaml --model linear --method ls --out d.json")
    assert {name for name in BARE if (folder / "out" / name).exists()} == set(BARE)
    assert done.stderr.count('pip install "hydrodamp[report]"') == 2
    assert "out/report.html is not written" in done.stderr
    assert alone.stderr.count("hydrodamp[report]") == 2
    assert [path.name for path in folder.glob("d.*")] == ["d.json"]
    mine = folder / "out" / "report.html"
    mine.write_text("mine", "utf-8")
    assert "report.html: is not hydrodamp's" in call("report out --force", 2).stderr
    mine.unlink()
    call("report out")  # later, with the extra: no log, so no pictures, and the page says so
    text = (folder / "out" / "report.html").read_text("utf-8")
    assert "package matplotlib" in text
    assert "Usable: linear by " in text
    mine.write_text(f"{text}<!-- mine -->", "utf-8")
    assert "report.html: was changed since" in call("report out --force", 2).stderr
    mine.write_text(text, "utf-8")
    call("report out --force")
