"""What an unknown recording holds: guessed, with the evidence."""
