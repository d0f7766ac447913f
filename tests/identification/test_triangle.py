"""The triangle: mergeable, the same as all rows at once, never a Gram matrix."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import OutlierWarning, ProblemError
from hydrodamp.identification.regression import accumulate, column_span, damping_wrench, merge


@pytest.fixture
def problem(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["gertler-hagen"])
    return hd.prepare(vehicle, exact_log(truth), [hd.catalog[k] for k in hd.PAPER_MODELS])


def rows_of(problem):
    xi = problem.regressor()[:, problem.equations.n_known :]
    return np.hstack([xi, damping_wrench(problem, problem.log.acceleration)])


def segments_of(problem):
    for segment in problem.log.segments:
        part = hd.prepare(problem.vehicle, problem.log.select(segment.name), problem.models)
        yield accumulate(part)


def test_segments_in_any_order_make_the_triangle_of_all_rows(problem):
    rows, (a, b, c) = rows_of(problem), segments_of(problem)
    for triangle in (accumulate(problem), merge([a, b, c]), c.merge(a.merge(b))):
        assert triangle.n_samples == len(rows)
        np.testing.assert_allclose(
            triangle.r.T @ triangle.r, rows.T @ rows, rtol=1e-9, atol=1e-9 * np.abs(rows).max() ** 2
        )
        assert not np.tril(triangle.r, -1).any()


def test_triangles_of_different_terms_do_not_merge(problem, vehicle):
    other = hd.prepare(vehicle, problem.log, hd.catalog["fossen"])
    with pytest.raises(ProblemError, match="different terms"):
        accumulate(problem).merge(accumulate(other))
    with pytest.raises(ProblemError, match="at least one"):
        merge([])


def test_near_collinear_columns_keep_their_coefficients(vehicle, exact_log):
    """Speed hardly varies under way: at condition 1e7 a Gram matrix gives wrong numbers."""
    model = hd.DampingModel.from_table({"X": "1 u u^2 u^2|u|"}, key="cubic")
    truth = hd.Damping(model, [3.0, -2.0, 1.5, -0.5])
    with pytest.warns(OutlierWarning, match="`X`: 3000 of 3000 samples .*; all are kept"):
        problem = hd.prepare(vehicle, exact_log(truth, forward=40.0), model)
    triangle = accumulate(problem)
    design = triangle.r[:, :4]
    scaled = design / np.linalg.norm(design, axis=0)
    assert np.linalg.cond(scaled) > 1e6
    fit = hd.LeastSquares().solve(triangle, problem, model)
    error = fit.damping.coefficients / truth.coefficients - 1
    gram = np.linalg.solve(design.T @ design, design.T @ triangle.r[:, 4])
    assert np.abs(error).max() < 1e-3 * np.abs(gram / truth.coefficients - 1).max()


def test_a_column_of_zeros_has_a_coefficient_of_exactly_zero():
    columns = np.random.default_rng(4).normal(size=(300, 40)) * (np.arange(40) % 3 > 0)
    span = column_span(columns, range(40))
    amounts = span.coefficients @ (span.directions.T @ np.ones(300))
    assert np.all(amounts[::3] == 0.0)
    assert span.aliased == tuple((place,) for place in range(0, 40, 3))


def test_a_long_log_keeps_no_rows(vehicle, exact_log, true_damping, monkeypatch):
    """The same coefficients from a triangle made block by block; residuals count as white."""
    truth = true_damping(hd.catalog["linear"])
    problem = hd.prepare(vehicle, exact_log(truth, n=900), truth.model)
    kept = hd.LeastSquares().identify(problem, truth.model)
    monkeypatch.setattr("hydrodamp.identification.least_squares.MAX_ROWS", 800)
    fit = hd.LeastSquares().identify(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients, kept.damping.coefficients, rtol=1e-9)
    assert kept.uncertainty is not None
    assert fit.uncertainty is None
    assert "white residuals" in str(fit)
