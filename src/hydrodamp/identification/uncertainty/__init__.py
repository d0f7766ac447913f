"""How far to trust numbers made from coloured records."""
