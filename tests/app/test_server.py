"""Requests that the server refuses, and what it answers to the others."""

import base64
import csv
import errno
import io
import json
import os
import shutil
import socket
import subprocess
import time
import zipfile
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.app.commands import compare_command
from hydrodamp.app.project import find_project
from hydrodamp.app.recordings import read_files
from hydrodamp.app.web import MAX_FORM
from table_rows import rows

from .conftest import open_log, version_of

HOSTILE = "<script>window.stolen = 1</script>"


@rows(["headers"])
@pytest.mark.parametrize(
    ("method", "path"), [("GET", "/"), ("POST", "/open"), ("PUT", "/upload?name=a")]
)
def test_requests_without_session_or_from_elsewhere_are_refused(server, headers, method, path):
    given = {name: text.format(port=server.port) for name, text in headers.items()}
    assert server.request(method, path, headers=given)[0] == 403
    assert not [*server.root.iterdir()]


def visit(server, address, method="GET", **headers):
    path = address.removeprefix(server.origin)
    return server.request(method, path, headers={"Cookie": "", **headers}, is_page=False)


def test_an_address_opens_the_session_once(server):
    address = server.address
    status, headers, _ = visit(server, address)
    assert status == 303
    assert headers["Location"] == f"{server.session.path}/"
    assert {*headers["Set-Cookie"].lower().split("; ")[1:]} == {
        "httponly", "samesite=strict", f"path={server.session.path}".lower()
    }  # fmt: skip
    status, headers, text = visit(server, address)
    assert status == 403
    assert "Set-Cookie" not in headers
    assert b"latest address in the terminal" in text


def test_a_used_address_that_comes_again_ends_the_session(server, caplog):
    address, cookie = server.address, server.session.cookie
    assert visit(server, address)[0] == 303  # by another user, who read it first
    assert visit(server, address)[0] == 403
    assert "has ended" in caplog.text
    headers = {"Cookie": f"hydrodamp={cookie}"}
    assert server.request("GET", "/", headers=headers)[0] == 403
    assert visit(server, server.announced[-1])[0] == 303
    server.get("/")
    assert visit(server, address)[0] == 403
    server.get("/")  # the address ended its own session, and ends no later one


def test_an_address_is_valid_for_a_time_and_not_used_ahead_of_the_visit(server):
    assert visit(server, server.session.new_address(life=-1.0))[0] == 403
    address = server.address
    assert visit(server, address, "HEAD")[0] == 403
    assert visit(server, address, **{"Sec-Purpose": "prefetch;prerender"})[0] == 403
    assert visit(server, address)[0] == 303


def test_the_announced_address_is_replaced_when_it_is_used(server):
    server.session.announce()
    assert visit(server, server.address)[0] == 303  # that of the browser which the command opens
    assert len(server.announced) == 1
    assert visit(server, server.announced[0])[0] == 303
    assert len(server.announced) == 2
    assert visit(server, server.announced[1])[0] == 303


@pytest.mark.parametrize("path", ["/", "/p/dive/channels", "/assets/app.js", "//evil.example"])
def test_the_cookie_opens_nothing_outside_the_path_of_the_session(server, path):
    assert server.request("GET", path, is_page=False)[0] == 403


def test_all_answers_forbid_scripts_of_others(server):
    for path in ("/", "/assets/app.js", "/nothing"):
        _, headers, _ = server.request("GET", path)
        assert "script-src 'self'" in headers["Content-Security-Policy"]
        assert headers["X-Content-Type-Options"] == "nosniff"


@pytest.mark.slow
@rows(("path", "form"))
def test_a_wrong_form_is_refused_in_a_sentence_and_changes_nothing(
    server, project, path, form, snapshot
):
    (server.root / "bad.csv").write_bytes(b"\x00\x01\x02")
    find_project(server.root, "dive").path("results").mkdir()
    find_project(server.root, "dive").path("results/damping.json").write_text("{}", "utf-8")
    before = {path: path.read_bytes() for path in server.root.rglob("*.*") if path.is_file()}
    form = {"version": version_of(server, project), **form}
    status, headers, text = server.request("POST", path, form)
    assert status == 422
    assert {path: path.read_bytes() for path in before} == before
    assert [*server.root.glob("*.hydrodamp")] == [server.root / "dive.hydrodamp"]
    said = text.decode().replace(str(server.root), "FOLDER")
    assert f"{headers['HX-Retarget']}\n{said}" == snapshot


