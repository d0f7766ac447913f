"""Stored results of every method on small logs: a change of structure moves no number.

A golden value is what the code gave, not the truth. `pytest -m "" --write-golden` with this file
writes them anew, for a change that is meant to move numbers.
"""

import json
import os
import re
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import hydrodamp as hd
from hydrodamp.cli.main import app
from hydrodamp.identification.fit import correlation
from hydrodamp.identification.information import predict_standard_errors
from hydrodamp.simulation.campaign.conditions import Conditions

from .sensors import sample, without

GOLDEN = Path(__file__).with_name("golden")
MODELS = ("linear", "fossen", "prestero")
ITERATIVE = ("oe", "recommended")
KEYS = {"closed": tuple(key for key in hd.METHODS if key not in ITERATIVE), "iterative": ITERATIVE}
RTOL = {"closed": float(os.environ.get("HYDRODAMP_GOLDEN_RTOL", "1e-9")), "iterative": 1e-6}
"""Over the norm of an axis, in closed form; over value and standard error, if iterative."""


class Moving(Conditions):
    """Sensor errors and pushes that are moving averages of white ones, over 5 and 20 samples."""

    def sample_sensor_errors(self, *args):
        return moving_average(super().sample_sensor_errors(*args), 5)

    def sample_disturbances(self, seed, n_runs, n_samples, *_):
        white = np.random.default_rng(seed).standard_normal((n_samples, n_runs, 6))
        return moving_average(white, 20) * (0.5, 0.5, 0.1, 0.0005, 0.08, 0.3)


def moving_average(white, length):
    sums = np.cumsum(white, axis=0)
    sums[length:] -= sums[:-length].copy()
    return sums / np.sqrt(length)


