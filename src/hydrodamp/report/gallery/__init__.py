"""The pictures of a run, each with what to see in it, and what the log determines."""
