"""Projects: folders with the files and the arguments of the commands that a browser edits.

The state of a project is ``mapping.yaml``, ``vehicle.yaml``, ``model.yaml`` and ``project.yaml``
(logs, vehicle, models, methods, training and test data). Its version is the digest of these
files; an edit of another version than the one on disk is refused.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from threading import RLock
from types import MappingProxyType
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field

from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.faults import validate
from hydrodamp.files import load_text, load_yaml, save_all
from hydrodamp.identification.general_model import GENERAL_KEY
from hydrodamp.ingest.formats.files import FORMATS, SUFFIXES, format_of, suffix_of

#: Suffix of the folder of a project.
SUFFIX = ".hydrodamp"

PROJECT, MAPPING, VEHICLE, MODEL = "project.yaml", "mapping.yaml", "vehicle.yaml", "model.yaml"
RESULTS, EXPORTS, PLAN, ENVELOPE = "results", "exported", "plan", "envelope.yaml"

#: Files that are the state of a project.
STATE = (PROJECT, MAPPING, VEHICLE, MODEL)

#: Characters of the name of a project.
MAX_NAME = 80

#: Models that are selected in a new project.
DEFAULT_MODELS = (GENERAL_KEY, "linear", "fossen", "prestero")

_lock = RLock()


class Arguments(BaseModel):
    """Arguments of the commands, and the gains of the models, which are no other files.

    The vehicle is a name of the fleet, or ``vehicle.yaml``; gains are commands by axis; sizes are
    what was entered for an estimate.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    logs: Annotated[tuple[str, ...], Field(min_length=1)]
    vehicle: str = ""
    sizes: dict[str, str] = {}
    gains: dict[Literal["X", "Y", "Z", "K", "M", "N"], str] = {}
    models: tuple[str, ...] = DEFAULT_MODELS
    methods: tuple[str, ...] = ("recommended",)
    train: tuple[str, ...] = ()
    test: tuple[str, ...] = ()


class OutdatedEditError(ProblemError):
    """An edit of files that have changed since the page was made."""


@dataclass(frozen=True)
class Project:
    """A folder below the folder that the server was started in."""

    root: Path
    name: str

    @property
    def folder(self) -> Path:
        """The folder of the project."""
        return self.root / f"{self.name}{SUFFIX}"

    def path(self, name: str) -> Path:
        """Return the path of a file of the project."""
        return self.folder / name

    def argument(self, name: str) -> str:
        """Return a path of the project as in a command that is run in the root."""
        return f"{self.name}{SUFFIX}/{name}"

    @property
    def arguments(self) -> Arguments:
        """The arguments of the commands."""
        path = self.path(PROJECT)
        content = load_yaml(path)
        if not isinstance(content, dict):
            raise FileError(f"{path}: must be keys and values, such as `logs: [dive.csv]`")
        return validate(Arguments, content, str(path), FileError)

    @property
    def version(self) -> str:
        """The digest of the state."""
        digest = hashlib.sha256()
        for name in STATE:
            path = self.path(name)
            digest.update(path.read_bytes() if path.is_file() else b"")
            digest.update(b"\0")
        return digest.hexdigest()[:16]

    def text(self, name: str) -> str:
        """Return the text of a file of the project, empty without one."""
        return load_text(self.path(name)) if self.path(name).is_file() else ""

    def write(self, version: str, contents: Mapping[str, str]) -> None:
        """Write files, each whole, if the state still has a version; the arguments come last."""
        with _lock:
            if version != self.version:
                raise OutdatedEditError(
                    "the project was changed in another tab or editor since this page was made: "
                    "copy what you have typed, reload the page, then repeat the change"
                )
            save_all({self.path(name): text.encode("utf-8") for name, text in contents.items()})

    def update(
        self, version: str, contents: Mapping[str, str] = MappingProxyType({}), **changes: object
    ) -> None:
        """Write files, and change arguments."""
        with _lock:
            arguments = self.arguments.model_copy(update=changes)
            self.write(version, {**contents, PROJECT: format_arguments(arguments)})

    @property
    def mapping(self) -> str | None:
        """The mapping as an argument, None without one."""
        return self.argument(MAPPING) if self.path(MAPPING).is_file() else None

    @property
    def log_paths(self) -> tuple[str, ...]:
        """Paths of the logs, which are below the root."""
        return tuple(
            "+".join(str(self.root / relative_path(self.root, each)) for each in log.split("+"))
            for log in self.arguments.logs
        )


