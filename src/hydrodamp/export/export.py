"""Export: render a damping and its vehicle for a target, verify the files, write card and files."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import FileError, MethodError, demand, no_such
from hydrodamp.export.c99 import FMU, C
from hydrodamp.export.coefficients import URDF, UUV, MarineGym, Stonefish
from hydrodamp.export.fidelity import Fidelity, first_labels, measure_fidelity
from hydrodamp.export.gazebo import VRX, GzSim
from hydrodamp.export.optimisers import JAX, Acados, DoMPC, PyTorch
from hydrodamp.export.planar import complete_log, complete_plant
from hydrodamp.export.plant import UNIT_BOX, ExportedPlant
from hydrodamp.export.ros2_package import Ros2Package
from hydrodamp.export.scripts import CasADi, MuJoCo, Octave, Python
from hydrodamp.export.sitl import SITL
from hydrodamp.export.target import Files, Target, save_files
from hydrodamp.export.verification import Engine, VerificationRun, sample_states
from hydrodamp.files import as_json, load_json, load_text
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    max_damping_power,
    operating_box,
    velocity_unit,
)
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.predicted_error import predict_error
from hydrodamp.models.damping import Damping, draw_coefficients
from hydrodamp.models.model import read_label
from hydrodamp.results import MANIFEST, check_results, save_results
from hydrodamp.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

CARD, PAGE = "fidelity.json", "fidelity.html"
"""Names of the fidelity card in the folder of an export, and of its page."""

MAX_WRENCH_ERROR = 100.0
"""Greatest wrench error of an axis [% of the rms of its damping]; no damping at all has 100 %."""


def export(
    damping: Damping,
    vehicle: Vehicle,
    target: str | Target,
    out: str | os.PathLike[str],
    *,
    log: Log | None = None,
    box: OperatingBox | None = None,
    fit: Fit | None = None,
    force: bool = False,
) -> Fidelity:
    """Write a damping and its vehicle as files that a simulator or a controller reads.

    The files are read back and run. A fidelity card states their errors; it is written as
    ``fidelity.json`` into the same folder.

    Parameters
    ----------
    damping : Damping
        Coefficients that belong to the vehicle.
    vehicle : Vehicle
        Mass, restoring forces and actuators. If the log has a recorded wrench, the actuators are
        left out, and a wrench is the input of the exported model. ``gz-sim``, ``vrx`` and
        ``mujoco`` simulate six axes: of a vehicle with the axes X, Y and N alone, they assume what
        its file does not have of the others, and the card states it.
    target : str or Target
        A key of :data:`TARGETS`, or one of its values with other settings.
    out : str or path
        The folder; the files are written whole or not at all.
    log : Log, optional
        Commands and velocities of the verification run. Terms that the target cannot represent are
        projected at its samples.
    box : OperatingBox, optional
        Velocities [m/s, rad/s] at which terms are projected without a log, and where the greatest
        power of the damping is searched; by default those of the log.
    fit : Fit, optional
        The fit of the damping: with a log and a covariance, the card states the predicted error.
    force : bool, optional
        Replace the files of an earlier export (other files stay), and accept an export whose
        wrench error is above 100 % on an axis with projected terms, or whose replay diverges while
        that of the source does not.

    Returns
    -------
    fidelity : Fidelity
        The card.

    Raises
    ------
    ModelError
        If the coefficients belong to another vehicle, or cannot be exported.
    MethodError
        If there is no such target, terms must be projected and neither ``log`` nor ``box`` is
        given, or the wrench error of a projection is above 100 %, or its replay diverges.
    FileError
        If the folder holds files that an earlier export did not write or that were edited since;
        without ``force`` if it holds an export at all.
    ProblemError
        If the log lacks what the model needs.

    Examples
    --------
    >>> import tempfile
    >>> from hydrodamp.models.catalog import published
    >>> from hydrodamp.vehicle.file import fleet
    >>> folder = tempfile.mkdtemp()
    >>> card = export(published["vt690-sname2022"], fleet["vt690"], "python", folder + "/sim")
    >>> card.exact
    True
    """
    form = find_target(target) if isinstance(target, str) else target
    folder = Path(out)
    check_export(folder, force)
    plant, assumed = ExportedPlant.of(vehicle, damping, log), tuple[str, ...]()
    driven = None if log is None else plant.scale_wrench(log)
    if form.completes_planar:
        plant, assumed = complete_plant(plant)
        driven = complete_log(driven) if assumed and driven is not None else driven
    run = None if driven is None else VerificationRun.of(plant, driven)
    default_box = UNIT_BOX if run is None else operating_box(run.problem)
    reservations = () if fit is None else tuple(list_reservations(fit))
    plant = replace(plant, box=box or default_box, reservations=reservations)
    at = sample_states(plant) if run is None else run.states
    if (labels := form.unrepresented_effects(plant)) and log is None and box is None:
        raise MethodError(
            f"'{form.key}' cannot represent {first_labels(labels)}: their wrench must be projected "
            "at velocities of a log, and no log is given. Give a log."
        )
    projected = form.project_plant(plant, at)
    files = form.render_files(projected)
    band = None
    if fit is not None and log is not None and fit.damping.covariance is not None:
        band = predict_error(vehicle, fit, log)
    with tempfile.TemporaryDirectory() as verification_folder:
        contents = save_files(files, Path(verification_folder))
        checked = Path(verification_folder)
        card = measure_fidelity(form, plant, projected, at, run, checked, band)
    card = replace(card, assumed=assumed, reservations=reservations)
    if band is not None:
        sizes = band.rms_by_axis(vehicle.axes, "deg")
        card = replace(card, predicted_error=sizes, extrapolated=band.extrapolated)
    if not force:
        _check_replay(card)
        _check_wrench(card)
    digests = {path: sha256(content).hexdigest() for path, content in contents.items()}
    contents[CARD] = as_json({**card.document(), "files": digests}).encode("utf-8")
    results = {folder / path: content for path, content in contents.items()}
    save_results(results, folder, obsolete=(*_earlier_files(folder), PAGE))
    return card


def list_reservations(fit: Fit) -> Iterator[str]:
    """Yield what limits the use of a fit: status, form of the model, and range of velocities."""
    if fit.status not in {Status.OK, Status.CONVERGED}:
        yield f"Its estimate: {fit.status.word}."
    if fit.adequacy is None:
        yield f"Form: not tested by the method {fit.method}."
    else:
        yield from fit.adequacy.describe(fit.model.key)
    ranges = [
        f"{name} {low:.3g} to {high:.3g} {velocity_unit(name)}"
        for name, (low, high) in fit.training_range.items()
    ]
    if ranges:
        yield f"Velocities of its training data: {', '.join(ranges)}; others are not tested."


def check_export(folder: Path, force: bool) -> None:
    """Refuse a folder with other files than an export's, or without ``force`` with an export."""
    check_results(folder, (CARD, PAGE), force)
    files = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    if files - {MANIFEST} and CARD not in files:
        raise FileError(f"{folder}: holds files that are no export; name a new folder.")
    check_results(folder, _earlier_files(folder), force)


