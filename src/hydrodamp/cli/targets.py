"""Where ``--out`` may point: somewhere that can be written and is no input."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hydrodamp.errors import FileError


def check_out_file(out: str, inputs: Iterable[str | None]) -> None:
    """Refuse a file that cannot be written or would replace an input."""
    from hydrodamp.files import check_file

    for path in _files(inputs):
        if _same(Path(out), path):
            raise FileError(
                f"`--out {out}` is one of the inputs and would be replaced: name another file."
            )
    check_file(out)


def check_out_folder(out: str, inputs: Iterable[str | None]) -> None:
    """Refuse a folder that cannot be written or whose files would replace an input."""
    from hydrodamp.files import check_folder
    from hydrodamp.report.files import is_result

    folder = Path(out)
    for path in _files(inputs):
        if _same(folder, path):
            raise FileError(f"`--out {out}` is one of the inputs: name a folder of its own.")
        if is_result(path.resolve(), folder.resolve()):
            raise FileError(
                f"`--out {out}` would replace the input {path}: name a folder of its own."
            )
    if folder.is_file():
        raise FileError(f"`--out {out}` is a file: name a folder, new or there already.")
    check_folder(folder)


def check_new_file(out: str, force: bool) -> None:
    """Refuse a file that cannot be written, or is there already and may hold work of a person."""
    from hydrodamp.files import check_file

    check_file(out)
    if Path(out).exists() and not force:
        raise FileError(f"{out}: is there already; name another file, or say --force.")


def _files(inputs: Iterable[str | None]) -> list[Path]:
    return [Path(name) for name in inputs if name and Path(name).is_file()]


def _same(one: Path, other: Path) -> bool:
    """Tell whether two paths are one file, by whatever links or spellings."""
    return one.resolve() == other.resolve() or (one.exists() and one.samefile(other))
