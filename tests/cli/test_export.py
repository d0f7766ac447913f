"""``hydrodamp export``."""

import json
from pathlib import Path

import pytest

import hydrodamp as hd
from hydrodamp.results import MANIFEST

from .conftest import TRUTH


@pytest.fixture
def damping(folder):
    hd.write_damping(hd.Damping.from_dict(None, TRUTH), "d.json")


@pytest.mark.slow
def test_writes_runs_and_tells(folder, call, damping):
    line = "export python d.json --vehicle planar.yaml --log b.csv --out sim"
    done = call(line)
    assert done.stdout.startswith("Verdict: exact to rounding; read back and run by ")
    assert "every term of" in " ".join(done.stdout.split())
    assert "\nReplay RMS" in done.stdout
    assert f"written to sim: auv_planar.py\nsee {Path('sim', 'fidelity.html')} " in done.stderr
    names = "fidelity.html", "fidelity.json", "auv_planar.py", MANIFEST
    assert {path.name for path in (folder / "sim").iterdir()} == {*names}
    call(line, status=2)
    document = json.loads(call(f"{line} --force --json").stdout)
    assert document == json.loads((folder / "sim" / "fidelity.json").read_text("utf-8"))


@pytest.mark.slow
def test_the_page_of_the_card_is_made_again(folder, call, damping):
    call("export c d.json --vehicle planar.yaml --log b.csv --out lib --set precision=float")
    page = (folder / "lib" / "fidelity.html").read_text("utf-8")
    assert "planar for c" in page
    assert "source and target" in page
    call("report lib --out card.html")
    assert (folder / "card.html").read_text("utf-8") == page
    (folder / "lib" / "fidelity.json").write_text("{}")
    assert "export again" in call("report lib --force", 2).stderr


@pytest.mark.slow
def test_what_does_not_compile_here_is_status_1(folder, call, damping, monkeypatch):
    refuses = folder / "bin" / "cc"
    refuses.parent.mkdir()
    refuses.write_text("#!/bin/sh\necho 'no header stddef.h' >&2; exit 1\n")
    refuses.chmod(0o755)
    monkeypatch.setenv("PATH", f"{refuses.parent}:/bin:/usr/bin")
    for target in ("c", "fmu"):
        done = call(f"export {target} d.json --vehicle planar.yaml --out {target}", 1)
        assert "error: the exported files do not run here: cc reports" in done.stderr
        assert "Verdict: failed: cc reports" in " ".join(done.stdout.split())
        assert (folder / target / "fidelity.html").is_file()


@pytest.mark.slow
def test_a_card_of_an_earlier_version_makes_its_page(folder, call, damping):
    line = "export python d.json --vehicle planar.yaml --out sim"
    call(line)
    path = folder / "sim" / "fidelity.json"
    card = json.loads(path.read_text("utf-8"))
    for key in ("slow_error", "run_error", "files"):
        del card[key]
    path.write_text(json.dumps(card))
    call("report sim --out card.html")
    assert "was changed" in call(f"{line} --force", 2).stderr


@pytest.mark.slow
def test_a_file_of_the_user_gets_hydrodynamics_and_loses_them(folder, call):
    own = '<sdf><model name="a">\n<link name="b"><inertial></inertial></link></model></sdf>'
    (folder / "own.sdf").write_text(own, "utf-8")
    hd.write_damping(hd.published["vt690-sname2022"], "vt690.json")
    line = "export gz-sim vt690.json --vehicle vt690 --into own.sdf"
    done = call(f"{line} --set step=0.002")
    assert done.stdout.startswith("Verdict: ")
    assert "written into link 'a::b' of own.sdf" in done.stderr
    assert "<link_name>b</link_name>" in (folder / "own.sdf").read_text("utf-8")

    call(f"{line} --remove")
    assert (folder / "own.sdf").read_text("utf-8") == own
