"""``hydrodamp live``."""

import json
import os
import pty
import signal
import subprocess
import sys
from random import Random
from time import monotonic

import pytest

import hydrodamp as hd
from hydrodamp.live.estimator import METHODS

from .conftest import read_until

#: How often a run is killed.
KILLS = int(os.environ.get("HYDRODAMP_KILLS", "5"))

START = "live --vehicle planar.yaml --model linear"


def words(*more):
    return [sys.executable, "-m", "hydrodamp", *START.split(), *more]


@pytest.mark.slow
def test_a_log_is_told_as_the_batch_fit(folder, call):
    done = call(f"{START} --source b.csv --checkpoint s.json")
    line = json.loads(done.stdout.splitlines()[-1])
    assert next(iter(line)) == "verdict"
    assert line["verdict"].endswith("coefficients are determined")
    told = {label: one["value"] for label, one in line["coefficients"].items()}
    problem = hd.prepare(hd.read_vehicle("planar.yaml"), hd.read_log("b.csv"), hd.catalog["linear"])
    fit = METHODS["ai-composite"].identify(problem, hd.catalog["linear"])
    assert told == fit.damping.as_dict()
    again = call(f"{START} --source b.csv --checkpoint s.json")
    assert [json.loads(again.stdout)] == [line]
    assert "resumes after sample" in again.stderr


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals between processes")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT", "SIGHUP"])
def test_a_signal_ends_a_run_with_its_last_line_and_its_state(folder, name):
    line = words("--source", "stdin", "--checkpoint", "s.json")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(line, **pipes) as run:
        run.stdin.write((folder / "b.csv").read_text())
        run.stdin.flush()
        run.stdout.readline()
        run.send_signal(getattr(signal, name))
        lines = run.stdout.read().splitlines()
        assert run.wait() == 0
    taken = json.loads(lines[-1])["counts"]["taken"]
    assert json.loads((folder / "s.json").read_text())["state"]["counts"]["taken"] == taken


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals between processes")
def test_a_run_that_is_killed_goes_on_bit_for_bit(folder, call):
    """Killed at random moments: no state is half, and the last line is the same."""
    whole = call(f"{START} --source a.csv").stdout.splitlines()[-1]
    run_words = words("--source", "a.csv", "--checkpoint", "s.json", "--checkpoint-interval", "0")
    begun = monotonic()
    subprocess.run([*run_words, "--output-interval", "1e9"], check=True, capture_output=True)
    length, random = monotonic() - begun, Random(1)
    (folder / "s.json").unlink()
    for _ in range(KILLS):
        with subprocess.Popen(run_words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
            try:
                run.wait(random.uniform(0.4 * length, length))
            except subprocess.TimeoutExpired:
                run.kill()
        if (folder / "s.json").exists():
            assert "checksum" in json.loads((folder / "s.json").read_text())
    end = subprocess.run(run_words, check=True, capture_output=True, text=True)
    assert end.stdout.splitlines()[-1] == whole


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_a_full_disk_under_standard_output_ends_nothing(folder, call):
    call(f"{START} --source a.csv --checkpoint whole.json")
    with open("/dev/full", "w") as full:
        run = words("--source", "a.csv", "--checkpoint", "s.json")
        done = subprocess.run(run, stdout=full, stderr=subprocess.PIPE, text=True, check=True)
    assert done.stderr.count("lines cannot be written") == 1
    assert (folder / "s.json").read_text() == (folder / "whole.json").read_text()


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no such pipes")
def test_a_closed_pipe_ends_the_run_with_its_state(folder):
    run = words("--source", "a.csv", "--checkpoint", "s.json")
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(run, **pipes) as process:
        process.stdout.close()
        said = process.stderr.read()
        assert process.wait() == 0
    assert said.splitlines() == ["standard output was closed: the run ends."]
    assert 0 < json.loads((folder / "s.json").read_text())["state"]["n_rows"] < 400


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals between processes")
def test_a_signal_ends_a_pause_of_a_paced_log(folder):
    head, *lines = (folder / "b.csv").read_text().splitlines()
    time, rest = lines[1].split(",", 1)
    later = f"{float(time) + 3600.0!r},{rest}"
    (folder / "gap.csv").write_text("\n".join([head, *lines[:2], later, ""]))
    run = words(
        "--source", "gap.csv", "--real-time", "--checkpoint", "s.json", "--checkpoint-interval", "0"
    )
    with subprocess.Popen(run, stdout=subprocess.PIPE) as process:
        while not (folder / "s.json").exists() and process.poll() is None:
            pass
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0


def test_an_address_of_another_machine_is_refused(folder, call):
    line = f"{START} --source udp://192.0.2.1:0 --allow-remote"
    assert "cannot be bound" in call(line, status=2).stderr


def test_a_reader_that_fails_is_status_1(folder, call, monkeypatch):
    def fails(descriptor=0):
        def read(waiting):
            raise OSError("the cable is cut")

        return read

    monkeypatch.setattr("hydrodamp.live.sources.line_reader", fails)
    said = call(f"{START} --source stdin", status=1).stderr
    assert said == "error: stdin: the source can no longer be read: OSError: the cable is cut\n"


@pytest.mark.slow
def test_a_terminal_shows_a_table_in_place(folder):
    """The table follows the stream; messages stand above it, and the last estimate remains."""
    text, (terminal, other_end) = (folder / "b.csv").read_text(), pty.openpty()
    environment = {**os.environ, "COLUMNS": "100", "LINES": "40", "TERM": "xterm"}
    with subprocess.Popen(
        words("--source", "stdin"),
        stdin=subprocess.PIPE,
        stdout=other_end,
        stderr=other_end,
        env=environment,
        text=True,
    ) as run:
        os.close(other_end)
        run.stdin.write(text)
        run.stdin.flush()
        first = read_until(terminal, r"X_u +-\d")
        run.stdin.write("noise\n")
        run.stdin.close()
        last = r"(?s)unreadable +1 that cannot be read.*Y_r +\d\S* +\d\S* +[a-z]"
        shown = first + read_until(terminal, last)
        assert run.wait(60) == 0
    os.close(terminal)
    assert "a sample that cannot be read is rejected" in shown
    assert "alarm armed" in shown
    assert "ai-composite" in shown
    assert "{" not in shown
