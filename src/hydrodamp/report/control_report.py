"""Files of a control design: JSON, scripts for python-control and MATLAB, and pictures."""

from __future__ import annotations

from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.control.design import ControlDesign, LoopDesign, SpeedDesign
from hydrodamp.control.linear_model import STATES, state_scales
from hydrodamp.control.loop_margins import MIN_MODULUS
from hydrodamp.files import as_json
from hydrodamp.kernels.kalman import Noise
from hydrodamp.report.figures.control import margins_figure, step_figure
from hydrodamp.report.pictures import draw_pictures
from hydrodamp.report.table import Table
from hydrodamp.results import save_results
from hydrodamp.vehicle.vehicle import Vehicle

SCRIPTS = "control_design.py", "control_design.m"
RESULTS = ("control.json", *SCRIPTS, "process_noise.json", "step.svg", "margins.svg")
"""Names of all files of a control design."""


def control_document(design: ControlDesign) -> dict[str, Any]:
    """Return a design as the content of control.json."""
    return {
        "verdict": str(design),
        "accepted": design.accepted,
        "vehicle": design.vehicle.name,
        "period": design.period,
        "draws": design.n_draws,
        "least_modulus_margin": MIN_MODULUS,
        "assumptions": design.assumptions,
        "speeds": [_speed_document(design.vehicle, each) for each in design.speeds],
    }


def _speed_document(vehicle: Vehicle, entry: SpeedDesign) -> dict[str, Any]:
    """Return trim, linear model, autopilot and margins at a speed."""
    document: dict[str, Any] = {
        "speed": entry.speed,
        "outcome": entry.outcome.value,
        "warning": entry.warning,
    }
    if not isinstance(entry, LoopDesign):
        return document
    model, autopilot, used = entry.model, entry.autopilot, entry.used
    a, b = model.a[0][np.ix_(used, used)], model.b[0][used]
    loops = {name: getattr(autopilot, name) for name in ("heading", "pitch", "depth")}
    law = {"a": entry.law.a, "b": entry.law.b[:, used], "c": entry.law.c, "d": entry.law.d[:, used]}
    margins = {
        command: {
            key: _distribution(values[:, index])
            for key, values in zip(entry.margins._fields[1:], entry.margins[1:], strict=True)
        }
        for index, command in enumerate(autopilot.names)
    }
    return document | {
        "draws_without_trim": int(np.sum(~model.exists)),
        "trim": dict(zip(STATES, model.state[0].tolist(), strict=True)),
        "feed_forward": {
            "wrench": dict(zip(AXES, model.force[0].tolist(), strict=True)),
            "std": dict(zip(AXES, model.force[model.exists].std(axis=0).tolist(), strict=True)),
            "commands": model.commands[0].tolist(),
        },
        "states": [name for name, is_used in zip(STATES, used, strict=True) if is_used],
        "a": a.tolist(),
        "b": b.tolist(),
        "transfer_functions": _transfer_functions(a, b, used),
        "inputs": autopilot.names,
        "pid": {
            name: {
                "command": autopilot.names[loop.command_index],
                "gains": [
                    loop.sign * each
                    for each in (loop.pid.proportional, loop.pid.integral, loop.pid.derivative)
                ],
            }
            for name, loop in loops.items()
            if loop is not None
        },
        "law": {name: matrix.tolist() for name, matrix in law.items()},
        "lqr_scales": {
            "states": state_scales(vehicle)[used].tolist(),
            "inputs": np.maximum(-autopilot.lowest, autopilot.highest).tolist(),
        },
        "margins": margins,
    }


def _transfer_functions(a: FloatArray, b: FloatArray, used: BoolArray) -> dict[str, Any]:
    """Return numerators by output, a row for each command, and the denominator."""
    from scipy.signal import ss2tf

    names = [name for name, is_used in zip(STATES, used, strict=True) if is_used]
    outputs = [name for name in ("u", "pitch", "yaw", "depth") if name in names]
    rows = [names.index(name) for name in outputs]
    pairs = [
        ss2tf(a, b, np.eye(len(a))[rows], np.zeros((len(rows), b.shape[1])), k)
        for k in range(b.shape[1])
    ]
    numerators = np.array([numerator for numerator, _ in pairs])
    return {"denominator": pairs[0][1].tolist()} | {
        name: numerators[:, index].tolist() for index, name in enumerate(outputs)
    }


