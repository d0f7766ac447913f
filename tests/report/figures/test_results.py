"""The front, horizons, excitation, residuals, power and histories as drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.dissipation.power_range import power_range
from hydrodamp.identification.trust.residual_series import left_over, series, white_reach
from hydrodamp.report.figures.apart import colour_of
from hydrodamp.report.figures.excitation import excitation_figure
from hydrodamp.report.figures.front import front_figure
from hydrodamp.report.figures.histories import history_figure
from hydrodamp.report.figures.horizons import horizons_figure
from hydrodamp.report.figures.power import power_figure
from hydrodamp.report.figures.residuals import residuals_figure
from hydrodamp.report.figures.spacing import columns_of, pushed_apart

from .conftest import labels, legend


class TestFront:
    def test_every_row_is_there_and_the_front_joins_the_best(self, comparison, on_sheet):
        figure = front_figure(comparison)
        (panel,) = figure.axes
        best = hd.front(comparison)
        steps = panel.lines[0]
        assert steps.get_xdata() == pytest.approx([row.n_coefficients for row in best])
        assert list(steps.get_ydata()) == [row.rms for row in best]
        marked = [line for line in panel.lines[1:] if len(line.get_xdata()) == 1]
        crosses = [line for line in marked if line.get_marker() == "x"]
        assert len(marked) == len(comparison.rows)
        assert len(crosses) == sum(row.rms is None for row in comparison.rows)
        assert legend(figure) == ["ls", "ai", "front", "not settled"]
        assert panel.get_ylabel() == "RMS error, eq. 24 [m/s and deg/s]"
        assert {text.get_text() for text in panel.texts} >= {"linear", "fossen", "coe", "no error"}
        on_sheet(figure)

    def test_rows_that_have_not_settled_are_hollow(self, comparison):
        faces = {
            (line.get_color(), line.get_markerfacecolor())
            for line in front_figure(comparison).axes[0].lines[1:]
            if line.get_marker() not in ("x", "None")
        }
        assert (colour_of("ai"), "white") in faces
        assert (colour_of("ls"), colour_of("ls")) in faces

    def test_rows_without_any_error_still_make_a_figure(self, comparison):
        lost = tuple(row for row in comparison.rows if row.rms is None)
        figure = front_figure(replace(comparison, rows=lost))
        assert legend(figure) == ["ls", "ai", "front"]

    def test_one_row_makes_a_figure_without_a_lane(self, comparison):
        figure = front_figure(replace(comparison, rows=comparison.rows[:1]))
        assert not figure.axes[0].patches

    def test_an_empty_comparison_is_refused(self):
        with pytest.raises(hd.MethodError, match="no row with coefficients"):
            front_figure(hd.Comparison(()))

    @pytest.mark.parametrize("seed", range(4))
    def test_names_are_pushed_apart_in_order_and_no_farther(self, seed):
        places = np.sort(np.random.default_rng(seed).random(9)).tolist()
        moved = np.array(pushed_apart(places, 0.034))
        assert np.all(np.diff(moved) >= 0.034 - 1e-12)
        assert np.mean(moved) == pytest.approx(np.mean(places))
        assert pushed_apart([0.1, 0.5, 0.9], 0.034) == pytest.approx([0.1, 0.5, 0.9])
        held = np.array(pushed_apart(places, 0.1, (0.0, 1.0)))
        assert 0.0 <= held[0] <= held[-1] <= 1.0
        assert np.all(np.diff(held) >= 0.1 - 1e-12)

    def test_models_of_one_size_stand_side_by_side(self, comparison):
        row = comparison.rows[0]
        model = replace(row.fit.model, key="twin")
        twin = replace(row, fit=replace(row.fit, damping=replace(row.fit.damping, model=model)))
        rows = (*comparison.rows, twin)
        columns = columns_of(rows)
        assert list(columns.values()) == sorted(columns.values())
        left, right = columns[36, "linear"], columns[36, "twin"]
        assert 36.0 < 1.05 * left < 1.05 * right < 1.1 * 36.0
        assert columns[12, "fossen"] == pytest.approx(12.0)
        panel = front_figure(replace(comparison, rows=rows)).axes[0]
        drawn = {float(line.get_xdata()[0]) for line in panel.lines if len(line.get_xdata()) == 1}
        assert {left, right} <= drawn
        assert {"linear", "twin"} <= {text.get_text() for text in panel.texts}


class TestHorizons:
    def scores(self, errors, lost=()):
        """Scores by horizon; those of `lost` have no error."""
        return hd.HorizonScores(
            tuple(
                hd.HorizonScore(
                    horizon,
                    hd.Score(None if horizon in lost else error, {}, {}, "deg", ()),
                    12,
                    3 if horizon in lost else 0,
                )
                for horizon, error in errors.items()
            )
        )

    def test_horizons_rise_and_divergence_is_counted(self, on_sheet):
        good = self.scores({"run": 0.9, 10.0: 0.5, "step": 0.1, 1.0: 0.2})
        bad = self.scores({"step": 0.1, 1.0: 0.3, 10.0: 0.0, "run": 0.0}, lost=(10.0, "run"))
        figure = horizons_figure({("linear", "ls"): good, ("fossen", "ls"): bad})
        (panel,) = figure.axes
        ticks = [text.get_text() for text in panel.get_xticklabels()]
        assert ticks == ["one step", "1 s", "10 s", "whole run"]
        assert list(panel.lines[0].get_ydata()) == [0.1, 0.2, 0.5, 0.9]
        crosses = [line for line in panel.lines if line.get_marker() == "x"]
        assert [line.get_xdata()[0] for line in crosses] == [2, 3]
        assert [text.get_text() for text in panel.texts].count("3/12") == 2
        assert legend(figure) == ["linear by ls", "fossen by ls"]
        assert panel.lines[0].get_color() == panel.lines[1].get_color()
        assert panel.lines[0].get_linestyle() != panel.lines[1].get_linestyle()
        on_sheet(figure)

    def test_nothing_and_mixed_units_are_refused(self):
        with pytest.raises(hd.MethodError, match="no score"):
            horizons_figure({})
        first = self.scores({"run": 1.0})
        (one,) = first.scores
        other = hd.HorizonScores((replace(one, score=replace(one.score, rate_unit="rad")),))
        with pytest.raises(hd.MethodError, match="rate_unit"):
            horizons_figure({("a", "ls"): first, ("b", "ls"): other})

    def test_where_nothing_diverged_there_is_no_lane(self):
        figure = horizons_figure({("a", "ls"): self.scores({"step": 0.1, "run": 1.0})})
        assert not figure.axes[0].patches

    def test_all_diverged_makes_a_figure(self):
        lost = self.scores({"run": 0.0}, lost=("run",))
        assert len(horizons_figure({("a", "ls"): lost}).axes) == 1


class TestExcitation:
    def test_bars_are_shares_and_counts(self, sailed, on_sheet):
        found = hd.identifiability(sailed.problem, hd.catalog["prestero"])
        quiet = replace(found.axes[2], share=0.1, excited=False)
        found = replace(found, axes=(*found.axes[:2], quiet, *found.axes[3:]))
        figure = excitation_figure(found)
        left, right = figure.axes
        assert [bar.get_width() for bar in left.patches] == [one.share for one in found.axes]
        total = sum(bar.get_width() for bar in right.patches)
        assert total == len(found.grades)
        assert "10 %, not predicted" in [text.get_text() for text in left.texts]
        assert legend(figure) == ["determined", "weak", "not determined"]
        assert left.get_xlabel() == "predicted share of\nthe response [1]"
        on_sheet(figure)

    def test_a_model_without_coefficients_is_refused(self):
        empty = hd.Identifiability(hd.catalog["linear"].restricted_to(()), ())
        with pytest.raises(hd.MethodError, match="has no coefficient"):
            excitation_figure(empty)


class TestResiduals:
    def test_the_spectrum_integrates_to_the_variance(self):
        rng = np.random.default_rng(0)
        noise = np.convolve(rng.standard_normal(700), [1.0, 0.8, 0.3], "valid")
        found = series(noise, np.repeat([0, 1], [300, len(noise) - 300]), 0.2)
        power = np.trapezoid(found.density, found.frequency)
        assert power == pytest.approx(np.mean(noise**2), rel=1e-6)
        assert found.correlation[0] == 1.0
        assert found.density.min() >= 0.0

    def test_correlation_is_that_of_a_moving_average_and_white_beyond(self):
        """MA(1) with weight 1 has correlation one half at lag one, none beyond."""
        rng = np.random.default_rng(1)
        noise = np.convolve(rng.standard_normal(5001), [1.0, 1.0], "valid")
        found = series(noise, np.zeros(5000, dtype=int), 1.0)
        assert found.correlation[1] == pytest.approx(0.5, abs=0.03)
        assert np.mean(np.abs(found.correlation[2:]) < 2.0 * white_reach(5000)) > 0.9

    def test_no_pair_crosses_a_join(self):
        apart = series(np.tile([1.0, 1.0, -1.0, -1.0], 2), np.repeat([0, 1], 4), 1.0)
        assert apart.correlation.tolist() == [1.0, 0.25]

    def test_zeros_are_not_divided_by(self):
        assert not series(np.zeros(40), np.zeros(40, dtype=int), 1.0).correlation.any()

    def test_short_series_are_refused(self):
        with pytest.raises(hd.MethodError, match="at least 4 residuals"):
            series(np.ones(3), np.arange(3), 1.0)

    def test_left_over_is_target_less_design_times_coefficients(self, sailed):
        rows = hd.WeakEquations(2.0, overlap=1, windows=()).rows(sailed.problem)
        damping = sailed.fit("linear", "weak").damping
        left = left_over(rows, damping)
        columns = [rows.basis.index(term) for term in damping.model.basis]
        assert left == pytest.approx(rows.target - rows.design[:, columns] @ damping.matrix.T)

    def test_axes_by_correlation_and_spectrum(self, sailed, on_sheet):
        fits = [sailed.fit("linear", "weak"), sailed.fit("fossen", "weak")]
        figure = residuals_figure(sailed.problem, fits, support=1.0)
        assert len(figure.axes) == 12
        assert [one.get_ylabel() for one in figure.axes[::2]] == [f"${x}$" for x in "XYZKMN"]
        assert figure.axes[-2].get_xlabel() == "lag [s]"
        assert figure.axes[-1].get_xlabel() == "frequency [Hz]"
        assert len(figure.axes[1].lines) == 2
        assert legend(figure)[-1] == "white residuals, 95 %"
        on_sheet(figure)

    def test_only_axes_with_coefficients_are_drawn(self, sailed):
        model = hd.DampingModel.from_table({"X": "u", "N": "r"}, key="two")
        fit = hd.Fit(hd.Damping(model, np.array([-1.0, -1.0])), "ls", hd.Status.OK)
        figure = residuals_figure(sailed.problem, [fit, sailed.fit("linear", "weak")], support=1.0)
        assert [len(panel.lines) for panel in figure.axes[1::2]] == [2, 1, 1, 1, 1, 2]
        assert len(residuals_figure(sailed.problem, [fit], support=1.0).axes) == 4

    def test_residuals_that_are_zero_make_a_figure(self, sailed):
        still = replace(sailed.train, velocity=np.zeros((sailed.train.n, 6)))
        still = replace(still, wrench=np.zeros((still.n, 6)), attitude=None)
        still = replace(still, command_names=(), commands=np.empty((still.n, 0)))
        vehicle = replace(sailed.vehicle, actuators=(), axes=("X", "Y", "N"))
        model = hd.DampingModel.from_table({"X": "u"}, key="drag")
        fit = hd.Fit(hd.Damping(model, np.array([-1.0])), "ls", hd.Status.OK)
        figure = residuals_figure(hd.prepare(vehicle, still, model), [fit], support=1.0)
        assert not np.asarray(figure.axes[0].lines[0].get_ydata()).any()

    def test_fits_without_numbers_are_refused(self, sailed):
        with pytest.raises(hd.MethodError, match="no residuals"):
            residuals_figure(sailed.problem, [])


class TestPower:
    box = hd.OperatingBox([1.0, -0.5, 0.0, 0.0, 0.0, 0.0], [2.0, 0.5, 0.0, 0.0, 0.0, 0.0])

    def test_the_range_is_that_of_the_formula(self):
        """Power -2 u^2 + 4 v^2 is least at v = 0 and greatest at v = 0.5, for every u."""
        damping = hd.Damping.from_dict(None, {"X_u": -2.0, "Y_v": 4.0})
        found = power_range(damping, self.box, "u")
        assert found.least == pytest.approx(-2.0 * found.velocity**2)
        assert found.greatest == pytest.approx(-2.0 * found.velocity**2 + 1.0)
        assert np.all((found.least <= found.middle) & (found.middle <= found.greatest))

    def test_velocities_that_move_have_a_panel(self, on_sheet):
        damping = hd.Damping.from_dict(None, {"X_u": -2.0, "Y_v": 4.0})
        figure = power_figure([hd.Fit(damping, "ls", hd.Status.OK)], self.box)
        assert labels(figure, "x") == ["$u$ [m/s]", "$v$ [m/s]"]
        assert legend(figure) == ["custom by ls: at most $-1$ W"]
        on_sheet(figure)

    def test_three_velocities_leave_no_empty_panel(self):
        box = hd.OperatingBox([1, -1, 0, 0, 0, -0.3], [2, 1, 0, 0, 0, 0.3])
        damping = hd.Damping.from_dict(None, {"X_u": -2.0, "N_r": 4.0})
        figure = power_figure([hd.Fit(damping, "ls", hd.Status.OK)], box, "rad")
        assert labels(figure, "x") == ["$u$ [m/s]", "$v$ [m/s]", "$r$ [rad/s]"]

    def test_no_fit_or_no_extent_is_refused(self):
        point = hd.OperatingBox([0.0] * 6, [0.0] * 6)
        fit = hd.Fit(hd.Damping.from_dict(None, {"X_u": -2.0}), "ls", hd.Status.OK)
        for fits, box in (([], self.box), ([fit], point)):
            with pytest.raises(hd.MethodError, match="box with an extent"):
                power_figure(fits, box)


class TestHistory:
    def test_coefficients_and_errors_over_time(self, sailed, on_sheet):
        model = hd.catalog["fossen"]
        history = hd.AdaptiveIdentifier().history(sailed.problem, model)
        figure = history_figure(history, sailed.fit("fossen", "weak").damping)
        assert len(figure.axes) == 8
        assert labels(figure)[0] == "$X$\ncoefficients [SI]"
        assert labels(figure)[-2:] == ["error\n[m/s]", "error\n[deg/s]"]
        line = figure.axes[0].lines[0]
        assert line.get_ydata()[-1] == history.coefficients[-1, 0]
        joins = len(sailed.train.segments) - 1
        assert len(figure.axes[0].lines) == 2 + joins
        assert figure.axes[-1].get_xlim()[1] == pytest.approx(sailed.train.duration, rel=0.01)
        on_sheet(figure)

    def test_passes_run_on_and_many_are_not_marked(self):
        time = np.tile(np.arange(1.0, 21.0), 30)
        values = np.column_stack([np.linspace(-1.0, -9.0, 600), np.zeros(600)])
        history = hd.History(time, np.zeros((600, 6)), values, ("X_u", "Y_v"))
        figure = history_figure(history)
        assert figure.axes[-1].get_xlim() == (0.0, 599.0)
        assert len(figure.axes[0].lines) == 1

    def test_of_many_coefficients_those_that_move_farthest_are_named(self):
        terms = hd.catalog["mcfarland-whitcomb"].labels[:36]
        values = np.outer(np.linspace(0.0, 1.0, 50), np.arange(36.0))
        history = hd.History(np.arange(50.0), np.zeros((50, 6)), values, terms)
        panel = history_figure(history).axes[0]
        assert len(panel.lines) == 36
        named = [text.get_text() for text in panel.get_legend().get_texts()]
        assert 1 <= len(named) <= 6
        assert len([line for line in panel.lines if line.get_color() == "#c4c4c4"]) == 36 - len(
            named
        )

    def test_an_empty_history_is_refused(self):
        with pytest.raises(hd.MethodError, match="no step"):
            history_figure(hd.History(np.zeros(0), np.zeros((0, 6)), np.zeros((0, 1)), ("X_u",)))