def test_uploads_are_whole_and_do_not_replace_other_files(server):
    put = server.request("PUT", "/upload?name=..%2F..%2Fdive.csv", body=b"t,u\n0,1\n")
    assert json.loads(put[2])["path"] == "logs/dive.csv"
    assert (server.root / "logs/dive.csv").read_bytes() == b"t,u\n0,1\n"
    assert server.request("PUT", "/upload?name=dive.csv", body=b"t,u\n0,1\n")[0] == 200
    assert server.request("PUT", "/upload?name=dive.csv", body=b"other")[0] == 422
    assert [path.name for path in (server.root / "logs").iterdir()] == ["dive.csv"]


@pytest.mark.slow
def test_a_project_log_needs_no_mapping(server, project):
    page = server.get(f"{project}/channels/checks")
    assert page.count("light green") > 6  # u v w p q r and more have their roles by name
    assert not (server.root / "dive.hydrodamp/mapping.yaml").exists()


def decode_values(encoded):
    """Return the values of a series that the page decodes: counts of steps from the least."""
    counts = np.frombuffer(base64.b64decode(encoded["steps"]), "<u2")
    return encoded["low"] + encoded["step"] * counts[counts < 65_535]


@pytest.mark.slow
def test_series_keep_the_extremes_of_the_log(server, project, campaign):
    found = server.data(f"{project}/channels/series?column=u&n=50")
    values = decode_values(found["series"]["u"]["y"])
    assert values.max() == pytest.approx(campaign.train.velocity[:, 0].max(), rel=1e-4)
    narrow = server.data(f"{project}/channels/series?column=u&start=1&end=2")
    assert len(base64.b64decode(narrow["series"]["u"]["x"])) < 8 * 100


