"""Where vehicle, log and terms meet: one table, held channels, clear refusals."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, ProblemError, PropulsionWarning

LINEAR = hd.catalog["linear"]
VEHICLE = hd.fleet["vt690"]
BARE = replace(VEHICLE, actuators=())
PLANAR = replace(BARE, axes=("X", "Y", "N"))


def log_of(n=20, **more):
    rng = np.random.default_rng(9)
    velocity = rng.normal(0, 0.1, (n, 6)) + np.array([1.5, 0, 0, 0, 0, 0])
    attitude = more.pop("attitude", rng.normal(0, 0.1, (n, 3)))
    return hd.Log.from_arrays(
        np.arange(n) / 10, more.pop("velocity", velocity), attitude=attitude, **more
    )


def commands_of(n=20):
    return {
        "rudder": np.linspace(-0.3, 0.3, n),
        "elevator": np.linspace(0.2, -0.1, n),
        "rpm": np.linspace(1500, 2000, n),
    }


def test_known_columns_give_the_known_wrench_of_the_vehicle():
    log = log_of(commands=commands_of())
    problem = hd.prepare(VEHICLE, log, LINEAR)
    known = problem.regressor()[:, : problem.equations.n_known] @ problem.equations.known
    np.testing.assert_array_equal(problem.regressor(step=7), problem.regressor()[::7])
    expected = VEHICLE.known_wrench(log.velocity, log.down, commands_of())
    np.testing.assert_allclose(known, expected, rtol=1e-12, atol=1e-12)


def test_channels_are_held_and_the_propeller_gives_its_speed():
    problem = hd.prepare(VEHICLE, log_of(commands=commands_of()), hd.catalog["gertler-hagen"])
    opening, closing = problem.inputs.propulsion.T
    np.testing.assert_allclose(opening, 0.001 * commands_of()["rpm"])
    np.testing.assert_allclose(closing[1:], opening[:-1])  # held over the step that ends here


def test_an_unknown_ratio_is_one_even_at_rest():
    log = log_of(velocity=np.zeros((20, 6)), wrench=np.zeros((20, 6)))
    with pytest.warns(PropulsionWarning):
        problem = hd.prepare(BARE, log, hd.catalog["gertler-hagen"])
    etas = [k for k, term in enumerate(problem.equations.basis) if term.needs_propulsion]
    assert not problem.regressor()[:, problem.equations.n_known :][:, etas].any()


def test_locked_velocities_do_not_count_in_the_ratio():
    """A recorded ratio enters as recorded, though the log has the locked heave too."""
    model = hd.DampingModel.from_table({"X": "u(eta-1)"}, key="ratio")
    velocity = np.tile([1.5, 0.1, 0.8, 0, 0, 0], (20, 1))
    for ratio in (1.0, 1.3):
        more = {"propulsion_ratio": np.full(20, ratio), "wrench": np.zeros((20, 6))}
        problem = hd.prepare(PLANAR, log_of(velocity=velocity, **more), model)
        column = problem.regressor()[:, problem.equations.n_known]
        np.testing.assert_allclose(column, 1.5 * (ratio - 1.0), atol=1e-15)


def test_locked_axes_are_zero_and_leave_the_table():
    problem = hd.prepare(PLANAR, log_of(wrench=np.ones((20, 6))), hd.catalog["prestero"])
    assert not problem.inputs.velocity[:, 2:5].any()
    assert not problem.inputs.wrench[:, 2:5].any()
    assert problem.models[0].labels == (
        "X_r^2", "X_u|u|", "X_vr", "Y_v|v|", "Y_r|r|", "Y_uv", "Y_ur",
        "N_v|v|", "N_r|r|", "N_uv", "N_ur",
    )  # fmt: skip


def test_missing_attitude_matters_where_weight_acts_along_it(refused):
    log = log_of(attitude=None, wrench=np.zeros((20, 6)))
    refused(ProblemError, hd.prepare, BARE, log, LINEAR)
    floating = replace(BARE, center_of_gravity=BARE.center_of_buoyancy)
    assert hd.prepare(floating, log, LINEAR).n_samples == 20
    refused(ProblemError, hd.prepare, floating, log, LINEAR.with_terms({"K": "down_y"}))


def test_wrench_and_commands_together_are_refused_with_which_to_drop(refused):
    log = log_of(wrench=np.zeros((20, 6)), commands=commands_of())
    refused(ProblemError, hd.prepare, VEHICLE, log, LINEAR)


def test_a_wrench_needs_no_actuators_and_no_commands():
    problem = hd.prepare(VEHICLE, log_of(wrench=np.ones((20, 6))), LINEAR)
    assert not problem.equations.actuators
    np.testing.assert_array_equal(problem.inputs.wrench, np.ones((20, 6)))
    log = log_of(wrench=np.ones((20, 6)), commands={"tether": np.ones(20)})
    problem = hd.prepare(VEHICLE, log, LINEAR.with_terms({"X": "tether"}))
    assert problem.equations.channels == ("tether",)


def test_all_lacks_are_named_at_once(refused):
    log = hd.Log.from_arrays([0.0, 0.1], {"u": [1, 1]}, commands={"rpm": [1, 1]})
    refused(ProblemError, hd.prepare, VEHICLE, log, LINEAR)
    refused(MethodError, hd.prepare, VEHICLE, [log], LINEAR)
