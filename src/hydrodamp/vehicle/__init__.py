"""The vehicle: everything that is known before a log is read."""
