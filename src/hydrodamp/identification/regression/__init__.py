"""Linear estimators on rows."""
