"""Everything that touches bpy (rank 6)."""
