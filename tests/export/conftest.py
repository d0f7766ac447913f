"""Vehicles, coefficients and short logs that the targets are tried with."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.target import save_files
from hydrodamp.export.verification import sample_states
from hydrodamp.kernels.core import mass_inverse, plant_of
from hydrodamp.kernels.library import C, call
from hydrodamp.simulation.problem import held_channels

# Behind all packages: one study has the name of one.
sys.path.append(str(Path(__file__).parents[2] / "studies"))

RICH = hd.Vehicle(
    "rich-3",
    hd.fleet["vt690"].mass_matrix,
    480.0,
    500.0,
    np.array([0.02, -0.01, 0.03]),
    np.array([0.0, 0.01, -0.02]),
    (
        hd.Fin("rudder", {"Y": 9.0, "N": -9.2}, {"X": -4.7}, limit=0.3, dead_zone=(-0.02, 0.01)),
        hd.Propeller("rpm", 3e-6, advance=-1e-4, torque=-1e-7, speed_slope=0.001),
        hd.Thruster(
            "lambda",
            (0.3, 0.1, -0.2),
            (0.0, 1.0, 1.0),
            curve=((-1.0, -30.0), (0.0, -2.0), (0.5, 12.0), (2.0, 40.0)),
            limit=1.5,
        ),
        hd.Matrix(("lift",), ((0.0, 0.0, 1.0, 0.0, 0.2, 0.0),)),
    ),
)
"""One of each actuator, heavy centres, a command that is a word of several languages."""

BOAT = hd.Vehicle(
    "boat",
    np.array([[20.0, 0.0, 0.0], [0.0, 30.0, 1.0], [0.0, 1.0, 5.0]]),
    *(100.0, 100.0),
    axes=("X", "Y", "N"),
    actuators=(hd.Matrix(("ahead", "turn"), ((10.0, 0, 0, 0, 0, 0), (0.0, 2.0, 0, 0, 0, 4.0))),),
)
"""Three degrees of freedom."""

PUBLISHED = hd.published["vt690-sname2022"]

MODELS = tuple(hd.catalog[key] for key in hd.PAPER_MODELS)

ALL_ATOMS = hd.DampingModel.from_table(
    {
        "X": "1 u u|u| u^2(eta-1) down_x",
        "Y": "v|r| vV |r|V_v down_y v*lift",
        "Z": "wV |q|V_w wU down_z",
        "K": "p|p|",
        "M": "q w|w| u|u|*lift u|u|*|gain|",
        "N": "r uv r^2(eta-1)",
    },
    key="all-atoms",
)


def coefficients(model, seed=0):
    """Return random coefficients that more or less damp."""
    values = np.random.default_rng(seed).normal(size=model.n_coefficients) - 1.0
    return hd.Damping(model, values)


WIDE = ExportedPlant.of(RICH, coefficients(ALL_ATOMS))
PAPER = ExportedPlant.of(hd.fleet["vt690"], PUBLISHED)


def states(plant, n=50, seed=1):
    """Return random states; commands within and beyond their limits."""
    random = np.random.default_rng(seed)
    down = random.normal(size=(n, 3))
    return States(
        random.normal(size=(n, 6)),
        down / np.linalg.norm(down, axis=1, keepdims=True),
        random.normal(size=(n, len(plant.inputs))),
        random.normal(size=(n, 6)),
    )


def core(plant, at):
    """Return the accelerations of the C core, called by itself."""
    columns = plant.columns
    named = dict(zip(plant.commands, at.inputs.T, strict=False))
    channels = held_channels(columns, named, len(at.velocity))
    known = plant.vehicle.propulsion_speed(named)
    speed = at.inputs[:, -1] if known is None and len(at.inputs.T) else known
    core_plant, inverse = plant_of(columns.plant), mass_inverse(columns.plant)
    table, rates = np.ascontiguousarray(plant.matrix), []
    atoms, xi = np.zeros(C.hd_atom_count(channels.shape[1])), np.zeros(len(table))
    for k in range(len(at.velocity)):
        rate, row = np.empty(6), np.ascontiguousarray(channels[k])
        nu = np.ascontiguousarray(at.velocity[k] * plant.vehicle.free)
        recorded = at.down[k].copy(), at.wrench[k].copy(), row if row.size else None
        driven = 0.0 if speed is None else float(speed[k])
        call("hd_acceleration", core_plant, inverse, table, nu, *recorded, driven, rate, atoms, xi)
        rates.append(rate)
    return np.array(rates)


@pytest.fixture(scope="session")
def campaign():
    """A short campaign of the paper's vehicle."""
    return hd.reenact(duration=20.0, seed=3)


@pytest.fixture
def export(campaign, tmp_path):
    """What exports coefficients of the campaign's vehicle, those of the paper unless others are."""

    def run(target="python", damping=PUBLISHED, name="a", vehicle=campaign.vehicle, **more):
        return hd.export(damping, vehicle, target, tmp_path / name, **more)

    return run


@pytest.fixture(scope="session")
def fit_model(campaign):
    """What fits a model to the training log of the campaign."""

    def fit(model):
        return hd.identify(model, campaign.vehicle, campaign.train, hd.LeastSquares())

    return fit


@pytest.fixture(scope="session")
def planar():
    """A boat of three degrees of freedom, and a log of it."""
    values = {"X_u": -8.0, "Y_v": -40.0, "Y_r": 3.0, "N_v": 2.0, "N_r|r|": -6.0}
    damping, n = hd.Damping.from_dict(None, values), 80
    held = np.random.default_rng(0).uniform([0.2, -1.0], [1.0, 1.0], (n // 10, 2))
    log = hd.Log(
        0.1 * np.arange(n),
        np.eye(n, 6) * 0.5,
        ("u", "v", "r"),
        commands=np.repeat(held, 10, axis=0),
        command_names=("ahead", "turn"),
    )
    return BOAT, damping, replace(log, velocity=hd.simulate(BOAT, damping, log).velocity)


def level_log(time, velocity=None, **more):
    """Return a log of a vehicle that stays level, at rest unless it has a velocity."""
    n = len(time)
    velocity = np.zeros((n, 6)) if velocity is None else velocity
    return hd.Log(time, velocity, attitude=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), **more)


COMPILER = next(filter(shutil.which, ("cc", "gcc", "clang")), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")


def write_export(form, plant, folder):
    """Write a form's files of a plant into a folder, and return it."""
    save_files(form.render_files(form.project_plant(plant, sample_states(plant))), folder)
    return folder


def read_back(form, plant, at, folder):
    """Return the accelerations that the files which a form writes of a plant give."""
    return accelerations_of(form, write_export(form, plant, folder), plant, at)


def accelerations_of(form, folder, plant, at):
    """Return the accelerations that a form's files in a folder give."""
    with form.open_engine(folder, plant) as engine:
        return engine.accelerations(at)
