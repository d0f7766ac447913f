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

import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.report.figures.diagnostics import power_figure

pytest.importorskip("matplotlib", reason="figures need the extra hydrodamp[report]")

pictured = pytest.mark.mpl_image_compare(baseline_dir="baseline", savefig_kwargs={"dpi": 72})


def shapes(figure):
    """Return a figure without its letters, panels where matplotlib puts them."""
    from matplotlib.text import Text

    figure.set_layout_engine("none")
    for text in figure.findobj(Text):
        text.set_visible(False)
    return figure


@pictured
def test_front(comparison):
    return shapes(hd.front_figure(comparison))


@pictured
def test_replays(comparison):
    return shapes(hd.replays_figure(comparison.rows[:2]))


@pictured
def test_power():
    box = OperatingBox([0.5, -0.4, 0.0, 0.0, 0.0, -0.3], [2.0, 0.4, 0.0, 0.0, 0.0, 0.3])
    damping = hd.Damping.from_dict(None, {"X_u": -3.0, "Y_v": 8.0, "N_r": -10.0})
    return shapes(power_figure(hd.Fit(damping, "weak", hd.Status.OK), box))
