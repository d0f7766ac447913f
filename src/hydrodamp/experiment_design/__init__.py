"""The next dive: what to control, and what it will determine."""
