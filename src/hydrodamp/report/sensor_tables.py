"""Tables of the sensors of a log, and of the standard errors that they allow."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hydrodamp.conditioning.sensor_log import SensorLog
from hydrodamp.data.measurement import KIND_UNITS
from hydrodamp.identification.information import predict_standard_errors
from hydrodamp.models.model import DampingModel, coefficient_unit, read_label
from hydrodamp.report.table import NOTHING, Column, Table, coefficient
from hydrodamp.simulation.problem import Problem

#: Coefficients whose standard errors are listed.
MAX_ROWS = 24


def sensor_tables(problem: Problem, model: DampingModel) -> Iterator[Table]:
    """Yield the sensors of a problem, and the predicted standard errors of a model."""
    if problem.sensor_log is None:
        return
    yield sensor_table(problem.sensor_log)
    yield error_table(problem, model)


def sensor_table(sensor_log: SensorLog) -> Table:
    """Return the sensors of a log: components, rate, noise, delay and outliers."""
    rows = []
    for sensor in sensor_log.sensors:
        each = sensor.measurement
        finite = np.isfinite(each.values) & sensor.rows.inside[:, None]
        origin = "data" if each.std is None else "declared"
        noise = " ".join(f"{std:.2g}" for std in sensor.std)
        rows.append((
            each.name, each.kind.replace("_", " "), " ".join(each.components), each.n,
            f"{each.rate:.3g}", noise, KIND_UNITS[each.kind], origin, f"{each.delay:.3g}",
            int(np.sum(finite & ~sensor.valid)), " ".join(each.estimate) or NOTHING,
        ))  # fmt: skip
    head = ("sensor", "kind", "components", "n", "rate [Hz]", "noise", "unit", "from", "delay [s]",
            "outliers", "estimated")  # fmt: skip
    notes = []
    if sensor_log.names:
        notes.append(
            f"Not recorded at every sample: {' '.join(sensor_log.names)}. `oe` and `recommended` "
            "compare the sensors at their own times; other methods need these velocities."
        )
    return Table.of_words("Sensors", head, "lllrrllrrrl", rows, notes)


def error_table(problem: Problem, model: DampingModel) -> Table:
    """Return the predicted standard error of each coefficient by sensors."""
    free = model.restricted_to(problem.vehicle.axes)
    errors = predict_standard_errors(problem, free)
    units = [coefficient_unit(*read_label(label)) for label in free.labels]
    columns = (
        Column("coefficient", number=False),
        *(Column(title, form=coefficient) for title in errors),
        Column("unit", number=False),
    )
    values = [each.tolist() for each in errors.values()]
    rows = tuple(zip(free.labels, *values, units, strict=True))
    reference = errors["all sensors"]
    medians = [
        f"{title} {np.median(each / reference):.2g}"
        for title, each in errors.items()
        if each is not reference
    ]
    notes = [
        f"Median ratio to all sensors: {', '.join(medians)}.",
        "Predicted from the Fisher information at the weak-form estimate, with the residuals of "
        "each output, for exact mass and actuation.",
    ]
    if len(rows) > MAX_ROWS:
        notes.append(f"{len(rows) - MAX_ROWS} more coefficients are not listed.")
    title = f"Predicted standard errors of {model.key}"
    return Table(title, columns, rows[:MAX_ROWS], tuple(notes))
