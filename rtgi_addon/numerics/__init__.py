"""Mathematics on arrays (rank 0)."""
