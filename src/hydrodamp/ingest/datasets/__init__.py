"""Public logs by name: a registry, and files that are fetched once and checked ever after."""
