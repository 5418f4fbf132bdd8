"""What a surface cache takes: while its texels are traced and solved, and from then on. Measured as in scene/memory.py."""

# What is kept of a texel, of each of its rays, with what they see by the angle and through tints, and of each of the sources that
# it may choose; more while all rays are put together, or while the solver mixes what came of its last steps.
BYTES_PER_TEXEL, BYTES_PER_RAY, BYTES_PER_ANGLE, BYTES_PER_TINT, BYTES_PER_CHOICE = 174, 8, 2, 6, 6
BYTES_PER_RAY_IN_FLIGHT, BYTES_PER_TEXEL_SOLVED = 24, 580


def traced_bytes(cache, texels: int) -> int:
    """Bytes at the peak of tracing so many texels of a SurfaceCache at once, and of solving them."""
    more = max(BYTES_PER_RAY_IN_FLIGHT * _rays(cache), BYTES_PER_TEXEL_SOLVED) + BYTES_PER_CHOICE * cache.light.choices
    return kept_bytes(cache, texels) + texels * more


def kept_bytes(cache, texels: int) -> int:
    """Bytes that so many texels of a SurfaceCache hold once they are traced."""
    surfaces = cache.context.surfaces
    ray = BYTES_PER_RAY + BYTES_PER_ANGLE * surfaces.albedo_by_angle.present + BYTES_PER_TINT * surfaces.has_tint
    return texels * (BYTES_PER_TEXEL + ray * _rays(cache) + BYTES_PER_CHOICE * cache.light.choices)


def _rays(cache) -> int:
    """Rays of a texel, with those of walks in media."""
    return cache.rays * (2 if cache.context.media.scatters else 1)
