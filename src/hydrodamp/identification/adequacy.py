"""Adequacy of the form of a model: what may be done with its coefficients.

The score statistic of axis a, ``S_a = g' H⁻¹ g`` with the scores g of terms that the model lacks
and their information H, both after the coefficients of the model are eliminated, is chi-squared
with as many degrees of freedom d as there are independent terms where nothing is missing (C. R. Rao
(1948), doi:10.1017/S0305004100023987; J. Neyman's C(α) test (1959)). Terms are missing where its
probability is below ``MIN_PROBABILITY`` over the number of axes and they would explain more than
``MAX_MISSING_SHARE`` of the variance of the innovations, ``(S_a − d) / n`` for n samples. The noise
is wrong where the sum of squared autocorrelations of the innovations of a velocity exceeds that of
white ones by more than ``MAX_CORRELATION`` (G. M. Ljung and G. E. P. Box (1978),
doi:10.1093/biomet/65.2.297).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.models.catalog import catalog
from hydrodamp.status import TextEnum

#: Probability of a rejected form that holds, and share of the variance of the innovations that
#: missing terms may explain. Of 120 fits of true forms none is beyond both.
MIN_PROBABILITY, MAX_MISSING_SHARE = 1e-3, 0.01

#: Largest sum of squared autocorrelations of innovations, less that of white ones. It is below 0.03
#: for true forms, and 0.2 to 1.2 for measured logs.
MAX_CORRELATION = 0.05

#: Share from which terms are missing with any estimate of the noise.
CLEARLY_MISSING = 0.1

#: Least R² of held-out replays of a velocity that the model predicts.
MIN_PREDICTED = 0.5

#: Axes whose missing terms a sentence names.
MAX_NAMED_AXES = 3


class Form(TextEnum):
    """Whether the form of a model explains the log; the value says what that allows.

    Examples
    --------
    >>> Form.EFFECTIVE.word
    'effective'
    """

    ADEQUATE = (
        "adequate: no term is missing and the rest is noise and pushes; the coefficients are "
        "physical and may be compared, and used on other missions."
    )
    EFFECTIVE = (
        "effective: the coefficients predict motions like those of the log together; single values "
        "mean nothing."
    )
    INADEQUATE = "inadequate: it does not predict these velocities; take another form."


@dataclass(frozen=True)
class ScoreTest:
    """Score test of the terms that a model lacks on one axis.

    Attributes
    ----------
    statistic : float
        S_a [1].
    n_terms : int
        Degrees of freedom: independent terms.
    n_samples : int
        Samples n of the runs of the test, at most about 4000 of the log.
    terms : tuple of str
        Labels of the terms that explain most, where terms are missing.

    Examples
    --------
    >>> test = ScoreTest(statistic=210.0, n_terms=10, n_samples=2000, terms=("K_p|u|",))
    >>> test.missing_share, test.rejects(n_axes=6)
    (0.1, True)
    """

    statistic: float
    n_terms: int
    n_samples: int
    terms: tuple[str, ...] = ()

    @property
    def probability(self) -> float:
        """Probability of a larger statistic where nothing is missing."""
        return float(chdtrc(self.n_terms, self.statistic))

    @property
    def missing_share(self) -> float:
        """Share of the variance of the innovations that the terms would explain."""
        return (self.statistic - self.n_terms) / self.n_samples

    def rejects(self, n_axes: int) -> bool:
        """Return whether terms are missing.

        Parameters
        ----------
        n_axes : int
            Number of tests of the fit, over which the probability of an error is divided.

        Returns
        -------
        rejects : bool
            True where the statistic is improbable and the missing share matters.
        """
        is_improbable = self.probability < MIN_PROBABILITY / n_axes
        return is_improbable and self.missing_share > MAX_MISSING_SHARE


@dataclass(frozen=True)
class Adequacy:
    """What the data say of the form of a model.

    Attributes
    ----------
    form : Form
        The result.
    axes : tuple of str
        Axes on which terms are missing or the noise is wrong; those that are not predicted where
        the form is inadequate.
    tests : dict of str to ScoreTest
        Score test of each axis.
    correlations : dict of str to float
        Sum of squared autocorrelations of the innovations of each velocity, by axis.

    Examples
    --------
    >>> tests = {"K": ScoreTest(210.0, 10, 2000, ("K_p|u|",)), "N": ScoreTest(9.0, 10, 2000)}
    >>> print(Adequacy.judge(tests, {"K": 0.0, "N": 0.01}, {"K": 0.9, "N": 0.8}))
    Form: effective; missing terms, in % of the unexplained motion: K 10.
    """

    form: Form
    axes: tuple[str, ...]
    tests: dict[str, ScoreTest]
    correlations: dict[str, float]

    @classmethod
    def judge(
        cls,
        tests: dict[str, ScoreTest],
        correlations: dict[str, float],
        r_squared: dict[str, float],
    ) -> Adequacy:
        """Judge the form of a model.

        Parameters
        ----------
        tests : dict of str to ScoreTest
            By axis.
        correlations : dict of str to float
            Sum of squared autocorrelations of the innovations of each velocity, by axis, beyond
            that of white ones.
        r_squared : dict of str to float
            R² of held-out replays of each velocity that moves, by axis.

        Returns
        -------
        adequacy : Adequacy
            Adequate where no test rejects and all innovations are white, else effective or, where a
            velocity is not predicted, inadequate.
        """
        doubtful = tuple(
            axis
            for axis in dict.fromkeys((*correlations, *r_squared, *tests))
            if (axis in tests and tests[axis].rejects(len(tests)))
            or not correlations.get(axis, np.inf) <= MAX_CORRELATION
        )
        if not doubtful:
            return cls(Form.ADEQUATE, (), tests, correlations)
        poor = tuple(axis for axis, value in r_squared.items() if value < MIN_PREDICTED)
        form = Form.INADEQUATE if poor else Form.EFFECTIVE
        return cls(form, poor or doubtful, tests, correlations)

    @property
    def missing(self) -> tuple[str, ...]:
        """Axes on which terms are missing, from the largest missing share."""
        rejected = [axis for axis, test in self.tests.items() if test.rejects(len(self.tests))]
        return tuple(sorted(rejected, key=lambda axis: -self.tests[axis].missing_share))

    @property
    def is_clearly_missing(self) -> bool:
        """Whether terms are missing with any estimate of the noise."""
        return any(self.tests[axis].missing_share > CLEARLY_MISSING for axis in self.missing)

    def __str__(self) -> str:
        """Return the form, and the share that is missing by axis, in one line."""
        if self.form is Form.ADEQUATE:
            return "Form: adequate (score tests find nothing missing)."
        head = f"Form: {self.form.word}"
        if self.form is Form.INADEQUATE:
            head += f" for {' '.join(VELOCITY_OF[axis] for axis in self.axes)}"
        if not self.missing:
            return f"{head}; the rest is neither noise nor pushes."
        shares = [f"{axis} {100.0 * self.tests[axis].missing_share:.0f}" for axis in self.missing]
        return f"{head}; missing terms, in % of the unexplained motion: {', '.join(shares)}."

    def describe(self, model: str) -> tuple[str, ...]:
        """Return the form of a model of this key, and what to do where it is not adequate."""
        if self.form is Form.ADEQUATE:
            return (str(self),)
        use = "Use the coefficients as a set, for motions like those of the log"
        if self.form is Form.INADEQUATE:
            names = " ".join(VELOCITY_OF[axis] for axis in self.axes)
            use = f"Pieces of the training data that are held out do not confirm it for {names}"
        elif self.missing and not self.is_clearly_missing:
            use = f"The missing part is small compared to noise and pushes. {use}"
        missing = {
            axis: label.partition("_")[2]
            for axis in self.missing[:MAX_NAMED_AXES]
            for label in self.tests[axis].terms[:1]
            if "actuation_" not in label
        }
        if not missing:
            return str(self), f"{use}; for others take another form."
        terms = [f'{axis}: "{term}"' for axis, term in missing.items()]
        if model not in catalog:
            return str(self), f"{use}; for others add {', '.join(terms)} to the model."
        entry = f"{{name: more, extends: {model}, terms: {{{', '.join(terms)}}}}}"
        return str(self), f"{use}; for others add terms in a model file: `{entry}`."
