import os
import subprocess
import sys
import warnings

import pytest
import typer

import hydrodamp as hd
from hydrodamp.cli.output import handle_errors
from hydrodamp.errors import FileError, GapWarning, LogError
from table_rows import rows


def status(error):
    def command():
        raise error

    with pytest.raises(typer.Exit) as caught:
        handle_errors(command)()
    return caught.value.exit_code


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (LogError(["one", "two"], source="a.csv"), 2, "error: a.csv: 2 faults\n  - one\n  - two"),
        (PermissionError(13, "Permission denied", "a.csv"), 2, "error: a.csv: Permission denied"),
        (OSError("odd"), 2, "error: file: odd"),
        (KeyError("x"), 1, "error: internal failure: KeyError: 'x' (test_output.py:"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_errors_become_a_sentence_and_a_status(error, code, words, capsys):
    assert status(error) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(words)


def test_what_typer_raises_passes():
    assert status(typer.Exit(5)) == 5
    with pytest.raises(BrokenPipeError):  # a closed pipe is left to typer
        status(BrokenPipeError())


def test_warnings_are_one_line_each_and_come_once(capsys):
    def command():
        for _ in range(2):
            warnings.warn("split\n  in two", GapWarning, stacklevel=2)

    handle_errors(command)()
    assert capsys.readouterr().err == "warning: split in two\n"


def test_paths_are_told_from_the_working_directory(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    inside = tmp_path / "logs" / "a.csv"
    assert status(FileError(f"{inside}: is odd; see {tmp_path.parent}/b")) == 2
    said = capsys.readouterr().err
    assert said == f"error: {inside.relative_to(tmp_path)}: is odd; see {tmp_path.parent}/b\n"


@pytest.mark.slow
@rows(("file", "line"))
def test_results_are_written_though_nobody_reads_what_is_printed(folder, line, file):
    fit = hd.Damping.from_dict(None, {"X_u": -8.0, "Y_v": -40.0, "N_r": -6.0})
    hd.write_damping(fit, folder / "d.json")
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([sys.executable, "-m", "hydrodamp", *line.split()], stdout=writer)
    os.close(writer)
    assert done.returncode == 1
    assert (folder / file).is_file()
