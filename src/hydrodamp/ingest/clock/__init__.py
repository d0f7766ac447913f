"""Several topics, one clock."""