@pytest.fixture
def foreign(server):
    """A table that needs a mapping: degrees, an outlier, and a column with a hostile name."""
    rng, time = np.random.default_rng(0), np.arange(0.0, 60.0, 0.1)
    yaw_rate = 20.0 * np.sin(0.4 * time)
    speed = 1.0 + 0.3 * np.sin(0.3 * time)
    speed[200] = 40.0
    columns = {
        "time_s": time, "speed": speed, "yaw_rate_deg_s": yaw_rate, "sway": 0.1 * np.cos(time),
        "rudder": np.sign(np.sin(0.4 * time)), HOSTILE: rng.standard_normal(len(time)),
    }  # fmt: skip
    with (server.root / "boat.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*(each.tolist() for each in columns.values()), strict=True))
    return "boat.csv"


@pytest.fixture
def boat(server, foreign):
    return open_log(server, foreign)


def give_roles(server, project, unit=""):
    """Give two columns of that table the roles of surge and sway, the latter in a unit."""
    for column, role, each in (("speed", "velocity.u", ""), ("sway", "velocity.v", unit)):
        form = {"column": column, "role": role, "unit": each, "sign": "1"}
        server.post(f"{project}/channels/column", **form)


@pytest.mark.slow
def test_a_role_becomes_a_line_of_the_mapping(server, foreign, boat):
    folder = server.root / "boat.hydrodamp"
    give_roles(server, boat, unit="kn")
    mapping = hd.read_mapping(folder / "mapping.yaml")
    units = {entry.name: entry.choices[0].unit for entry in mapping.entries}
    assert units["v"] == "kn"
    log = hd.read_log(server.root / foreign, folder / "mapping.yaml")
    assert log.velocity[0, 1] == pytest.approx(0.1 * 1852 / 3600)


def test_names_of_a_file_stay_text(server, boat):
    page = server.get(f"{boat}/channels")
    assert HOSTILE not in page
    assert "&lt;script&gt;window.stolen" in page


def test_two_tabs_lose_no_write(server, boat):
    version = version_of(server, boat)
    form = {"column": "speed", "role": "velocity.u", "sign": "1", "version": version}
    server.post(f"{boat}/channels/column", **form)
    text = (server.root / "boat.hydrodamp/mapping.yaml").read_text("utf-8")
    page = server.post(f"{boat}/channels/column", 409, **{**form, "role": ""})
    assert "another tab" in page
    assert (server.root / "boat.hydrodamp/mapping.yaml").read_text("utf-8") == text


def test_a_step_is_previewed_and_applied(server, boat):
    give_roles(server, boat)
    query = "step=remove_outliers&channel=u"
    found = server.data(f"{boat}/channels/preview?{query}")["series"]["u"]
    before, after = (decode_values(each["y"]) for each in found)
    assert np.nanmax(before) == 40.0
    assert np.nanmax(after) < 2.0
    server.post(f"{boat}/channels/step", step="remove_outliers")
    mapping = hd.read_mapping(server.root / "boat.hydrodamp/mapping.yaml")
    assert len(mapping.steps) == 1


@pytest.mark.slow
def test_sizes_give_a_vehicle_file(server, project):
    sizes = {"length": "2.1", "diameter": "0.19", "mass": "40", "height": "12", "name": "mine"}
    server.post(f"{project}/vehicle", source="sizes", axis=["X", "Y", "N"], **sizes)
    vehicle = hd.read_vehicle(server.root / "dive.hydrodamp/vehicle.yaml")
    assert vehicle.axes == ("X", "Y", "N")
    assert vehicle.center_of_buoyancy[2] == pytest.approx(-0.012)


@pytest.mark.slow
def test_gains_become_models_that_extend_the_chosen_ones(server, project):
    server.post(f"{project}/vehicle/gains", gain=["rpm|X", "rudder|N"])
    models = hd.read_models(server.root / "dive.hydrodamp/model.yaml")
    assert [model.key for model in models] == ["linear-gains", "fossen-gains", "prestero-gains"]
    assert {"rpm", "rudder"} <= {*models[0].commands}
    assert "has no actuators" not in server.get(f"{project}/channels/checks")


@pytest.mark.slow
def test_a_run_has_the_general_model_by_default_beside_models_with_gains(server, project):
    found = find_project(server.root, "dive")
    assert 'value="general" checked' in server.get(f"{project}/run")
    assert "general,linear,fossen,prestero" in compare_command(found)
    server.post(f"{project}/vehicle/gains", gain=["rpm|X"])
    assert "general,dive.hydrodamp/model.yaml" in compare_command(found)
    server.post(f"{project}/run/choice", model="general", method="weak")
    assert "general" in compare_command(found)
    assert not found.text("model.yaml")
    server.post(f"{project}/run/choice", model="linear", method="weak")
    assert "dive.hydrodamp/model.yaml" in compare_command(found)


def test_files_of_a_project_alone_are_sent(server, project):
    assert "logs" in server.get(f"{project}/file/project.yaml")
    for path in ("../dive.csv", "%2e%2e/dive.csv", "nothing.yaml"):
        assert server.request("GET", f"{project}/file/{path}")[0] in (404, 422)
    _, _, content = server.request("GET", f"{project}/archive")
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {"dive.hydrodamp/project.yaml", "commands.sh"} <= {*names}


def test_a_project_whose_log_became_unreadable_stays(server, canonical):
    project = open_log(server, canonical)
    (server.root / canonical).write_bytes(b"\x00\x01")
    assert open_log(server, canonical) == project
    assert server.request("GET", f"{project}/channels")[0] == 422
    assert (server.root / "dive.hydrodamp/project.yaml").is_file()


@pytest.mark.slow
def test_runs_and_parts_of_the_same_files_are_different_projects(server, campaign):
    for name in ("a", "b"):
        hd.write_log(campaign.train, server.root / f"{name}.csv")
    runs = open_log(server, "a.csv", "b.csv")
    joined = open_log(server, "a.csv", "b.csv", joined="1")
    assert runs != joined
    for project, column in ((runs, "u"), (joined, "a.u"), (runs, "u")):
        series = server.data(f"{project}/channels/series?n=10")["series"]
        assert column in series, [*series]


@pytest.mark.slow
def test_parts_of_a_log_are_the_same_as_a_folder_ticked_or_joined_by_plus(server, measured_logs):
    folder = server.root / "mission"
    folder.mkdir()
    for path in measured_logs("vt690_field").glob("*.dat"):
        shutil.copy(path, folder)
    parts = sorted(f"mission/{path.name}" for path in folder.iterdir())
    assert len(parts) == 5
    projects = {
        open_log(server, "mission"),
        open_log(server, *parts, joined="1"),
        open_log(server, "+".join(parts)),
    }
    contents = []
    for project in projects:
        files = read_files(find_project(server.root, project.removeprefix("/p/")))
        topics = [topic.name for each in files.recordings for topic in each.topics]
        contents.append((topics, [preset.name for preset in files.probe.presets]))
    assert all(each == contents[0] for each in contents)
    assert contents[0][1] == ["avl690"]


@pytest.mark.slow
def test_gains_survive_a_change_of_models_and_an_edited_file_is_kept(server, project):
    path = server.root / "dive.hydrodamp/model.yaml"
    server.post(f"{project}/vehicle/gains", gain=["rpm|X"])
    for models in ([], ["coe"]):
        server.post(f"{project}/run/choice", model=models, method="weak")
    assert [model.key for model in hd.read_models(path)] == ["coe-gains"]
    path.write_text(path.read_text("utf-8").replace("coe-gains", "mine"), "utf-8")
    server.post(f"{project}/run/choice", model=["linear"], method="weak")
    assert [model.key for model in hd.read_models(path)] == ["mine"]
    text = server.post(f"{project}/vehicle/gains", 422, gain=["rpm|Y"])
    assert "edited by hand" in text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["-日本 50%41 #1 a b'c.csv", "-v.csv"])
