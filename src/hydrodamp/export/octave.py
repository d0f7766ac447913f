"""GNU Octave and MATLAB: the form of the Marine Systems Simulator."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.io import loadmat, savemat

from hydrodamp.arrays import FloatArray
from hydrodamp.export.compiling import version_of
from hydrodamp.export.craft import Craft, States
from hydrodamp.export.drive import LONGEST_STEP, Drive
from hydrodamp.export.frames import upright
from hydrodamp.export.printer import OCTAVE, name_of, printed, said_of
from hydrodamp.export.target import RUNGE_KUTTA, Engine, Files, NotRun, Target, rendered
from hydrodamp.simulation.replay import LIMIT


@dataclass(frozen=True)
class Octave(Target):
    """Two functions for GNU Octave and MATLAB, in the form of the Marine Systems Simulator."""

    key: ClassVar[str] = "octave"
    meant: ClassVar[str] = "GNU Octave, MATLAB and the Marine Systems Simulator"

    def write(self, craft: Craft) -> Files:
        """Return the function of the state's rate, and that of the wrench."""
        said, name = said_of(craft, "\n    ", "{}"), name_of(craft)
        lines = printed(craft, OCTAVE)
        return {
            f"{name}.m": rendered("octave.m.j2", **said),
            f"{name}_tau.m": rendered("octave_tau.m.j2", **said, lines=lines),
        }

    def read(self, folder: Path, craft: Craft) -> Engine:
        """Run the files in Octave."""
        program = next((name for name in ("octave-cli", "octave") if shutil.which(name)), None)
        if program is None:
            raise NotRun("GNU Octave is not installed")

        def run(**given: Any) -> FloatArray:
            with tempfile.TemporaryDirectory() as place:
                words = {"name": name_of(craft), "given": f"{place}/given", "made": f"{place}/made"}
                savemat(words["given"], given, appendmat=False)
                script = Path(place, "run.m")
                script.write_text(rendered("octave_run.m.j2", **words), encoding="utf-8")
                call = [program, "--no-init-file", "--quiet", "--path", str(folder), str(script)]
                done = subprocess.run(call, capture_output=True, text=True, check=False)
                if done.returncode:
                    raise NotRun(f"{program} refused it: {done.stderr.strip()}")
                return np.asarray(loadmat(words["made"], appendmat=False)["rates"])

        def rates(at: States) -> FloatArray:
            still = np.zeros((len(at.velocity), 3))
            states = np.column_stack([at.velocity, still, upright(at.down)])
            return run(states=states, inputs=at.inputs, wrench=at.wrench)

        def replay(drive: Drive) -> FloatArray:
            bounds, given = drive.log.bounds, drive.states
            first = bounds[:, 0]
            still = np.zeros((len(bounds), 3))
            start = np.column_stack([given.velocity[first], still, drive.attitude[first]])
            return run(
                time=drive.log.time,
                bounds=bounds.astype(float),
                start=start,
                inputs=given.inputs,
                wrench=given.wrench,
                longest=LONGEST_STEP,
                limit=LIMIT,
            )

        return Engine(version_of(program), RUNGE_KUTTA, rates, replay)