def _distribution(values: FloatArray) -> dict[str, float | None]:
    """Return the value of the estimate, percentiles over draws, and the worst; null if infinite."""
    percentiles = np.quantile(values, [0.05, 0.5], method="lower")
    numbers = values[0], *percentiles, values.min()
    names = "estimate", "percentile_5", "median", "worst"
    return {
        name: float(x) if np.isfinite(x) else None for name, x in zip(names, numbers, strict=True)
    }


def noise_document(design: ControlDesign, noise: Noise) -> dict[str, Any]:
    """Return the process noise of a navigation filter at each speed.

    The states are those of the linear model, then a push d on each axis, d' = -d / tau + w.
    """
    free = np.outer(design.vehicle.free, design.vehicle.free)
    inverse = np.linalg.pinv(design.vehicle.mass_matrix * free)
    spectrum = 2.0 * noise.time_constant * noise.push**2
    gain = np.vstack([inverse, np.zeros((len(STATES) - 6, 6))])
    return {
        "states": [*STATES, *(f"push_{axis}" for axis in AXES)],
        "time_constant": noise.time_constant,
        "push_std": noise.push.tolist(),
        "q_push": (spectrum / noise.time_constant**2).tolist(),  # diagonal of w's intensity
        "q_velocity": (inverse @ np.diag(spectrum) @ inverse).tolist(),  # of white acceleration
        "measurement_std": noise.sensor.tolist(),
        "measurement_correlation": noise.correlation.tolist(),
        "measurement_step": noise.step,
        "speeds": [
            {
                "speed": each.speed,
                "a": np.block(
                    [
                        [each.model.a[0], gain],
                        [np.zeros((6, len(STATES))), -np.eye(6) / noise.time_constant],
                    ]
                ).tolist(),
                "b": np.vstack([each.model.b[0], np.zeros((6, each.model.b.shape[2]))]).tolist(),
            }
            for each in design.loops
        ],
    }


def margins_table(design: ControlDesign) -> Table:
    """Return a row for each speed and command with a loop: margins, the worst over draws."""
    rows = []
    for entry in design.speeds:
        if not isinstance(entry, LoopDesign):
            rows.append((f"{entry.speed:g}", "-", *"----", entry.outcome.word))
            continue
        for index, name in enumerate(entry.autopilot.names):
            modulus, gain, phase, delay = (each[:, index].min() for each in entry.margins[1:])
            if np.any(entry.law.d[index]):
                texts = f"{modulus:.2f}", f"{gain:.3g}", f"{phase:.0f}", f"{delay:.2f}"
                rows.append((f"{entry.speed:g}", name, *texts, entry.outcome.word))
    header = ("speed [m/s]", "command", "modulus", "gain", "phase [deg]", "delay [s]", "outcome")
    title = f"Smallest margins over {design.n_draws} draws, and of the estimate"
    return Table.of_words(title, header, "rlrrrrl", rows, design.assumptions)


def write_control(design: ControlDesign, folder: Path, noise: Noise | None) -> list[str]:
    """Write a design into a folder; return messages on files that could not be written."""
    contents = {folder / "control.json": as_json(control_document(design)).encode("utf-8")}
    if noise is not None:
        document = noise_document(design, noise)
        contents[folder / "process_noise.json"] = as_json(document).encode("utf-8")
    assets = files("hydrodamp.control").joinpath("assets")
    contents |= {folder / name: assets.joinpath(f"{name}.txt").read_bytes() for name in SCRIPTS}
    sketches = [
        ("step", "", partial(step_figure, design)),
        ("margins", "", partial(margins_figure, design)),
    ]
    pictures, missing = draw_pictures(sketches, {})
    contents |= {folder / f"{each.name}.svg": each.svg for each in pictures}
    save_results(contents, folder, RESULTS)
    return missing
