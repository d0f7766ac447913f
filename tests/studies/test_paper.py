"""The study of the paper's identifier: gains that do in SI units what it does in deg/s."""

from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.online import initial_coefficients
from hydrodamp.kernels.core import coriolis

STUDIES = Path(__file__).parents[2] / "studies"


def in_degrees(vehicle, log, model):
    """Equations 15 and 16 with a = gamma = 20 and every rate in deg/s, by the midpoint rule."""
    unit = np.array([1.0] * 3 + [180.0 / np.pi] * 3)
    mass, nu = vehicle.mass_matrix / unit, log.velocity * unit
    ratio, mask = log.propulsion_ratio, model.mask
    xi = model.basis.evaluate(nu, propulsion_ratio=ratio)
    known = coriolis(vehicle.mass_matrix, log.velocity) + log.wrench
    known = known + vehicle.restoring_wrench(log.down)
    table, error = model.unpack(initial_coefficients(model)), np.zeros(6)
    for k, h in enumerate(np.diff(log.time)):
        if k + 1 in log.bounds[:, 0]:
            error = np.zeros(6)
            continue
        term, force = (xi[k] + xi[k + 1]) / 2, (known[k] + known[k + 1]) / 2
        left = 2 * mass / h + np.diag(20 + h * 20 * (mask @ term**2) / 2)
        right = 2 * mass @ error / h + force + table @ term - mass @ (nu[k + 1] - nu[k]) / h
        middle = np.linalg.solve(left, right)
        table = table - h * 20 * np.outer(middle, term) * mask
        error = 2 * middle - error
    return hd.Damping(model, model.pack(table))


@pytest.mark.parametrize("key", ["linear", "pitch-yaw", "gertler-hagen"])
def test_gains_do_in_si_units_what_rates_in_deg_s_do(key, study, vehicle, exact_log, true_damping):
    """57.3 a, and 57.3^(1 + 2 d) or 57.3^(2 d) gamma for terms with d rates: the same wrench."""
    model = hd.catalog[key]
    log = exact_log(true_damping(hd.catalog["linear"]), n=90, forward=1.5)
    problem = hd.prepare(vehicle, log, model)
    fit = study.InDegrees(starts_in_degrees=True).identify(problem, model)
    oracle = in_degrees(vehicle, log, model)
    turned = log.velocity * ([1.0] * 3 + [180.0 / np.pi] * 3)
    expected = oracle.wrench(turned, propulsion_ratio=log.propulsion_ratio)
    found = fit.damping.wrench(log.velocity, propulsion_ratio=log.propulsion_ratio)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
