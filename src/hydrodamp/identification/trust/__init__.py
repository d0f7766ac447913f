"""What the data determine, and what speaks against a fit."""