def format_arguments(arguments: Arguments) -> str:
    """Return the text of ``project.yaml``."""
    content = {name: list(v) if isinstance(v, tuple) else v for name, v in arguments}
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True))


def list_projects(root: Path) -> list[Project]:
    """Return the projects below a folder, the most recently changed first."""
    paths = [path for path in root.glob(f"*{SUFFIX}/{PROJECT}") if path.is_file()]
    paths.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    return [Project(root, path.parent.name.removesuffix(SUFFIX)) for path in paths]


def find_project(root: Path, name: str) -> Project:
    """Return a project by its name."""
    for project in list_projects(root):
        if project.name == name:
            return project
    raise FileError(f"there is no project `{name}` in {root}")


def create_project(root: Path, logs: tuple[str, ...]) -> Project:
    """Create a project of logs."""
    project = _make_folder(root, Path(logs[0].split("+")[0]).stem)
    text = format_arguments(Arguments(logs=logs))
    save_all({project.path(PROJECT): text.encode("utf-8")})
    return project


def _make_folder(root: Path, stem: str) -> Project:
    """Create the folder of a new project, with a number where its name is in use."""
    stem = re.sub(r"[^\w.-]+", "-", stem)[:MAX_NAME].strip("-.") or "log"
    for number in count(1):
        project = Project(root, stem if number == 1 else f"{stem}-{number}")
        with suppress(FileExistsError):
            project.folder.mkdir()
            break
    return project


def duplicate_project(project: Project) -> Project:
    """Copy a project with its results."""
    copy = _make_folder(project.root, f"{project.name}-copy")
    shutil.copytree(project.folder, copy.folder, dirs_exist_ok=True)
    return copy


def rename_project(project: Project, name: str) -> Project:
    """Give a project another name."""
    new = _make_folder(project.root, name)
    new.folder.rmdir()
    project.folder.rename(new.folder)
    return new


def find_project_of(root: Path, logs: tuple[str, ...]) -> Project | None:
    """Return the project of logs, None without one."""
    for project in list_projects(root):
        with suppress(HydrodampError):  # another project may be damaged
            if project.arguments.logs == logs:
                return project
    return None


def resolve_log(root: Path, text: str) -> str:
    """Return the path of a log, or of several joined by +, relative to the root."""
    return "+".join(relative_path(root, each.strip()) for each in text.split("+"))


def relative_path(root: Path, text: str) -> str:
    """Return a path below the root, relative to it."""
    try:
        path = (root / Path(text).expanduser()).resolve()
        exists = path.exists()
    except (OSError, RuntimeError, ValueError) as error:
        raise FileError(f"{text[:100]}: is no path: {error}") from error
    if not text or not path.is_relative_to(root):
        raise FileError(
            f"{text or 'the path'}: must be a file below {root}, where `hydrodamp app` was started"
        )
    if not exists:
        raise FileError(f"{text}: there is no such file below {root}")
    relative = path.relative_to(root).as_posix()
    return f"./{relative}" if relative.startswith("-") else relative


#: Files listed, and levels of folders.
MAX_LISTED, MAX_DEPTH = 200, 3


def list_logs(root: Path) -> list[str]:
    """Return files below a folder that may be logs."""
    paths = sorted(
        path.relative_to(root).as_posix() for path in _walk(root, 0) if _may_be_log(path)
    )
    return paths[:MAX_LISTED]


def _may_be_log(path: Path) -> bool:
    """Return whether a file is no text of a program, as the output of the app in ``app.log``."""
    with suppress(HydrodampError, OSError):  # opening a damaged one says what is wrong
        return suffix_of(path) != ".log" or format_of(path) is not FORMATS[-1]
    return True


def _walk(folder: Path, depth: int) -> Iterator[Path]:
    try:
        inside = sorted(folder.iterdir())
    except OSError:  # not readable
        return
    for path in inside:
        if path.name.startswith(".") or path.name.endswith(SUFFIX) or path.is_symlink():
            continue
        if path.is_dir() and depth < MAX_DEPTH:
            yield from _walk(path, depth + 1)
        elif suffix_of(path) in SUFFIXES and "+" not in path.name:  # + joins files
            yield path