def simulate_rov():
    """Two runs of a vehicle with three free axes, under commands that are held for 2 s."""
    wrench = np.diag([60.0, 60.0, 0.0, 0.0, 0.0, 10.0])[[0, 1, 5]].tolist()
    thrusters = hd.Matrix(commands=("ahead", "aside", "turn"), wrench=wrench)
    vehicle = replace(hd.fleet["bluerov2"], axes=tuple("XYN"), actuators=(thrusters,))
    rng, n = np.random.default_rng(5), 400
    log = hd.Log(
        0.1 * np.arange(n),
        np.zeros((n, 6)),
        tuple("uvr"),
        np.eye(1, 4).repeat(n, axis=0),
        commands=np.repeat(rng.uniform(-1.0, 1.0, (n // 20, 3)), 20, axis=0),
        command_names=thrusters.commands,
        segments=(hd.Segment("1", 0, n // 2), hd.Segment("2", n // 2, n)),
    )
    velocity = hd.simulate(vehicle, hd.published["bluerov2"], log).velocity.copy()
    velocity[:, vehicle.free] += 0.005 * rng.standard_normal((n, 3))
    return vehicle, replace(log, velocity=velocity)


@cache
def campaign(seed, coloured=False):
    """Return a campaign with the first and the last training run, of 40 s each."""
    made = hd.reenact(seed, duration=40.0, conditions=Moving() if coloured else hd.WHITE_NOISE)
    train, exact = (
        hd.concatenate([log.between(0.0, 50.0), log.between(290.0, 350.0)])
        for log in (made.train, made.exact_train)
    )
    return replace(made, train=train, exact_train=exact)


def sensor_log():
    """Velocities u v w from a late and biased DVL, and a depth; rates at every sample."""
    log, exact = campaign(3).train, campaign(3).exact_train
    late = {"true_delay": 0.3, "estimate": ("bias", "delay")}
    dvl = sample(log, "dvl", "velocity", exact.velocity[:, :3] + [0.05, 0, 0], 0.5, 5e-3, **late)
    rates = sample(log, "gyro", "rates", exact.velocity[:, 3:], 0.25, 1e-3, seed=1)
    return campaign(3).vehicle, without(log, *"uvw", measurements=[dvl, rates])


LOGS = {
    "white": lambda: (campaign(3).vehicle, campaign(3).train),
    "coloured": lambda: (campaign(4, coloured=True).vehicle, campaign(4, coloured=True).train),
    "rov": simulate_rov,
    "sensors": sensor_log,
}


def prepare(log, key):
    vehicle, data = LOGS[log]()
    model = hd.catalog[key].restricted_to(vehicle.axes)
    return hd.prepare(vehicle, data, model), model


def split_axes(model, values):
    """Return the values of each axis; those of an axis have one scale."""
    axes = [label.partition("_")[0] for label in model.labels]
    pairs = list(zip(axes, np.asarray(values).tolist(), strict=True))
    return {axis: [value for key, value in pairs if key == axis] for axis in dict.fromkeys(axes)}


def record_covariance(model, covariance):
    """Return standard errors, and a product that every correlation is a part of."""
    weights = np.random.default_rng(0).uniform(0.5, 1.5, len(covariance))
    product = np.nan_to_num(correlation(covariance)) @ weights
    return {
        "standard_errors": split_axes(model, np.sqrt(np.diag(covariance))),
        "correlations times weights": split_axes(model, product),
    }


def record_estimates(estimates):
    """Return values and standard errors of parameters by label."""
    return {
        "values": {label: each.value for label, each in estimates.items()},
        "standard_errors": {label: each.standard_error for label, each in estimates.items()},
    }


def record_uncertainty(model, uncertainty):
    if uncertainty is None:
        return {}
    values = {each.name: getattr(uncertainty, each.name) for each in fields(uncertainty)}
    del values["covariance"]
    noise, leverage = values.pop("noise"), values.pop("leverage")
    return {
        **values,
        "noise": {} if noise is None else record_covariance(model, noise),
        "leverage": {} if leverage is None else split_axes(model, leverage),
    }


def record_fit(fit):
    record = {"status": fit.status.name, "remarks": fit.remarks}
    if fit.status is hd.Status.REFUSED:
        return record
    covariance = fit.damping.covariance
    return {
        **record,
        "rank": fit.rank,
        "n_samples": fit.n_samples,
        "aliased": fit.aliased,
        "indirect": fit.indirect,
        "grades": " ".join(fit.grades[label].name for label in fit.model.labels),
        "values": split_axes(fit.model, fit.damping.coefficients),
        **({} if covariance is None else record_covariance(fit.model, covariance)),
        "uncertainty": record_uncertainty(fit.model, fit.uncertainty),
        "sensors": record_estimates(fit.estimates),
    }


def flatten(value, path=()):
    """Yield path and value of every number, text and list of numbers."""
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list) and any(isinstance(each, dict | list | str) for each in value):
        items = enumerate(value)
    else:
        yield path, value
        return
    for key, each in items:
        yield from flatten(each, (*path, str(key)))


def difference(new, old, rtol, errors, labels):
    """Return what is different between two values; empty for nothing."""
    try:
        new_array, old_array = np.atleast_1d(new).astype(float), np.atleast_1d(old).astype(float)
    except (TypeError, ValueError):
        return "" if new == old else f"{new!r}, golden {old!r}"
    if new_array.shape != old_array.shape:
        return f"{new_array.size} values, golden {old_array.size}"
    scale = np.linalg.norm(old_array[np.isfinite(old_array)])
    if errors is not None:
        scale = np.minimum(np.abs(old_array) + np.nan_to_num(errors), scale)
    wrong = ~np.isclose(new_array, old_array, rtol=0.0, atol=rtol * scale, equal_nan=True)
    return "; ".join(
        f"{labels[k] if labels else k}: {new_array[k]}, golden {old_array[k]}"
        for k in np.flatnonzero(wrong)
    )


def compare(measured, golden, kind):
    """Return a line for every difference, with log, model, method and label."""
    new, old = dict(flatten(measured)), dict(flatten(golden))
    labels = golden.get("labels", {}) if isinstance(golden, dict) else {}
    lines = [f"{' '.join(path)}: only on one side" for path in sorted(new.keys() ^ old.keys())]
    for path in (path for path in old if path in new):
        mate = tuple("standard_errors" if part == "values" else part for part in path)
        errors = old.get(mate) if kind == "iterative" and "values" in path else None
        names = labels.get(path[-1]) if path else None
        if text := difference(new[path], old[path], RTOL[kind], errors, names):
            lines.append(f"{' '.join(path)}: {text}")
    return lines


@pytest.fixture
def check(request):
    """Compare a result with its file, or write the file."""

    def compare_or_write(name, measured, kind):
        is_text = isinstance(measured, str)
        path = GOLDEN / f"{name}.{'txt' if is_text else 'json'}"
        text = measured if is_text else f"{json.dumps(measured, indent=1, ensure_ascii=False)}\n"
        if request.config.getoption("--write-golden"):
            GOLDEN.mkdir(exist_ok=True)
            short = re.sub(r"\[[^][{}]*\]", lambda row: re.sub(r"\n *", " ", row[0]), text)
            path.write_text(text if is_text else short, "utf-8")
        read = str.splitlines if is_text else json.loads
        lines = compare(read(text), read(path.read_text("utf-8")), kind)
        assert not lines, "\n".join(f"{name} {line}" for line in lines[:20])

    return compare_or_write


@pytest.mark.parametrize(
    ("log", "key", "kind"),
    [
        pytest.param(log, key, kind, marks=[] if (log, key, kind) == FAST else pytest.mark.slow)
        for FAST in [("rov", "fossen", "closed")]
        for log in LOGS
        for key in MODELS
        for kind in KEYS
    ],
)
def test_fits(check, log, key, kind):
    problem, model = prepare(log, key)
    methods = [hd.find_method(method) for method in KEYS[kind]]
    fits = [fit for method in methods for fit in hd.identify_all(problem, [model], method)]
    fits = hd.grade_fits(problem, fits)
    records = {fit.method: record_fit(fit) for fit in fits}
    check(f"{log}-{key}-{kind}", {"labels": split_axes(model, model.labels), **records}, kind)


@pytest.mark.slow
def test_vehicle_parameters(check):
    names = ("added-mass", "center-of-gravity", "buoyancy")
    problem, _ = prepare("white", "prestero")
    model = hd.catalog["prestero"].with_terms({"K": "up"}, key="truth")
    fit = hd.Recommended(estimate=names).identify(problem.extend_to(model), model)
    causes = {label: each.cause for label, each in fit.estimates.items()}
    record = {**record_estimates(fit.estimates), "causes": causes, "remarks": fit.remarks}
    check("vehicle-parameters", record, "iterative")


@pytest.mark.slow
def test_command_response(check):
    response = hd.estimate_command_response(*prepare("white", "fossen"), ("lag", "delay"))
    record = {each.name: getattr(response, each.name) for each in fields(response)}
    check("command-response", record, "iterative")


@pytest.mark.slow
def test_predicted_standard_errors(check):
    problem, model = prepare("sensors", "fossen")
    bounds = predict_standard_errors(problem, model)
    check("predicted", {key: split_axes(model, each) for key, each in bounds.items()}, "iterative")


@pytest.mark.slow
def test_diagnosis(check):
    problem, model = prepare("white", "fossen")
    fit = hd.LeastSquares().identify(problem, model)
    check("diagnosis", hd.diagnose(problem, fit.damping), "closed")


@pytest.mark.slow
def test_output_of_commands(check, tmp_path, monkeypatch):
    """The document of identify; the text of identify and compare, line by line as printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    hd.write_log(campaign(3).train, "train.csv")
    hd.write_log(campaign(3).test, "test.csv")

    def call(line):
        done = CliRunner().invoke(app, f"{line} --vehicle vt690".split())
        assert done.exit_code == 0, done.output
        return done.stdout

    document = json.loads(call("identify train.csv --model fossen --method weak --json"))
    for name in ("digest", "velocity_digests"):  # of bits
        del document["fit"]["provenance"][name]
    check("identify", document, "closed")
    check("identify", call("identify train.csv --model fossen --verbose"), "iterative")
    data = "--train train.csv --test test.csv --models linear,fossen --methods ls,weak,oe"
    check("compare", call(f"compare {data} --verbose"), "iterative")
