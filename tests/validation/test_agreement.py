"""compare and validate recommend the same model on one log, or say why they differ."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.cli.inputs import list_models
from hydrodamp.report.table import to_text
from hydrodamp.report.verdict_tables import verdict_table

EXAMPLES = Path(__file__).parents[2] / "examples"
CAUSES = ("not excited in", "Only fold", "diverged")


def load_campaign(_):
    campaign = hd.reenact(seed=0, duration=60.0)
    log = hd.concatenate([campaign.train, campaign.test])
    return campaign.vehicle, log, [hd.catalog[key] for key in ("prestero", "linear", "fossen")]


def load_bar_campaign(folder):
    home = folder / "c21"
    models = [hd.catalog[key] for key in ("gertler-hagen", "prestero", "linear", "fossen")]
    return hd.read_vehicle(home / "vehicle.yaml"), hd.read_log(home / "estimation.csv"), models


def load_bluerov2(folder):
    channels = ("forward", "lateral", "heave", "roll", "pitch", "yaw")
    terms = {axis: f"ch_{name}" for axis, name in zip("XYZKMN", channels, strict=True)}
    models = [hd.catalog[key].with_terms(terms) for key in ("fossen", "linear", "prestero")]
    log = hd.read_logs(sorted(folder.glob("*.csv")), "bluerov2-kth")
    return hd.fleet["bluerov2"], log, models


def load_kvlcc2(folder):
    home = EXAMPLES / "kvlcc2"
    runs = sorted(folder.glob("*_Z_*.dat"))[:4]
    log = hd.read_logs(runs, home / "mapping.yaml")
    models = list_models(str(home / "models.yaml")).models
    return hd.read_vehicle(home / "vehicle.yaml"), log, models


def load_esso_osaka(folder):
    home = EXAMPLES / "esso_osaka"
    runs = sorted(folder.glob("zigzag_*.csv"))
    log = runpy.run_path(str(home / "compare.py"))["read"](runs)
    return hd.read_vehicle(home / "vehicle.yaml"), log, hd.read_models(home / "models.yaml")


CASES = {
    "re-enacted": (load_campaign, ""),
    "simulated": (load_bar_campaign, "campaigns"),
    "rov": (load_bluerov2, "bluerov2_kth"),
    "tanker": (load_kvlcc2, "kvlcc2_hsva"),
    "pond": (load_esso_osaka, "esso_osaka"),
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::hydrodamp.errors.HydrodampWarning")
@pytest.mark.parametrize("name", CASES)
def test_comparisons_and_cross_validations_agree_or_explain(name, measured_logs):
    load, folder = CASES[name]
    vehicle, log, models = load(measured_logs(folder) if folder else None)
    names = [segment.name for segment in log.segments]
    half = len(names) // 2
    start, end = float(log.time[0]), float(log.time[-1])
    cut = start + 0.75 * (end - start)
    splits = [
        (log.select(*names[:half]), log.select(*names[half:])),
        (log.between(start, cut), log.between(cut, end)),
    ]
    tables = [hd.cross_validate(vehicle, log, chosen, hd.WeakForm()) for chosen in
              (models, models[1:])]  # fmt: skip
    for train, test in splits:
        problem = hd.prepare(vehicle, train, models)
        fits = hd.grade_fits(problem, hd.identify_all(problem, models, hd.WeakForm()))
        tables.append(hd.compare(fits, vehicle, test))
    reference = tables[0]
    for table in tables[1:]:
        if reference.verdict().model in {row.model for row in table.rows}:
            assert_agreement(reference, table)


SPLITS = [
    pytest.param((0.0, 0.75), (0.75, 1.0), id="the last quarter"),
    pytest.param((0.25, 1.0), (0.0, 0.25), id="the first quarter"),
    pytest.param((0.0, 0.5), (0.5, 1.0), id="the second half"),
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::hydrodamp.errors.HydrodampWarning")
@pytest.mark.parametrize(("train", "test"), SPLITS)
def test_a_verdict_is_short_follows_its_lights_and_depends_on_no_unit(train, test, measured_logs):
    """Verdicts on splits of one log may differ, not on deg/s against rad/s."""
    home = measured_logs("campaigns") / "c22"
    log, vehicle = hd.read_log(home / "estimation.csv"), hd.read_vehicle(home / "vehicle.yaml")
    start, duration = log.time[0], log.time[-1] - log.time[0]
    parts = [log.between(*(start + duration * np.array(each))) for each in (train, test)]
    models = [hd.catalog[key] for key in ("gertler-hagen", "prestero", "linear", "fossen")]
    problem = hd.prepare(vehicle, parts[0], models)
    fits = hd.grade_fits(problem, hd.identify_all(problem, models, hd.WeakForm()))
    by_unit = [hd.compare(fits, vehicle, parts[1], rate_unit=unit) for unit in ("deg", "rad")]
    degrees, radians = (table.verdict() for table in by_unit)
    assert degrees.lines == radians.lines
    assert degrees.relative_error == pytest.approx(radians.relative_error)
    lights = {axis.light for axis in degrees.axes}
    assert degrees.headline.startswith("Usable: ") == (hd.Light.RED not in lights)
    assert len(to_text(verdict_table(degrees, ("Next: a command.",)), 80).splitlines()) <= 12
    selection = by_unit[0].select()
    smaller = [row for row in selection.equivalent if row.n_coefficients < degrees.n_coefficients]
    assert not smaller


def assert_agreement(first, second):
    """Either selection is equivalent to the other, or a verdict names the cause."""
    verdicts = first.verdict(), second.verdict()
    equivalent = [
        {verdict.model, *(row.model for row in table.select().equivalent)}
        for verdict, table in zip(verdicts, (first, second), strict=True)
    ]
    agrees = verdicts[0].model in equivalent[1] or verdicts[1].model in equivalent[0]
    assert agrees or any(word in str(each) for each in verdicts for word in CAUSES), verdicts


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::hydrodamp.errors.HydrodampWarning")
@pytest.mark.parametrize("key", ["prestero", "fossen"])
@pytest.mark.parametrize("share", [0.75, 1.0])
def test_the_predicted_error_covers_that_on_the_rest_of_a_log(key, share, measured_logs):
    home = measured_logs("campaigns") / "c22"
    log, vehicle = hd.read_log(home / "estimation.csv"), hd.read_vehicle(home / "vehicle.yaml")
    middle = log.time[0] + share * (log.time[-1] - log.time[0])
    rest = log.between(middle, log.time[-1]) if share < 1.0 else None
    rest = rest or hd.read_log(home / "validation.csv")
    problem = hd.prepare(vehicle, log.between(log.time[0], middle), hd.catalog[key])
    fit = hd.find_method("recommended").identify(problem, hd.catalog[key])
    band = hd.predict_error(vehicle, fit, rest)
    error = np.sqrt(np.mean((band.velocity - rest.velocity) ** 2, axis=0))
    sensors = np.std(np.diff(rest.velocity, axis=0), axis=0) / np.sqrt(2.0)
    assert np.all(error <= np.hypot(np.sqrt(np.mean(band.half_width**2, axis=0)), 2.0 * sensors))
