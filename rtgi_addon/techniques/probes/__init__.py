"""SH irradiance probes on lattices (radiance field caching): bake, lookup, reconstruction."""
