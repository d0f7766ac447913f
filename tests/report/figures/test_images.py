"""What figures look like, against pictures that were looked at.

Each is drawn from numbers written down here, so that no method's rounding moves it. They are
compared by pytest-mpl: the root mean square of the difference of all pixels, of 255, must
stay below the tolerance in ``pyproject.toml``; a line, a band or a limit that is missing makes
nearly twice of it or more. Letters are left out, and with them the layout that makes room
for them: they are drawn differently by every release of FreeType. What they say, and that
it is on the sheet, is asserted beside. After a change that is meant,
``pytest tests/report/figures/test_images.py --mpl-generate-path=tests/report/figures/baseline``
draws them anew; look at them before they are kept.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import AxisIdentifiability, Grade, Identifiability

if TYPE_CHECKING:
    from matplotlib.figure import Figure

pytest.importorskip("matplotlib", reason="figures need the extra hydrodamp[report]")

pictured = pytest.mark.mpl_image_compare(baseline_dir="baseline", savefig_kwargs={"dpi": 72})


def shapes(figure: Figure) -> Figure:
    """Return a figure without its letters, panels where matplotlib puts them."""
    from matplotlib.text import Text

    figure.set_layout_engine("none")
    for text in figure.findobj(Text):
        text.set_visible(False)
    return figure


def wavy() -> hd.Log:
    """Two segments of sines, long enough to be drawn by extremes, with commands."""
    time = 0.1 * np.arange(4000)
    names = np.repeat(["dive", "turn"], 2000)
    velocity = {name: np.sin((k + 1) * time / 40.0) for k, name in enumerate("uvwpqr")}
    commands = {"rudder": np.sign(np.sin(time / 15.0)), "rpm": 1000.0 + time}
    angles = {"roll": 0.1 * velocity["p"], "pitch": 0.2 * velocity["q"], "yaw": time / 60.0}
    return hd.Log.from_arrays(
        time, velocity, commands=commands, attitude=quaternions(**angles), segment=names
    )


def quaternions(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Return quaternions."""
    from hydrodamp.data.attitude import quaternion_from_euler

    return quaternion_from_euler(np.column_stack([roll, pitch, yaw]))


def fit() -> hd.Fit:
    """Coefficients that count down from -1, neighbours tied the closer the farther on."""
    model = hd.catalog["fossen"]
    n = model.n_coefficients
    spread = np.linspace(0.1, 2.0, n)
    order = np.arange(n)
    tied = 0.9 ** np.abs(order[:, None] - order) * (-1.0) ** (order[:, None] + order)
    damping = hd.Damping(model, -np.arange(1.0, n + 1), np.outer(spread, spread) * tied)
    return hd.Fit(damping, "ls", hd.Status.OK, n)


@pictured
def test_velocities() -> Figure:
    return shapes(hd.velocities_figure(wavy()))


@pictured
def test_commands() -> Figure:
    return shapes(hd.commands_figure(wavy()))


@pictured
def test_front(comparison: hd.Comparison) -> Figure:
    return shapes(hd.front_figure(comparison))


@pictured
def test_coefficients() -> Figure:
    other = fit()
    online = replace(other.damping, coefficients=0.8 * other.damping.coefficients, covariance=None)
    return shapes(
        hd.coefficients_figure([other, replace(other, damping=online, method="ai", rank=None)])
    )


@pictured
def test_correlation() -> Figure:
    return shapes(hd.correlation_figure(fit()))


@pictured
def test_excitation() -> Figure:
    model = hd.catalog["linear"]
    axes = tuple(
        AxisIdentifiability(
            axis=axis,
            labels=model.labels[6 * k : 6 * k + 6],
            grades=(Grade.DETERMINED,) * (5 - k) + (Grade.WEAK,) + (Grade.NOT_DETERMINED,) * k,
            inflation=(1.0,) * 6,
            rank=6,
            condition=10.0,
            share=0.95 - 0.16 * k,
            excited=k < 5,
            groups=(),
        )
        for k, axis in enumerate("XYZKMN")
    )
    return shapes(hd.excitation_figure(Identifiability(model, axes)))


@pictured
def test_horizons() -> Figure:
    def scores(*errors: float | None) -> hd.HorizonScores:
        horizons = ("step", 1.0, 10.0, "run")
        return hd.HorizonScores(
            tuple(
                hd.HorizonScore(
                    horizon, hd.Score(rms, {}, {}, "deg", ()), 12, 3 if rms is None else 0
                )
                for horizon, rms in zip(horizons, errors, strict=True)
            )
        )

    return shapes(
        hd.horizons_figure(
            {
                ("linear", "recommended"): scores(0.05, 0.1, 0.3, 0.5),
                ("linear", "ls"): scores(0.05, 0.2, 0.9, 2.5),
                ("fossen", "ls"): scores(0.06, 0.4, None, None),
            }
        )
    )


@pictured
def test_power() -> Figure:
    box = hd.OperatingBox([0.5, -0.4, 0.0, 0.0, 0.0, -0.3], [2.0, 0.4, 0.0, 0.0, 0.0, 0.3])
    damping = hd.Damping.from_dict(None, {"X_u": -3.0, "Y_v": 8.0, "N_r": -10.0})
    return shapes(hd.power_figure([hd.Fit(damping, "weak", hd.Status.OK)], box))


@pictured
def test_history() -> Figure:
    time = np.linspace(0.0, 100.0, 1000)
    values = np.column_stack([-k * (1.0 - np.exp(-time / (5.0 * k))) for k in range(1, 5)])
    errors = np.exp(-time / 20.0)[:, None] * np.sin(time[:, None] * np.arange(1, 7) / 3.0)
    history = hd.History(time, 0.1 * errors, values, ("X_u", "X_u|u|", "N_v", "N_r"))
    return shapes(hd.history_figure(history))