def _earlier_files(folder: Path) -> list[str]:
    """Return the files of the export that is in a folder, by its card."""
    card = load_json(folder / CARD) if (folder / CARD).is_file() else {}
    files = card.get("files") if isinstance(card, dict) else None
    return [CARD, *files] if isinstance(files, dict) else []


def _check_wrench(card: Fidelity) -> None:
    """Refuse a projection that is worse on an axis than no damping at all.

    The error of an axis without projected terms is one of the mass matrix: no model reduces it.
    """
    errors, projected = card.wrench_error, {read_label(label)[0] for label in card.projected}
    worse = [
        f"{axis} {error:.3g} %"
        for axis, error in errors.items()
        if axis in projected and error > MAX_WRENCH_ERROR
    ]
    if worse:
        raise MethodError(
            f"'{card.target}' would have a wrench error of {', '.join(worse)} of the damping's "
            "rms; no damping at all has 100 %. Nothing is written: choose another target, or "
            "another model, or use --force."
        )


def _check_replay(card: Fidelity) -> None:
    """Refuse a projection whose replay diverges where that of its source does not."""
    if card.exact or card.replays is None:
        return
    replays = card.replays
    if replays.target_to_log.diverged and not replays.source_to_log.diverged:
        name, time = replays.target_to_log.diverged[0]
        error = max(card.wrench_error.values())
        raise MethodError(
            f"'{card.target}' cannot represent {first_labels(card.projected)}, and with the "
            f"projected terms the replay diverges {time:.1f} s into segment '{name}' (wrench error "
            f"up to {error:.3g} %); that of the source does not. Nothing is written: identify a "
            "model that the target can represent, or use --force."
        )