def test_any_name_of_a_file_works(server, canonical, name):
    (server.root / canonical).rename(server.root / name)
    project = open_log(server, name)
    for screen in ("channels", "channels/checks", "vehicle", "split", "run", "files", "archive"):
        assert server.request("GET", f"{project}/{screen}")[0] == 200, screen


def test_numbers_of_a_query_are_checked(server, canonical):
    address = f"{open_log(server, canonical)}/channels/series?column=u"
    for query in ("start=abc", "n=abc", "n=", "n=1e99", "n=-5", "end=nan"):
        assert server.request("GET", f"{address}&{query}")[0] in (200, 422), query


def test_links_out_of_the_folder_are_not_followed(server, canonical, tmp_path_factory):
    project, outside = open_log(server, canonical), tmp_path_factory.mktemp("outside")
    (outside / "secret.txt").write_text("secret", "utf-8")
    (server.root / "dive.hydrodamp/leak.txt").symlink_to(outside / "secret.txt")
    assert server.request("GET", f"{project}/file/leak.txt")[0] == 422
    (server.root / "logs").symlink_to(outside)
    assert server.request("PUT", "/upload?name=a.csv", body=b"x")[0] == 422
    assert [path.name for path in outside.iterdir()] == ["secret.txt"]
    text = (server.root / "dive.hydrodamp/project.yaml").read_text("utf-8")
    hostile = text.replace("dive.csv", f"{outside}/secret.txt")
    (server.root / "dive.hydrodamp/project.yaml").write_text(hostile, "utf-8")
    assert server.request("GET", f"{project}/channels")[0] == 422


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", ["commands: 5", "topics: {a: 5}", "commands: [{a: 1}]", "extends: 5"]
)
def test_a_mapping_that_was_damaged_by_hand_is_shown(server, boat, text):
    (server.root / "boat.hydrodamp/mapping.yaml").write_text(text, "utf-8")
    assert text in server.get(f"{boat}/channels").replace("&#39;", "'")
    assert "not usable" in server.get(f"{boat}/channels/checks")


def test_an_unexpected_error_is_a_message(server, project, monkeypatch):
    monkeypatch.setattr("hydrodamp.app.channels.read_files", lambda project: 1 / 0)
    status, headers, text = server.request("GET", f"{project}/channels")
    assert status == 500
    assert b"internal error: ZeroDivisionError" in text
    assert "script-src 'self'" in headers["Content-Security-Policy"]


def test_a_report_of_others_runs_no_script(server, project):
    (server.root / "dive.hydrodamp/evil.html").write_text("<script>1</script>", "utf-8")
    _, headers, _ = server.request("GET", f"{project}/file/evil.html")
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe-inline'; script-src 'sha256-" in policy


def test_overlap_is_told(server, project):
    page = server.post(f"{project}/split", train="0:100", test="50:200")
    assert "Training and test data share" in page


@pytest.mark.slow
def test_pages_write_nothing(server, project):
    before = version_of(server, project)
    pages = [
        server.get(f"{project}/{screen}") for screen in ("channels", "vehicle", "split", "run")
    ]
    assert version_of(server, project) == before
    assert 'hx-trigger="submit, load"' in pages[2]  # the page saves the default that it shows


def head_of(server, method, path, size):
    return (
        f"{method} {server.session.path}{path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
        f"Origin: {server.origin}\r\nCookie: hydrodamp={server.session.cookie}\r\n"
        f"Content-Length: {size}\r\n\r\n"
    ).encode()


