"""Projects are files below one folder; an outdated edit is refused."""

import pytest

from hydrodamp.app.project import (
    MAPPING,
    OutdatedEditError,
    create_project,
    find_project,
    find_project_of,
    list_logs,
    list_projects,
    resolve_log,
)
from hydrodamp.errors import FileError


@pytest.fixture
def root(tmp_path):
    for name in ("a.csv", "b.csv", "a+b.csv", "notes.pdf", "sub/c.mcap", "a.hydrodamp/x.csv"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("t,u\n0,1\n", "utf-8")
    return tmp_path.resolve()


def test_logs_are_those_of_the_folder_and_not_of_projects(root):
    assert list_logs(root) == ["a.csv", "b.csv", "sub/c.mcap"]


def test_the_same_logs_are_the_same_project(root):
    first = create_project(root, ("b.csv",))
    assert find_project_of(root, ("b.csv",)) == first
    assert find_project_of(root, ("a.csv",)) is None
    other = create_project(root, ("b.csv", "a.csv"))
    assert (first.name, other.name) == ("b", "b-2")
    assert {each.name for each in list_projects(root)} == {"b", "b-2"}


@pytest.mark.parametrize(
    "path", ["../secret.csv", "/etc/passwd", "", "a.csv+/etc/passwd", "no.csv"]
)
def test_paths_outside_the_folder_are_refused(root, path, refused):
    refused(FileError, resolve_log, root, path)


@pytest.mark.parametrize("name", ["..", "../a", "a/../b", "nothing"])
def test_a_project_is_found_by_its_name_alone(root, name, refused):
    refused(FileError, find_project, root, name)


def test_an_edit_of_an_earlier_version_is_refused_and_loses_nothing(root, refused):
    project = create_project(root, ("a.csv",))
    version = project.version
    project.write(version, {MAPPING: "time: t\n"})
    refused(OutdatedEditError, project.write, version, {MAPPING: "time: other\n"})
    refused(OutdatedEditError, project.update, version, vehicle="lauv")
    assert project.text(MAPPING) == "time: t\n"
    project.update(project.version, vehicle="lauv")
    assert project.arguments.vehicle == "lauv"
