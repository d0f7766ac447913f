"""The functions for Octave: the core's accelerations, states with angles and a current."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.export.scripts import Octave
from hydrodamp.export.verification import attitude_quaternions

from .conftest import PAPER, write_export

PROGRAM = shutil.which("octave-cli") or shutil.which("octave")
here = pytest.mark.skipif(PROGRAM is None, reason="Octave is not installed")


def run_octave(folder, *words):
    subprocess.run([PROGRAM, "--no-init-file", "--quiet", *words], cwd=folder, check=True)


@here
def test_angles_and_a_current(tmp_path):
    write_export(Octave(), PAPER, tmp_path)
    # With the current, heading north: still in the water, whatever the state is written in.
    lines = (
        "x = [0 0.5 0 0 0 0.2 0 0 0 0.1 0.3 0]';",
        "cr = cos(0.05); sr = sin(0.05); cp = cos(0.15); sp = sin(0.15);",
        "q = [cr*cp; sr*cp; cr*sp; -sr*sp];",
        "a = auv_vt690(x, [0 0 0]', 0.5, pi/2); b = auv_vt690([x(1:9); q], [0 0 0]', 0.5, pi/2);",
        "assert(a(1:9), b(1:9), 1e-14);",
        "c = auv_vt690([0 0.5 zeros(1, 10)]', [0 0 0]', 0.5, pi/2);",
        "assert(c(1:6), zeros(6, 1), 1e-30); assert(c(8), 0.5);",
        "[~, U, M] = auv_vt690(x); assert(U, 0.5); assert(rows(M), 6);",
    )
    run_octave(tmp_path, "--eval", " ".join(lines))


@here
def test_what_the_page_shows_runs(tmp_path):
    write_export(Octave(), PAPER, tmp_path)
    page = Path(__file__).parents[2] / "docs" / "how-to" / "export" / "octave.md"
    shown = page.read_text("utf-8").split("```matlab\n")[1].split("```")[0]
    (tmp_path / "page.m").write_text(shown)
    run_octave(tmp_path, "page.m")


def test_a_down_direction_has_an_attitude():
    directions = np.random.default_rng(0).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[:3] = [0, 0, 1], [0, 0, -1], [1, 0, 0]
    longer = 1.02 * directions  # between two samples lengths are not one
    w, x, y, z = attitude_quaternions(longer).T
    found = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    np.testing.assert_allclose(np.transpose(found), longer, atol=1e-15)
