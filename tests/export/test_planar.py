"""A boat known on X, Y and N in simulators of six axes: same motion there, upright elsewhere."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.export.export import find_target
from hydrodamp.export.planar import complete_plant
from hydrodamp.export.plant import Body, ExportedPlant
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.vehicle.mass import rigid_body_mass_matrix

KEYS = ["gz-sim", "vrx", "mujoco"]
DRIVEN = [("gz-sim", "dartpy"), ("vrx", "dartpy"), ("mujoco", "mujoco")]


@pytest.fixture(name="split")
def split_fixture(planar):
    """The boat with a split mass matrix, a centre of gravity off the origin, and no weight."""
    boat, damping, log = planar
    rigid = rigid_body_mass_matrix(15.0, [0.0, 0.0, 3.0], [0.1, 0.0, 0.0], "center_of_gravity")
    added = np.diag([2.0, 12.0, 0.0, 0.0, 0.0, 1.5])
    boat = replace(
        boat,
        mass_matrix=rigid + added,
        added_mass=added,
        center_of_gravity=[0.1, 0.0, 0.0],
        weight=0.0,
        buoyancy=0.0,
    )
    return boat, damping, replace(log, velocity=hd.simulate(boat, damping, log).velocity)


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_it_moves_on_its_axes_as_identified(key, split, tmp_path, snapshot):
    boat, damping, log = split
    if key == "vrx":  # has no couplings
        damping = hd.Damping.from_dict(None, {"X_u": -8.0, "Y_v": -40.0, "N_r|r|": -6.0})
        log = replace(log, velocity=hd.simulate(boat, damping, log).velocity)
    card = hd.export(damping, boat, key, tmp_path / "a", log=log)
    assert card.exact
    assert max(card.wrench_error.values()) < 1e-8
    assert card.replays.source_to_log.rms < 1e-9
    assert "\n".join(card.assumed) == snapshot
    assert f"Assumed on Z, K and M, which are not identified: {card.assumed[0]}" in str(card)
    assert hd.export(damping, hd.fleet["vt690"], "python", tmp_path / "b").assumed == ()


@pytest.mark.slow
@pytest.mark.parametrize(("key", "engine"), DRIVEN)
def test_it_floats_upright(key, engine, split, tmp_path):
    """Released with a heel and a trim it returns to level, and neither sinks nor turns."""
    if not find_spec(engine):
        pytest.skip(f"{engine} is not installed")
    boat, damping, _ = split
    form = find_target(key)
    hd.export(damping, boat, form, tmp_path / "a", box=OperatingBox([-1] * 6, [1] * 6))
    plant, _ = complete_plant(ExportedPlant.of(boat, damping))
    turned, h, idle = np.zeros(6), 0.02, np.zeros(6)
    with form.open_engine(tmp_path / "a", plant) as running:
        running.set_state(np.array([0.995, 0.075, 0.065, 0.0]), np.zeros(6))
        for _ in range(1500):
            velocity = running.advance(h, idle[:2], idle, idle)
            turned += h * velocity
    np.testing.assert_allclose(turned[3:5], [-0.15, -0.13], atol=0.01)
    assert abs(turned[5]) < 0.1  # sway and yaw are coupled
    assert abs(turned[2]) < 0.02
    assert np.abs(velocity[2:5]).max() < 1e-3
    assert np.abs(velocity).max() < 0.01  # its yaw damping is quadratic


def test_what_the_file_has_of_the_other_axes_remains(split):
    """Heave, roll and pitch masses, centres with a righting moment, and the weight."""
    boat, damping, _ = split
    inertia, center = [0.5, 2.5, 3.0], [0.1, 0.0, 0.02]
    rigid = rigid_body_mass_matrix(15.0, inertia, center, "center_of_gravity")
    added = np.diag([2.0, 12.0, 9.0, 0.1, 1.0, 1.5])
    whole = replace(
        boat,
        mass_matrix=rigid + added,
        added_mass=added,
        center_of_gravity=center,
        center_of_buoyancy=[0.1, 0.0, -0.05],
        weight=15.0 * 9.80665,
    )
    plant, assumed = complete_plant(ExportedPlant.of(whole, damping))
    np.testing.assert_allclose(plant.vehicle.mass_matrix, rigid + added, atol=1e-12)
    np.testing.assert_array_equal(plant.vehicle.center_of_buoyancy, [0.1, 0.0, -0.05])
    assert [text.split()[0] for text in assumed] == ["buoyancy", "damping"]
    body = Body.of(plant, "gz-sim", 1000.0)
    np.testing.assert_allclose(body.inertia, np.diag(inertia), atol=1e-9)


@pytest.mark.parametrize("has_split", [True, False])
def test_its_rigid_body_is_possible(has_split, split, planar):
    """Positive added mass and moments of inertia that obey the triangle inequality."""
    boat, damping, _ = split if has_split else planar
    plant, _ = complete_plant(ExportedPlant.of(boat, damping))
    body = Body.of(plant, "gz-sim", 1000.0)
    free = np.ix_([0, 1, 5], [0, 1, 5])
    np.testing.assert_array_equal(plant.vehicle.mass_matrix[free], boat.mass_matrix[free])
    moments = np.sort(np.linalg.eigvalsh(body.inertia))
    assert 0.0 < moments[2] <= moments[0] + moments[1]
    assert np.linalg.eigvalsh(body.added)[0] > -1e-9
