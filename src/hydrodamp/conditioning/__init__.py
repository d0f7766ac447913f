"""Log to log: what is wrong is masked, what is missing is derived, and every step is counted."""
