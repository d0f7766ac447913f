"""The algebra of terms: what a regressor column is, spelled as it is printed."""
