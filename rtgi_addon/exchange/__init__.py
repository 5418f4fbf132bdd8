"""Files (rank 4): the bake bundle, one file per engine."""
