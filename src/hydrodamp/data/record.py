"""What was recorded, sample by sample, before it is checked and split."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.basis.command_names import check_command_name
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.blocks import BLOCKS
from hydrodamp.errors import LogError, TermError, did_you_mean


@dataclass(frozen=True, eq=False)
class Record:
    """Columns of one recording, not yet checked."""

    time: FloatArray
    velocity: FloatArray
    velocity_names: tuple[str, ...] = VELOCITIES
    attitude: FloatArray | None = None
    commands: dict[str, FloatArray] = field(default_factory=dict)
    wrench: FloatArray | None = None
    acceleration: FloatArray | None = None
    propulsion_ratio: FloatArray | None = None
    position: FloatArray | None = None
    specific_force: FloatArray | None = None
    labels: tuple[str, ...] | None = None
    lines: Sequence[int] | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        time: npt.ArrayLike,
        velocity: npt.ArrayLike | Mapping[str, npt.ArrayLike],
        *,
        attitude: npt.ArrayLike | None,
        commands: Mapping[str, npt.ArrayLike],
        segment: Sequence[object] | None,
        source: str,
        **optional: npt.ArrayLike | None,
    ) -> Record:
        """Return the record of plain arrays; parameters as for :meth:`Log.from_arrays`."""
        n = np.size(time)
        door = _Door(n)
        blocks: dict[str, Any] = {
            name: door.optional(name, optional.get(name), shape)
            for name, shape in _optional_shapes(n).items()
        }
        record = cls(
            time=door.array("time", time, (n,)),
            velocity=door.velocity(velocity),
            velocity_names=_velocity_names(velocity),
            attitude=door.attitude(attitude),
            commands={name: door.command(name, given) for name, given in commands.items()},
            **blocks,
            labels=door.labels(segment),
            source=source,
        )
        if door.faults:
            raise LogError(door.faults, source=source)
        return record

    @property
    def n(self) -> int:
        """The number of samples."""
        return len(self.time)

    @property
    def joins(self) -> BoolArray:
        """Whether a segment begins at each sample by its label, shape (n,)."""
        starts = np.zeros(self.n, dtype=np.bool_)
        starts[:1] = True
        if self.labels is not None:
            labels = np.array(self.labels, dtype=object)
            starts[1:] = labels[1:] != labels[:-1]
        return starts

    @property
    def missing(self) -> BoolArray:
        """Whether any column but time is NaN at each sample, shape (n,)."""
        lacking = np.zeros(self.n, dtype=np.bool_)
        blocks = (getattr(self, name) for name in _optional_shapes(self.n))
        for block in (self.velocity, self.attitude, *blocks, *self.commands.values()):
            if block is not None:
                lacking |= np.isnan(block.reshape(self.n, -1)).any(axis=1)
        return lacking

    def place(self, row: int) -> str:
        """Return how a message calls a sample."""
        return f"row {row + 1}" + ("" if self.lines is None else f" (line {self.lines[row]})")

    def columns(self, keep: BoolArray) -> dict[str, Any]:
        """Return the arguments of a log that holds some of the samples."""
        commands = np.column_stack([*self.commands.values(), np.empty((self.n, 0))])
        blocks = {name: commands if name == "commands" else getattr(self, name) for name in BLOCKS}
        rows = slice(None) if keep.all() else keep  # a long log is not copied for nothing
        taken = {name: None if block is None else block[rows] for name, block in blocks.items()}
        return {
            **taken,
            "velocity_names": self.velocity_names,
            "command_names": tuple(self.commands),
            "notes": self.notes,
        }


class _Door:
    """Copies arrays of n samples and collects what is wrong with them."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.faults: list[str] = []

    def array(self, name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
        try:
            return frozen(values, shape, name)
        except ValueError as error:
            turned = np.shape(values)[::-1] == shape != shape[::-1]
            hint = ". Did you pass it transposed? Rows are samples" if turned else ""
            self.faults.append(f"{error}{hint}")
            return np.zeros(shape)

    def optional(
        self, name: str, values: npt.ArrayLike | None, shape: tuple[int, ...]
    ) -> FloatArray | None:
        return None if values is None else self.array(name, values, shape)

    def velocity(self, velocity: npt.ArrayLike | Mapping[str, npt.ArrayLike]) -> FloatArray:
        if not isinstance(velocity, Mapping):
            return self.array("velocity", velocity, (self.n, 6))
        block = np.zeros((self.n, 6))
        for name, values in velocity.items():
            if name in VELOCITIES:
                block[:, VELOCITIES.index(name)] = self.array(name, values, (self.n,))
            else:
                near = did_you_mean(name, VELOCITIES)
                self.faults.append(f"velocity names are u v w p q r; got '{name}'.{near}")
        return block

    def command(self, name: str, values: npt.ArrayLike) -> FloatArray:
        try:
            check_command_name(name)
        except TermError as error:
            self.faults.append(str(error))
        return self.array(name, values, (self.n,))

    def attitude(self, attitude: npt.ArrayLike | None) -> FloatArray | None:
        if attitude is None or np.shape(attitude) != (self.n, 3):
            return self.optional("attitude", attitude, (self.n, 4))
        return quaternion_from_euler(self.array("attitude", attitude, (self.n, 3)))

    def labels(self, segment: Sequence[object] | None) -> tuple[str, ...] | None:
        if segment is not None and len(segment) != self.n:
            self.faults.append(f"`segment` must have {self.n} labels; got {len(segment)}")
            return None
        return None if segment is None else tuple(map(str, segment))


def _optional_shapes(n: int) -> dict[str, tuple[int, ...]]:
    """Return the arrays that a recording may have besides motion and commands."""
    return {
        "wrench": (n, 6),
        "acceleration": (n, 6),
        "propulsion_ratio": (n,),
        "position": (n, 3),
        "specific_force": (n, 3),
    }


def _velocity_names(velocity: npt.ArrayLike | Mapping[str, npt.ArrayLike]) -> tuple[str, ...]:
    if not isinstance(velocity, Mapping):
        return VELOCITIES
    return tuple(name for name in VELOCITIES if name in velocity)
