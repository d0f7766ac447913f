"""Everything that ranks several fits on data they have not seen.

Read ``comparison`` (rows, the best of them), ``compare`` (replay and score
every fit) and ``paper`` (the printed Table I and the rank correlation).
"""
