"""The algebra of terms: what a regressor column is, spelled as it is printed.

Lowest layer above the kernels. Read ``axes`` (the six axes and velocities),
then ``atoms`` (the symbols and their place in the kernels' table), ``term``
(a product of at most four atoms), ``command_names`` (what a command may be
called), ``speed`` (what a propulsion ratio divides by) and ``basis`` (an
ordered set of terms, evaluated at velocities).
"""
