"""The tables of exports: small ones, of two targets."""

from pathlib import Path

STUDIES = Path(__file__).parents[2] / "studies"


def test_tables_have_a_row_a_target_and_a_column_a_model(study, tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("# Head\n\n<!-- tables -->\n<!-- end of tables -->\nfoot\n", "utf-8")
    study.main(page, 20.0, 1.0, ["linear", "fossen"], ["python", "urdf"])
    lines = page.read_text("utf-8").splitlines()
    assert [line for line in lines if line.startswith("## ")] == [
        "## vt690, fins and propeller",
        "## bluerov2-heavy, a recorded wrench",
    ]
    rows = [line.split("|") for line in lines if line.startswith("| `")]
    assert [row[1].strip() for row in rows] == 4 * ["`python`", "`urdf`"]
    assert all(float(cell) < 1e-9 for cell in rows[0][2:4])
    assert rows[1][2].strip().startswith("≈")
    assert lines[-1] == "foot"
    assert capsys.readouterr().out
