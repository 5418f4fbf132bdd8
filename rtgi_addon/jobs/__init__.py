"""What the three doors share (rank 5): a bake from a Scene to a finished bundle."""
