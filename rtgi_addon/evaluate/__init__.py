"""References, metrics and pictures (rank 4)."""
