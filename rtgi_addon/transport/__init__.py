"""Rays and light (rank 2): numpy and Embree."""
