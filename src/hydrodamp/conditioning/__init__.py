"""Conditioning of logs: mask dropouts and outliers, derive missing channels, check quality."""
