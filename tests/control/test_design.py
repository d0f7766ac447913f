"""Trims, linear models and margins against equation 1, published gains and other programs."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.control.design import Outcome, design_control
from hydrodamp.control.loop_margins import hold, loop_margins
from hydrodamp.errors import HydrodampError
from hydrodamp.experiment_design.envelope import Envelope, LoopGains
from hydrodamp.simulation.damping_estimate import published_damping

VEHICLE = hd.fleet["vt690"]
DAMPING = published_damping(VEHICLE)
UNCERTAIN = replace(DAMPING, covariance=np.diag((0.1 * DAMPING.coefficients) ** 2))
FIELD = Envelope(
    autopilot=LoopGains(heading=(3, 0.005, 3), pitch=(4.5, 0.2, 7), depth=(0.07, 0.001, 0.095))
)


def at(speed, **settings):
    return design_control(VEHICLE, UNCERTAIN, [speed], **{"draws": 5, **settings}).speeds[0]


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_the_trim_balances_drag_and_thrust(speed):
    entry = at(speed)
    drag = -DAMPING["X_u|u|"] * speed**2
    assert entry.model.force[0, 0] == pytest.approx(drag, rel=1e-6)
    assert entry.model.commands[0] == pytest.approx([0.0, 0.0, 1000.0 * speed], rel=1e-4, abs=1e-6)


def test_a_heavy_vehicle_pitches_to_hold_its_depth():
    heavy = replace(VEHICLE, weight=VEHICLE.weight + 5.0)
    entry = design_control(heavy, replace(DAMPING, vehicle=None), [1.5]).speeds[0]
    state = np.zeros(10)
    state[0] = 1.5
    assert entry.model.exists[0]
    assert np.abs(entry.model.state[0] - state).max() > 0.01
    u, w, pitch = entry.model.state[0][[0, 2, 7]]
    assert np.cos(pitch) * w == pytest.approx(np.sin(pitch) * u, abs=1e-6)  # no depth rate


def test_the_linear_model_is_the_slope_of_published_coefficients():
    entry = at(2.0)
    model, mass = entry.model, VEHICLE.mass_matrix
    drag = np.eye(6)[0] * 2.0 * DAMPING["X_u|u|"] * 2.0
    assert model.a[0, 0, 0] == pytest.approx(np.linalg.solve(mass, drag)[0], rel=1e-6)
    assert model.a[0, 9, 7] == pytest.approx(-2.0)  # depth rate of a pitch
    fins = np.linalg.solve(mass, [0.0, 0.0, 9.0728 * 4.0, 0.0, 9.1827 * 4.0, 0.0])
    assert model.b[0, :6, 1] == pytest.approx(fins, rel=1e-6, abs=1e-9)


@pytest.mark.slow
def test_the_linear_loop_predicts_the_simulated_step():
    """A small step of the full equation of motion is that of the linear closed loop."""
    entry = at(2.0, envelope=FIELD)
    assert entry.outcome is Outcome.OK
    setpoint = entry.step.setpoints[:, 0, 2]
    (a, *_), (b, *_) = hold(entry.model, 0.1)
    x, z, depths = np.zeros(10), np.zeros(3), []
    x[9] = 0.0
    for target in setpoint:
        depths.append(x[9])
        shown = x.copy()
        shown[9] -= target
        c = entry.law.c @ z + entry.law.d @ shown
        z = entry.law.a @ z + entry.law.b @ shown
        x = a @ x + b @ c
    simulated = entry.step.states[:, 0, 11]
    assert simulated[-1] == pytest.approx(setpoint[-1], rel=0.2)
    assert np.abs(simulated - depths).max() < 0.25 * setpoint[-1]  # fins and angles are limited


@pytest.mark.slow
def test_the_published_autopilot_has_an_acceptable_margin():
    design = design_control(VEHICLE, UNCERTAIN, [1.0, 1.5, 2.0], envelope=FIELD, draws=20)
    assert design.accepted
    assert str(design).startswith("Acceptable: the smallest modulus margin over 20 draws is 0.5")


@pytest.mark.slow
@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_the_gain_margin_is_the_limit_of_stability(share, stable):
    entry = at(2.0, envelope=FIELD, draws=0)
    elevator = VEHICLE.actuators[1]
    factor = share * entry.margins.gain[0, 1]
    stronger = replace(
        elevator,
        force={axis: factor * each for axis, each in dict(elevator.force).items()},
        drag={},
    )
    vehicle = replace(VEHICLE, actuators=(VEHICLE.actuators[0], stronger, VEHICLE.actuators[2]))
    scaled = design_control(vehicle, DAMPING, [2.0], envelope=FIELD).speeds[0]
    assert (scaled.margins.growth[0] <= 1e-6) is np.bool_(stable)


def test_margins_of_a_delayed_integrator():
    """L = k exp(-s d) / s: crossover k, phase margin 90 deg - k d, gain margin pi / (2 k d)."""
    omega, k, d = np.geomspace(1e-3, 1e2, 20000), 2.0, 0.1
    gain, phase, delay = loop_margins(k * np.exp(-1j * omega * d) / (1j * omega), omega)
    assert gain == pytest.approx(np.pi / (2.0 * k * d), rel=1e-3)
    assert phase == pytest.approx(90.0 - np.degrees(k * d), rel=1e-3)
    assert delay == pytest.approx((np.pi / 2.0 - k * d) / k, rel=1e-3)


def test_a_speed_beyond_the_propeller_has_no_trim():
    design = design_control(VEHICLE, DAMPING, [2.0, 9.0])
    assert [each.outcome for each in design.speeds] == [Outcome.OK, Outcome.NO_TRIM]
    assert "at 9 m/s no trim" in str(design)


def test_draws_beyond_the_propeller_are_uncertain():
    entry = at(3.79, draws=20)  # the estimate's limit is 3.792 m/s
    assert entry.model.exists[0]
    assert not entry.model.exists.all()
    assert entry.outcome is Outcome.UNCERTAIN


@pytest.mark.slow
def test_an_unstable_loop_is_an_outcome():
    entry = at(2.0, envelope=Envelope(autopilot=LoopGains(pitch=(200, 0, 0))))
    assert entry.outcome is Outcome.UNSTABLE
    assert entry.margins.modulus[0, 1] == 0.0


@pytest.mark.parametrize("speeds", [[], [-1.0], [np.nan]])
def test_wrong_speeds_are_refused(speeds):
    with pytest.raises(HydrodampError, match="`speed` must be"):
        design_control(VEHICLE, DAMPING, speeds)
