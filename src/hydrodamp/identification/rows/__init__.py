"""The rows of a regression: equation 3 at samples, between them, and under test functions."""
