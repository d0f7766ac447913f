"""Real logs, where their folder is at hand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def folder(name: str) -> Path:
    near = Path(__file__).resolve().parents[3].parent / "shared" / "data"
    place = Path(os.environ.get("HYDRODAMP_DATA", near)) / name
    if not place.is_dir():
        pytest.skip(f"{name} is not here; name the folder that holds it in HYDRODAMP_DATA")
    return place


@pytest.fixture(scope="session")
def kvlcc2_runs() -> list[Path]:
    """The zigzags of the tanker model."""
    return sorted(folder("kvlcc2_hsva").glob("HSVA_*.dat"))


@pytest.fixture(scope="session")
def vt690_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The raw topics of the 690's field log, with the derived log beside them."""
    return folder("vt690_field")
