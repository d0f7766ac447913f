"""Velocity of a BlueROV2 without DVL by an EKF: ``python velocity_filter.py DATA``.

The model is identified from two runs with velocities. On a third run the filter gets commands,
attitude, angular rates and depth; the recorded linear velocities only measure its error.
"""

import sys
from pathlib import Path

import numpy as np

import hydrodamp as hd
from hydrodamp.data.attitude import down_vectors
from hydrodamp.kernels.core import coriolis

HERE, SUBSTEPS = Path(__file__).parent, 4


def main(data: Path) -> dict[str, float]:
    """Return the RMS error of u, v and w [m/s]."""
    names = "run_11_40_38", "run_11_57_50", "run_11_10_52"
    *train, test = (hd.read_log(data / f"{name}.csv", HERE / "mapping.yaml") for name in names)
    vehicle = hd.read_vehicle(HERE / "vehicle.yaml")
    model = {each.key: each for each in hd.read_models(HERE / "models.yaml")}["tank"]
    problem = hd.prepare(vehicle, hd.concatenate(train), model)
    fit = hd.find_method("recommended").identify(problem, model)
    noise, damping = fit.noise, fit.damping
    inverse, tau = np.linalg.inv(vehicle.mass_matrix), noise.time_constant

    # States: velocity (6), push on each axis (6), depth.
    def rate(x, down, commands):
        velocity = np.ascontiguousarray(x[:, :6])
        wrench = coriolis(vehicle.mass_matrix, velocity) + down @ vehicle.restoring_matrix.T
        wrench = wrench + damping.wrench(velocity, down=down, commands=commands) + x[:, 6:12]
        depth_rate = np.sum(velocity[:, :3] * down, axis=1, keepdims=True)
        return np.hstack([wrench @ inverse, -x[:, 6:12] / tau, depth_rate])

    intensity = np.zeros((13, 13))
    intensity[6:12, 6:12] = np.diag(2.0 * noise.push**2 / tau)
    measured = [3, 4, 5, 12]
    depth = -np.genfromtxt(data / f"{names[-1]}.csv", delimiter=",", names=True)["z_m"]
    values = np.column_stack([test.velocity[:, 3:], depth])
    variance = np.diag(np.append(noise.sensor[3:], 0.02) ** 2)
    x, step = np.append(np.zeros(12), values[0, 3]), 1e-5 * np.eye(13)
    p = np.diag(np.append(np.ones(6) * 0.01, np.append(noise.push**2, 0.01)))
    estimates = np.empty((test.n, 3))
    for k, down in enumerate(down_vectors(test.attitude)):
        if k:
            h = (test.time[k] - test.time[k - 1]) / SUBSTEPS
            held = dict(zip(test.command_names, test.commands[k - 1], strict=True))
            for _ in range(SUBSTEPS):
                points = np.vstack([x + step, x - step])
                rates = rate(
                    points, np.tile(down, (26, 1)), {n: np.full(26, c) for n, c in held.items()}
                )
                f = np.eye(13) + h * ((rates[:13] - rates[13:]) / 2e-5).T
                x = x + h * rates.mean(axis=0)
                p = f @ p @ f.T + h * intensity
        gain = p[:, measured] @ np.linalg.inv(p[np.ix_(measured, measured)] + variance)
        x = x + gain @ (values[k] - x[measured])
        p = p - gain @ p[measured]
        estimates[k] = x[:3]
    error = np.sqrt(np.mean((estimates - test.velocity[:, :3]) ** 2, axis=0))
    motion = np.sqrt(np.mean(test.velocity[:, :3] ** 2, axis=0))
    for name, rms, size in zip("uvw", error, motion, strict=True):
        print(f"{name}: RMS error {rms:.3f} m/s, of a motion of {size:.3f} m/s")
    return dict(zip("uvw", error.tolist(), strict=True))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