_ROBOTS = GzSim, Ros2Package, VRX, MuJoCo, UUV, URDF, MarineGym, Stonefish
_OPTIMISERS = CasADi, JAX, PyTorch, Acados, DoMPC
_SINGLE_TARGETS = Python, C, Octave, *_OPTIMISERS, FMU, *_ROBOTS, SITL
SINGLE_TARGETS: dict[str, Target] = {target.key: target() for target in _SINGLE_TARGETS}
"""The targets that write one plant, by their keys, with default settings."""

DRAWS_FILE = "draws.csv"
MAX_ATTEMPTS = 20  # samples per draw that must be dissipative


@dataclass(frozen=True)
class Randomisation(Target):
    """Draws of the coefficients from the covariance of a fit, for domain randomisation.

    Parameters
    ----------
    draws : int
        Number of draws.
    form : str
        Key of the target that each draw is also written for; empty for the table alone.
    dissipative : bool
        Whether to reject draws whose damping injects energy within the operating box.
    seed : int
        Seed of the random numbers.
    """

    key: ClassVar[str] = "randomisation"
    description: ClassVar[str] = "domain randomisation"
    draws: int = 100
    form: str = ""
    dissipative: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the number of draws and the target."""
        demand(self.draws > 0, "draws", "at least 1", f"{self.draws}.")
        known = not self.form or self.form in SINGLE_TARGETS
        demand(known, "form", f"one of {', '.join(SINGLE_TARGETS)}", f"'{self.form}'.")

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the table, the estimate first, and the files of each draw."""
        form = SINGLE_TARGETS.get(self.form)
        if form is not None and (labels := form.unrepresented_effects(plant)):
            raise MethodError(
                f"'{self.form}' cannot represent {', '.join(labels)}, and draws are not projected: "
                "choose a form that has every term, or identify a model that it can represent."
            )
        damping, generator = plant.damping, np.random.default_rng(self.seed)
        draws = accept_draws(plant, self.draws, generator, dissipative=self.dissipative)
        table = [("draw", *damping.model.labels), ("estimate", *damping.coefficients.tolist())]
        table += [(str(number), *row.tolist()) for number, row in enumerate(draws, start=1)]
        text = "".join(f"{','.join(map(str, row))}\n" for row in table)
        files: dict[str, str | bytes] = {DRAWS_FILE: text}
        if form is not None:
            for number, row in enumerate(draws, start=1):
                rendered = form.render_files(_replace_coefficients(plant, row))
                files |= {f"{number:04d}/{path}": content for path, content in rendered.items()}
        return files

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Read the table back and yield equation 1 with the estimate in it."""
        lines = load_text(folder / DRAWS_FILE).split("\n")
        labels, estimate = (line.split(",")[1:] for line in lines[:2])
        values = dict(zip(labels, map(float, estimate), strict=True))
        damping = Damping.from_dict(plant.damping.model, values)
        engine = replace(plant, damping=damping).acceleration
        yield Engine("hydrodamp, the estimate of the table", engine)


def accept_draws(
    plant: ExportedPlant, n: int, generator: np.random.Generator, *, dissipative: bool
) -> list[FloatArray]:
    """Return n samples of the normal distribution of a fit, rejecting energy injection if asked."""
    attempts = n * (MAX_ATTEMPTS if dissipative else 1)
    samples = draw_coefficients(plant.damping, attempts, generator)
    accepted = (row for row in samples if not dissipative or _is_dissipative(plant, row))
    draws = [*islice(accepted, n)]
    if len(draws) < n:
        raise MethodError(
            f"only {len(draws)} of {attempts} draws dissipate at all velocities searched in "
            f"{plant.box}; {n} are required. Identify by `dissipative`, or reduce `draws`."
        )
    return draws


def _replace_coefficients(plant: ExportedPlant, coefficients: FloatArray) -> ExportedPlant:
    return replace(plant, damping=replace(plant.damping, coefficients=coefficients))


def _is_dissipative(plant: ExportedPlant, coefficients: FloatArray) -> bool:
    damping = _replace_coefficients(plant, coefficients).damping
    return max_damping_power(damping, plant.box).power <= 0.0


TARGETS: dict[str, Target] = {**SINGLE_TARGETS, Randomisation.key: Randomisation()}
"""The targets by their keys, with default settings."""


def find_target(key: str) -> Target:
    """Return the target of a key.

    Parameters
    ----------
    key : str
        Such as ``"python"``.

    Returns
    -------
    target : Target
        With default settings.

    Raises
    ------
    MethodError
        If there is no such target; the message names the most similar key.

    Examples
    --------
    >>> find_target("python").key
    'python'
    """
    if key not in TARGETS:
        raise MethodError(no_such("target", key, TARGETS))
    return TARGETS[key]
