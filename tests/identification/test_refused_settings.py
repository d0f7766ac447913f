"""Settings out of range are refused with the name of the setting, or with its value."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipativity import OperatingBox
from hydrodamp.identification.fit import Uncertainty
from hydrodamp.identification.regression import folds
from hydrodamp.identification.weak_form import WeakRegression

from .test_folds import rows_of

NAN, INF, COVARIANCE = float("nan"), float("inf"), np.eye(2)


@pytest.mark.parametrize(
    ("make", "name", "values"),
    [
        (WeakRegression, "support", (0.0, NAN)),
        (WeakRegression, "overlap", (0,)),
        (WeakRegression, "windows", ((4,), (1,))),
        (hd.StepwiseSelection, "windows", ((), (-1.0,))),
        (hd.RecursiveLeastSquares, "block", (0.0,)),
        (hd.RecursiveLeastSquares, "prior", (-1.0, INF)),
        (hd.RecursiveLeastSquares, "memory", (0.5, NAN)),
        (hd.AdaptiveIdentifier, "a", (0.0, -1.0)),
        (hd.AdaptiveIdentifier, "gamma", ((1.0, 2.0), NAN)),
        (hd.AdaptiveIdentifier, "passes", (0, 1.5)),
        (hd.CompositeIdentifier, "memory", (0.0,)),
        (hd.Ridge, "strength", (-1.0, NAN, INF)),
        (hd.SavitzkyGolay, "window", (0.0, -1.0)),
        (hd.SavitzkyGolay, "order", (0, 6)),
        (hd.OutputError, "windows", ((0.0,), (5.0, 5.0), (NAN,))),
        (hd.OutputError, "max_iterations", (0,)),
        (lambda noise: Uncertainty(COVARIANCE, 5.0, "", noise), "noise", (np.eye(3),)),
        (lambda shape: Uncertainty(np.zeros(shape), 5.0, ""), "shape", ((2, 3),)),
        (lambda freedom: Uncertainty(COVARIANCE, freedom, ""), "degrees_of_freedom", (0.0,)),
        (Uncertainty(COVARIANCE, 5.0, "").critical_value, "level", (1.0,)),
        (lambda low: OperatingBox(low, [1] * 6), "low", ([0] * 5,)),
        (lambda v: OperatingBox([0, 2, 0, 0, 0, 0], [1, v, 1, 1, 1, 1]), "v", (1,)),
        (lambda w: OperatingBox([0] * 6, [1, 1, w, 1, 1, 1]), "w", (INF,)),
        (lambda n: folds(rows_of(50), n), "folds", (1,)),
        (lambda n: folds(rows_of(3), n), "3 rows .* 5 folds", (5,)),
        (lambda gap: folds(rows_of(50), gap=gap), "gap", (-1.0, NAN)),
        (lambda gap: folds(rows_of(40), gap=gap), "fold 1 is empty", (2.0,)),
    ],
)
def test_a_setting_out_of_range_is_refused_by_its_name(make, name, values):
    for value in values:
        with pytest.raises(MethodError, match=rf"\b{name}\b"):
            make(**{name: value}) if isinstance(make, type) else make(value)
