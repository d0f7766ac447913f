"""Equation 1 as one table: what is known of a vehicle and what is to be found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import FIRST_CHANNEL
from hydrodamp.basis.basis import Basis
from hydrodamp.errors import ModelError
from hydrodamp.kernels.plant import Plant
from hydrodamp.models.damping import VehicleStamp
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle, mass_matrix_digest


def stamp(vehicle: Vehicle) -> VehicleStamp:
    """Return what a damping file says of the vehicle it belongs to."""
    return VehicleStamp(
        name=vehicle.name,
        weight=vehicle.weight,
        buoyancy=vehicle.buoyancy,
        mass_matrix_digest=mass_matrix_digest(vehicle.mass_matrix),
    )


# A channel that is always zero; no command can have this name.
_ZERO = ""


@dataclass(frozen=True)
class Columns:
    """The table of equation 1 for one vehicle and the terms asked for.

    Attributes
    ----------
    vehicle : Vehicle
        Whose mass matrix, restoring forces and actuators are used.
    basis : Basis
        The unknown columns, restricted to the free axes.
    channels : tuple of str
        The held channels, in the order of the table.
    plant : Plant
        Known columns first, then ``basis``.
    known : ndarray, shape (n_known, 6)
        Coefficients of the known columns, force [N] and moment [N m] per unit
        of the column, on the right-hand side, body frame.
    actuators : bool
        Whether the vehicle's actuators are among the known columns; not where
        the log has their wrench itself.
    """

    vehicle: Vehicle
    basis: Basis
    channels: tuple[str, ...]
    plant: Plant
    known: FloatArray
    actuators: bool

    @property
    def n_known(self) -> int:
        """How many columns are known."""
        return len(self.known)

    def with_unknown(
        self, entries: tuple[np.ndarray, np.ndarray], coefficients: FloatArray
    ) -> FloatArray:
        """Return the table with ``coefficients`` put at ``entries``."""
        matrix = self.scattered(entries, coefficients)
        matrix[: self.n_known] = self.known
        return matrix

    def scattered(self, entries: tuple[np.ndarray, np.ndarray], values: FloatArray) -> FloatArray:
        """Return a table of zeros with ``values`` put at ``entries``."""
        table = np.zeros((self.n_known + len(self.basis), 6))
        table[entries] = values
        return table

    def require(self, model: DampingModel) -> None:
        """Refuse a model with terms that are no columns of the basis.

        Parameters
        ----------
        model : DampingModel
            Restricted to the free axes.

        Raises
        ------
        ModelError
            Names the terms that were not asked for when the log was prepared.
        """
        missing = [str(term) for term in model.basis if term not in self.basis]
        if missing:
            raise ModelError(
                f"model '{model.key}' has terms this problem was not prepared for: "
                f"{' '.join(missing)}. Name the model in `prepare(vehicle, log, models)`."
            )

    def entries(self, model: DampingModel) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and axes of the table where the model's coefficients stand.

        Parameters
        ----------
        model : DampingModel
            Its terms must be columns of the basis.

        Returns
        -------
        rows, axes : ndarray of int, shape (n_coefficients,)
            In the order of the model's labels.

        Raises
        ------
        ModelError
            If a term of the model was not asked for when the log was prepared.
        """
        self.require(model)
        pairs = [
            (self.n_known + self.basis.index(term), axis)
            for axis, terms in enumerate(model.terms)
            for term in terms
        ]
        rows, axes = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return rows, axes


def columns(
    vehicle: Vehicle,
    models: tuple[DampingModel, ...],
    *,
    actuators: bool,
    propulsion_known: bool = True,
) -> Columns:
    """Write equation 1 of a vehicle and some models as one table.

    Parameters
    ----------
    vehicle : Vehicle
        Gives the known columns.
    models : tuple of DampingModel
        Give the unknown ones, restricted to the free axes.
    actuators : bool
        False where the log has the wrench of the actuators itself.
    propulsion_known : bool
        False makes the columns of terms with (eta-1) zero at every sample.

    Returns
    -------
    columns : Columns
        Known columns first.
    """
    basis = Basis(())
    for model in models:
        basis = basis | model.restricted_to(vehicle.axes).basis
    known = (vehicle if actuators else replace(vehicle, actuators=())).known_columns()
    names = {name for term in (*known.terms, *basis) for name in term.commands}
    idle = [term.needs_propulsion and not propulsion_known for term in basis]
    channels = (*sorted(names), *((_ZERO,) if any(idle) else ()))
    unknown = basis.table(channels).copy()
    unknown[idle] = [FIRST_CHANNEL + len(channels) - 1, 0, 0, 0]
    table = np.vstack([Basis(known.terms).table(channels), unknown])
    return Columns(
        vehicle=vehicle,
        basis=basis,
        channels=channels,
        plant=Plant(
            mass_matrix=vehicle.mass_matrix,
            free=vehicle.free,
            factors=table,
            n_channels=len(channels),
        ),
        known=frozen(known.matrix.T * vehicle.free),
        actuators=actuators,
    )


def held_channels(table: Columns, commands: Mapping[str, FloatArray], n: int) -> FloatArray:
    """Return the channels of a table, sample by sample."""
    made = table.vehicle.channels(commands) if table.actuators else {}
    found = {**commands, **made, _ZERO: np.zeros(n)}
    channels = np.empty((n, len(table.channels)))
    for place, name in enumerate(table.channels):
        channels[:, place] = found[name]
    return channels
