"""On the vehicle: samples in, estimates out, sample by sample."""
