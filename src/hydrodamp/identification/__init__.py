"""From a problem to a fit: every method of estimating the coefficients."""
