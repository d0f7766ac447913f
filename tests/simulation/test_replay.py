"""Open-loop replay: the laws it keeps and how it says that it diverged."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

import hydrodamp as hd
import oracle
from hydrodamp.errors import ForeignVehicleWarning, MethodError
from hydrodamp.models.damping import VehicleStamp
from hydrodamp.simulation.replay import horizon_scores, score
from value_changes import set_values


def quiet_log(n=200, velocity=(1.5, 0.2, -0.1, 0.1, 0.05, -0.1), **more):
    start = np.tile(velocity, (n, 1))
    rng = np.random.default_rng(6)
    return hd.Log.from_arrays(
        np.arange(n) / 10, start, attitude=rng.normal(0, 0.05, (n, 3)), **more
    )


@pytest.mark.slow
def test_against_solve_ivp_with_the_equation_written_out(vehicle):
    """Equation 1 integrated by someone else's adaptive program."""
    log = quiet_log(30, wrench=np.random.default_rng(1).normal(0, 5, (30, 6)))
    damping = hd.Damping(hd.catalog["linear"], -20 * np.eye(6).ravel())
    trajectory = hd.simulate(vehicle, damping, log, max_step=0.005)
    slope = np.gradient(log.down, log.time, axis=0, edge_order=2)

    def rate(time, nu):
        coriolis = oracle.frame(vehicle.mass_matrix @ nu, nu)
        at = CubicHermiteSpline(log.time, log.down, slope)(time)
        wrench = [np.interp(time, log.time, column) for column in log.wrench.T]
        force = coriolis + vehicle.restoring_wrench(np.array([at]))[0] + wrench - 20 * nu
        return np.linalg.solve(vehicle.mass_matrix, force)

    settings = {"t_eval": log.time, "rtol": 1e-9, "atol": 1e-11, "max_step": 0.1}
    solution = solve_ivp(rate, (0, log.time[-1]), log.velocity[0], **settings)
    np.testing.assert_allclose(trajectory.velocity, solution.y.T, atol=2e-6)


def test_divergence_is_a_status(vehicle):
    log = quiet_log(90, wrench=np.zeros((90, 6)), segment=np.repeat(["calm", "wild", "end"], 30))
    log = set_values(log, "velocity", (np.s_[:30], 0.0), (np.s_[60:], 0.0))
    log = replace(log, attitude=np.tile([1.0, 0, 0, 0], (90, 1)))
    growing = hd.Damping(hd.catalog["linear"], 300 * np.eye(6).ravel())
    trajectory = hd.simulate(replace(vehicle, center_of_gravity=(0, 0, 0)), growing, log)
    assert trajectory.status is hd.Status.DIVERGED
    assert [name for name, _ in trajectory.diverged] == ["wild"]
    assert 0 < trajectory.diverged[0][1] < 3
    assert np.isnan(trajectory.velocity[59]).all()
    assert np.isfinite(trajectory.velocity[60:]).all()
    result = score(trajectory)
    assert result.rms is None
    assert result.status is hd.Status.DIVERGED
    assert set(result.rms_by_axis.values()) == {None}


def test_settings_are_checked(vehicle, refused):
    log = quiet_log(20, wrench=np.zeros((20, 6)))
    nothing = hd.Damping(hd.catalog["linear"], np.zeros(36))
    refused(MethodError, hd.simulate, vehicle, nothing, log, attitude="guessed")
    for step in (0.2, 1e-12):
        refused(MethodError, hd.simulate, vehicle, nothing, log, max_step=step)
    refused(MethodError, lambda: score(hd.simulate(vehicle, nothing, log), rate_unit="grad"))
    planar = replace(vehicle, axes=("X", "Y", "N"))
    velocity = {"u": [1, 1], "v": [0, 0], "r": [0, 0]}
    bare = hd.Log.from_arrays([0.0, 0.1], velocity, wrench=np.zeros((2, 6)))
    turning = hd.simulate(planar, nothing, bare, attitude="simulated")
    assert turning.status is hd.Status.OK


@pytest.mark.parametrize("use", [hd.simulate, horizon_scores])
def test_a_foreign_damping_warns(vehicle, use):
    stamp = VehicleStamp("other", weight=500.0, buoyancy=466.5)
    foreign = hd.Damping(hd.catalog["linear"], np.zeros(36), vehicle=stamp)
    with pytest.warns(ForeignVehicleWarning, match="weight"):
        use(vehicle, foreign, quiet_log(20, wrench=np.zeros((20, 6))))