@pytest.fixture
def short_uploads(monkeypatch):
    """No more than three bytes may be uploaded."""
    monkeypatch.setattr("hydrodamp.app.start.MAX_UPLOAD", 3)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("POST", "/open", 413), ("PUT", "/upload?name=a.csv", 413), ("PUT", "/nothing", 404)],
)
def test_an_answer_to_a_large_body_can_be_read(server, short_uploads, method, path, status):
    close = {"Connection": "close"}  # the rest of the body cannot be read after the answer
    body = b"x" * 30_000_000
    assert server.request(method, path, body=body, headers=close)[0] == status
    without = {"Cookie": "", **close}
    assert server.request(method, path, body=body[:MAX_FORM], headers=without)[0] == 403


def test_a_large_body_without_session_is_not_read_to_its_end(server):
    head = head_of(server, "PUT", "/upload?name=a.csv", 10 * MAX_FORM)
    server.session.cookie = "another"
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        connection.sendall(head + bytes(MAX_FORM + 1))
        answer = connection.recv(1000).lower()
    assert b" 403 " in answer
    assert b"connection: close" in answer


def test_uploads_are_bounded_together(server, short_uploads):
    assert server.request("PUT", "/upload?name=a.csv", body=b"12")[0] == 200
    status, _, text = server.request("PUT", "/upload?name=b.csv", body=b"12")
    assert status == 413
    assert b"logs/b.csv" in text
    assert server.request("PUT", "/upload?name=a.csv", body=b"12")[0] == 200
    assert [path.name for path in (server.root / "logs").iterdir()] == ["a.csv"]


def test_uploads_at_the_same_time_are_bounded_together(server, short_uploads):
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as connection:
        connection.sendall(head_of(server, "PUT", "/upload?name=a.csv", 2) + b"1")
        while not [*server.root.glob("logs/.*")]:
            time.sleep(0.01)
        assert server.request("PUT", "/upload?name=b.csv", body=b"12")[0] == 413
        connection.sendall(b"2")
        assert b" 200 " in connection.recv(1000)
    assert [path.read_bytes() for path in (server.root / "logs").iterdir()] == [b"12"]


@pytest.mark.parametrize(("method", "path"), [("POST", "/open"), ("PUT", "/upload?name=a.csv")])
def test_a_browser_that_goes_away_leaves_no_traceback(capfd, server, method, path):
    with socket.create_connection(("127.0.0.1", server.port)) as connection:
        connection.sendall(head_of(server, method, path, 1000) + b"x")
        while method == "PUT" and not [*server.root.glob("logs/.*")]:
            time.sleep(0.01)
    while [*server.root.glob("logs/.*")]:
        time.sleep(0.01)
    server.get("/")
    assert capfd.readouterr().err == ""


def no_space(*arguments, **options):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_upload_to_a_full_disk_is_refused_with_a_remedy(server, monkeypatch):
    real = Path.open

    def open_full(path, *arguments, **options):
        if not path.name.startswith(".hydrodamp-a"):
            return real(path, *arguments, **options)
        path.touch()
        return nullcontext(SimpleNamespace(write=no_space, truncate=int))

    monkeypatch.setattr(Path, "open", open_full)
    status, _, text = server.request("PUT", "/upload?name=a.csv", body=b"12")
    assert status == 422
    for words in ("logs/a.csv", os.strerror(errno.ENOSPC), "Free disk space"):
        assert words in text.decode()
    assert not [*(server.root / "logs").iterdir()]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "status"), [("open", 422), ("write_text", 200)])
def test_a_run_on_a_full_disk_is_refused_or_has_an_owner(
    server, canonical, monkeypatch, method, status
):
    project, started = open_log(server, canonical), []
    server.post(f"{project}/split", train="0:20", test="20:40")
    server.post(f"{project}/vehicle", source="fleet", name="vt690")
    job = SimpleNamespace(wait=lambda: 0, returncode=0, pid=1)
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **more: started.append(1) or job)
    real = getattr(Path, method)

    def fail(path, *arguments, **options):
        full = path.name.startswith(("compare", ".compare"))
        return (no_space if full else real)(path, *arguments, **options)

    monkeypatch.setattr(Path, method, fail)
    text = server.post(f"{project}/run/start", status)
    assert len(started) == (status == 200)
    said = server.get(f"{project}/run/status") if status == 200 else text
    assert ("Finished" if status == 200 else os.strerror(errno.ENOSPC)) in said
