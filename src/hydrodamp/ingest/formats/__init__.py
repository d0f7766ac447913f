"""Readers, one module a format: from a file to a recording, numbers as they stand there."""
