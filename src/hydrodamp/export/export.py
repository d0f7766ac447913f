"""The verb: a vehicle's damping into files of a target, with the card of how faithful they are."""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from pathlib import Path

from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.export.fidelity import Fidelity, measured, some
from hydrodamp.export.folder import CARD, check_export, manifest_of, replace_export, save
from hydrodamp.export.plant import WITHIN_ONE, ExportedPlant
from hydrodamp.export.target import Target
from hydrodamp.export.targets import find_target
from hydrodamp.export.verification import VerificationRun, scattered
from hydrodamp.files import as_json
from hydrodamp.identification.dissipativity import OperatingBox, operating_box
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import read_label
from hydrodamp.vehicle.vehicle import Vehicle

WORST_ERROR = 100.0
"""Greatest wrench error of an axis [% of the rms of its damping]; no damping at all has 100 %."""


def export(
    damping: Damping,
    vehicle: Vehicle,
    target: str | Target,
    out: str | os.PathLike[str],
    *,
    log: Log | None = None,
    box: OperatingBox | None = None,
    force: bool = False,
) -> Fidelity:
    """Write a damping and its vehicle as files that a simulator or a controller reads.

    What was written is read back and run, and a card says how faithful it is; it lies beside the
    files as ``fidelity.json``.

    Parameters
    ----------
    damping : Damping
        Coefficients that belong to the vehicle.
    vehicle : Vehicle
        Mass, restoring forces and actuators. A log with a recorded wrench takes the place of
        the actuators: what is written is driven by a wrench then.
    target : str or Target
        A key of :data:`TARGETS`, or one of its values with other settings.
    out : str or path
        The folder; the files are written whole or not at all.
    log : Log, optional
        What the written model is driven with, and where terms are fitted that the target cannot
        hold.
    box : OperatingBox, optional
        The velocities that they are fitted at without a log, and that powers are looked at within;
        by default those of the log.
    force : bool, optional
        Replace the files of an earlier export, all others stay, and keep one whose wrench error is
        above 100 % on an axis with fitted terms, or whose replay diverges though that of its source
        does not.

    Returns
    -------
    fidelity : Fidelity
        The card.

    Raises
    ------
    ModelError
        If the coefficients belong to another vehicle, or cannot be exported.
    MethodError
        If there is no such target, terms would have to be fitted without any velocities, or the
        wrench error of a projection is above 100 %, or its replay diverges.
    FileError
        If the folder holds files that an earlier export did not write or that were edited since;
        without ``force`` if it holds an export at all.
    ProblemError
        If the log lacks what the model needs.

    Examples
    --------
    >>> import tempfile
    >>> from hydrodamp.models.published import published
    >>> from hydrodamp.vehicle.file import fleet
    >>> folder = tempfile.mkdtemp()
    >>> card = export(published["vt690-sname2022"], fleet["vt690"], "python", folder + "/sim")
    >>> card.exact
    True
    """
    form = find_target(target) if isinstance(target, str) else target
    folder = Path(out)
    check_export(folder, force)
    craft = ExportedPlant.of(vehicle, damping, log)
    drive = None if log is None else VerificationRun.of(craft, log)
    where = box or (WITHIN_ONE if drive is None else operating_box(drive.problem))
    craft = replace(craft, box=where)
    at = scattered(craft) if drive is None else drive.states
    if (lost := form.unrepresented_effects(craft)) and log is None and box is None:
        raise MethodError(
            f"'{form.key}' cannot hold {some(lost)}: their wrench is to be fitted at "
            "velocities, and there are none. Give a log."
        )
    held = form.project(craft, at)
    beside = folder.resolve().parent
    beside.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hydrodamp-", dir=beside) as place:
        made, files = Path(place, "export"), form.write(held)
        save(files, made)
        card = measured(form, craft, held, at, drive, made)
        if not force:
            _check_replay(card)
            _check_wrench(card)
        document = {**card.document(), "files": manifest_of(files)}
        save({CARD: as_json(document)}, made)
        replace_export(folder, made, files, Path(place, "earlier"))
    return card


def _check_wrench(card: Fidelity) -> None:
    """Refuse a projection that is worse on an axis than no damping at all.

    On an axis whose terms are all held the error is of the mass matrix: no other model mends it.
    """
    errors, projected = card.wrench_error, {read_label(label)[0] for label in card.projected}
    worse = [f"{x} {errors[x]:.3g} %" for x in errors if x in projected and errors[x] > WORST_ERROR]
    if worse:
        raise MethodError(
            f"'{card.target}' would have a wrench error of {', '.join(worse)} of the damping's "
            "rms; no damping at all has 100 %. Nothing is written: take a target or a "
            "model that fits, or say --force."
        )


def _check_replay(card: Fidelity) -> None:
    """Refuse a projection whose replay diverges where that of its source does not."""
    if card.exact or card.replays is None:
        return
    found = card.replays
    if found.target_to_log.diverged and not found.source_to_log.diverged:
        name, time = found.target_to_log.diverged[0]
        worst = max(card.wrench_error.values())
        raise MethodError(
            f"'{card.target}' cannot hold {some(card.projected)}, and with what takes their "
            f"place the replay diverges {time:.1f} s into segment '{name}' (wrench error up to "
            f"{worst:.3g} %); the source's does not. Nothing is written: identify a model that the "
            "target can hold, or say --force."
        )
