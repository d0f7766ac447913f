"""Everything that ranks several fits on data they have not seen."""
