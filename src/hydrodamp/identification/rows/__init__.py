"""The rows of a regression: equation 3 at samples, between them, and under test functions.

``derivative``, ``held`` and ``triangle`` are what section III of the paper needs; ``rank``
solves an axis of it. ``equations`` are rows however made, ``weak_equations`` those of the
weak form, on ``weak_functions``, ``steps``, ``support`` and ``local_quadratics``. ``folds``
leave some rows out; ``reference`` adds terms; ``velocity_noise`` says what the sensors add.
"""
