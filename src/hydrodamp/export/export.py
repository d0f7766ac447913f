"""The verb: a vehicle's damping into files of a target, with the card of how faithful they are."""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from pathlib import Path

from hydrodamp.data.log import Log
from hydrodamp.errors import FileError, MethodError
from hydrodamp.export.craft import WITHIN_ONE, Craft
from hydrodamp.export.drive import Drive, scattered
from hydrodamp.export.fidelity import Fidelity, measured, some
from hydrodamp.export.target import Files, Target
from hydrodamp.export.targets import find_target
from hydrodamp.files import as_json, check_folder, save_all
from hydrodamp.identification.power import OperatingBox, operating_box
from hydrodamp.models.damping import Damping
from hydrodamp.vehicle.vehicle import Vehicle

CARD = "fidelity.json"
"""The card's name in the folder of an export."""


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
        The folder; written whole or not at all.
    log : Log, optional
        What the written model is driven with, and where terms are fitted that the target cannot
        hold.
    box : OperatingBox, optional
        The velocities that they are fitted at without a log, and that powers are looked at within;
        by default those of the log.
    force : bool, optional
        Replace an earlier export, and keep one whose replay diverges though that of its source
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
        replay diverges.
    FileError
        If the folder is there already.
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
    craft = Craft.of(vehicle, damping, log)
    drive = None if log is None else Drive.of(craft, log)
    where = box or (WITHIN_ONE if drive is None else operating_box(drive.problem))
    craft = replace(craft, box=where)
    at = scattered(craft) if drive is None else drive.states
    if (lost := form.lost(craft)) and log is None and box is None:
        raise MethodError(
            f"'{form.key}' cannot hold {some(lost)}: their wrench is to be fitted at "
            "velocities, and there are none. Give a log."
        )
    held = form.held(craft, at)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hydrodamp-", dir=folder.parent.resolve()) as place:
        made = Path(place, "export")
        save(form.write(held), made)
        card = measured(form, craft, held, at, drive, made)
        _check_replay(card, force)
        save({CARD: as_json(card.document())}, made)
        _replace(folder, made, Path(place, "earlier"))
    return card


def check_export(folder: Path, force: bool) -> None:
    """Refuse a folder that cannot be written, or that holds anything but an earlier export."""
    check_folder(folder)
    if folder.is_symlink() or Path.cwd().is_relative_to(folder.resolve()):
        which = "is a link" if folder.is_symlink() else "is the folder that you are in"
        raise FileError(f"{folder}: {which}, and an export takes its folder's place; name another.")
    if folder.exists() and any(folder.iterdir()):
        if not (folder / CARD).is_file():
            raise FileError(f"{folder}: holds what is no export of hydrodamp; name a new folder.")
        if not force:
            raise FileError(f"{folder}: holds an earlier export; name another, or say --force.")


def _replace(folder: Path, made: Path, earlier: Path) -> None:
    """Put what was made in the place of an earlier export, which stays if that fails."""
    if folder.exists():
        folder.rename(earlier)
    try:
        made.rename(folder)
    except OSError as error:
        if earlier.exists():
            earlier.rename(folder)
        raise FileError(f"{folder}: cannot be written: {error.strerror}.") from error


def _check_replay(card: Fidelity, force: bool) -> None:
    """Refuse a projection whose replay diverges where that of its source does not."""
    if card.exact or card.replays is None or force:
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


def save(files: Files, folder: Path) -> None:
    """Write the files of an export into its folder, whole or not at all."""
    save_all(
        {
            folder / path: content.encode("utf-8") if isinstance(content, str) else content
            for path, content in files.items()
        }
    )
