"""Simulation of the paper's measurement campaign with a VT 690 (section V-B)."""
