"""Which terms to take from many."""
