"""The next dive: what to steer, and what it will determine."""
