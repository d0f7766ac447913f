"""The command as a process: its address, a kill at any time, and what other commands import."""

import http.client
import re
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager
from urllib.parse import urlencode

import pytest

import hydrodamp as hd
from hydrodamp.app.project import Project

pytestmark = pytest.mark.slow

APP = [sys.executable, "-m", "hydrodamp", "app", "--no-browser"]


@contextmanager
def start(folder, *arguments):
    """Start the command; yield the process with its port, the path of its page and the cookie."""
    process = subprocess.Popen(
        [*APP, *arguments], cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    line = process.stderr.readline()
    found = re.search(r"http://127\.0\.0\.1:(\d+)(\S*)", line)
    assert found, line
    connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=30)
    connection.request("GET", found[2])
    answer = connection.getresponse()
    cookie = answer.headers["Set-Cookie"].split(";")[0]
    connection.close()
    try:
        yield process, int(found[1]), answer.headers["Location"], cookie
    finally:
        process.terminate()
        process.wait(30)
        process.stderr.close()


def request(port, cookie, method, path, form=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    headers = {"Cookie": cookie, "Origin": f"http://127.0.0.1:{port}"}
    with closing(connection):  # also where the server dies
        connection.request(method, path, urlencode(form or {}), headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


@pytest.fixture
def boat(tmp_path, campaign):
    """A log that needs a mapping."""
    log = campaign.train
    rows = zip(log.time.tolist(), *log.velocity.T[[0, 1, 5]].tolist(), strict=True)
    lines = ["t_s,fwd,sidewise,turn", *(",".join(map(repr, row)) for row in rows)]
    (tmp_path / "boat.csv").write_text("\n".join(lines), "utf-8")
    return tmp_path


def test_a_log_on_the_command_line_is_opened(boat):
    with start(boat, "boat.csv") as (_, port, path, cookie):
        assert path.endswith("/p/boat/channels")
        assert request(port, cookie, "GET", path)[0] == 200
        assert request(port, "hydrodamp=wrong", "GET", path)[0] == 403


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_server_leaves_whole_files(boat, seed):
    """Edits follow each other until the process is killed; each file on disk is a whole edit."""
    project = Project(boat.resolve(), "boat")
    is_over = threading.Event()
    with start(boat, "boat.csv") as (process, port, path, cookie):
        request(port, cookie, "GET", path)

        def edit():
            for number in range(10_000):
                text = f"time: t_s\nvelocity: {{u: fwd}}\nnote: {'x' * 2000}{number}\n"
                form = {"text": text, "version": project.version}
                try:
                    request(port, cookie, "POST", f"{path}/text", form)
                except (OSError, http.client.HTTPException):
                    break
                if is_over.is_set():
                    break

        thread = threading.Thread(target=edit)
        thread.start()
        time.sleep(0.4 + 0.13 * seed)
        process.kill()
    is_over.set()
    thread.join(30)
    mapping = hd.read_mapping(project.path("mapping.yaml"))
    assert mapping.entries
    assert project.arguments.logs == ("boat.csv",)
    with start(boat) as (_, port, path, cookie):
        assert "boat" in request(port, cookie, "GET", path)[1]


def test_an_occupied_port_is_told(boat):
    with start(boat) as (_, port, *_):
        call = [*APP, "--port", str(port)]
        done = subprocess.run(call, cwd=boat, capture_output=True, text=True, check=False)
        assert done.returncode == 2
        assert "Give another `--port`" in done.stderr
