"""Output error: coefficients whose replay is nearest to the log."""
