"""Linear models at steady speeds, and autopilots for them."""
