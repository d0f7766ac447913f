"""A server of the local pages in a thread, and a plain client of it."""

import http.client
import json
import re
import shutil
import socket
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlencode

import pytest
import uvicorn

import hydrodamp as hd
from hydrodamp.app.security import Session
from hydrodamp.app.server import create_app


@dataclass
class Server:
    """A running server of a folder."""

    root: Path
    session: Session
    announced: list

    @property
    def port(self):
        return self.session.port

    @property
    def origin(self):
        return f"http://127.0.0.1:{self.port}"

    @property
    def address(self):
        return self.session.new_address()

    def request(self, method, path, form=None, headers=(), body=None, is_page=True):
        """Return status, headers and text of a request with cookie and origin."""
        path = self.session.path + path if is_page else path
        known = {"Cookie": f"hydrodamp={self.session.cookie}", "Origin": self.origin}
        if form is not None:
            body = urlencode(form, doseq=True)
            known["HX-Request"] = "true"
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.request(method, path, body, {**known, **dict(headers)})
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        return answer.status, answer.headers, text

    def get(self, path):
        status, _, text = self.request("GET", path)
        assert status == 200, text[:500]
        return text.decode()

    def data(self, path):
        return json.loads(self.get(path))

    def post(self, path, status=200, **form):
        """Post a form, to a project with the version of its files."""
        project = re.match("/p/[^/]+", path)
        form = {"version": version_of(self, project[0]) if project else "", **form}
        done, _, text = self.request("POST", path, form)
        assert done == status, text[:500]
        return text.decode()


@pytest.fixture
def server(tmp_path):
    """A server of an empty folder."""
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    announced = []
    session = Session(port, announced.append)
    config = uvicorn.Config(create_app(tmp_path, session), log_level="warning")
    running = uvicorn.Server(config)
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listener]})
    thread.start()
    while not running.started:
        time.sleep(0.01)
    yield Server(tmp_path, session, announced)
    running.should_exit = True
    thread.join(30.0)
    listener.close()


@pytest.fixture(scope="session")
def campaign():
    """A simulated dive whose vehicle has actuators."""
    return hd.reenact(seed=1, duration=60.0)


@pytest.fixture(scope="session")
def dive(campaign, tmp_path_factory):
    """The training log of the campaign as a file."""
    path = tmp_path_factory.mktemp("dive") / "dive.csv"
    hd.write_log(campaign.train, path)
    return path


@pytest.fixture
def canonical(server, dive):
    """A copy of it in the folder of the server."""
    return shutil.copy(dive, server.root / "dive.csv").name


def open_log(server, *paths, **more):
    """Create the project of logs and return its address below that of the session."""
    status, headers, text = server.request("POST", "/open", {"log": paths, **more})
    assert status == 200, text[:500]
    return headers["HX-Redirect"].removeprefix(server.session.path).removesuffix("/channels")


@pytest.fixture
def project(server, canonical):
    """The address of a project of that log."""
    return open_log(server, canonical)


def version_of(server, project):
    """Return the version of the files of a project."""
    from hydrodamp.app.project import find_project

    return find_project(server.root, project.removeprefix("/p/")).version
