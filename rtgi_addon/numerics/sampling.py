"""Low-discrepancy points, and maps from the unit square to disks, hemispheres and spheres.

Everything here is integer arithmetic up to the last step, so the same seed gives the same points on every platform.

Sources: B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; S. Joe and F. Y. Kuo, "Constructing Sobol
sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30, 2008 (the set D6); N. Vegdahl, "Building a Better
LK Hash", 2021; M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018; P. Shirley and K. Chiu, "A Low
Distortion Map Between Disk and Square", JGT 2(3), 1997; T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT
6(1), 2017; K. Shoemake, "Uniform Random Rotations", Graphics Gems III, 1992.
"""

import operator
from functools import cache

import numpy as np

from .. import kernels

# Joe and Kuo's set D6: (degree s, inner coefficients a of the primitive polynomial, initial m_1 … m_s) from dimension 2 on.
_JOE_KUO_D6 = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
)
SOBOL_DIMENSIONS = len(_JOE_KUO_D6) + 1

# Powers −1 and −2 of the plastic number (the real root of x³ = x + 1) as 64-bit fractions: Roberts' R2.
_R2_STEP = (np.uint64(0xC13FA9A902A6328F), np.uint64(0x91E10DA5C79E7B1D))
GOLDEN_FRACTION = (np.sqrt(5.0) - 1.0) / 2.0


def hash_u32(*values) -> np.ndarray:
    """A well-mixed uint32 from any number of integers or integer arrays, which broadcast (only the low 32 bits count).

    Each value goes through C. Wellons' "lowbias32" permutation; the order of the arguments matters.
    """
    state = np.uint32(0x9E3779B9)
    for value in values:
        array = np.asarray(value)
        low = array.astype(np.uint32) if array.dtype.kind in "iub" else np.uint32(operator.index(value) & 0xFFFFFFFF)
        state = _lowbias32(np.add(_multiply(state, 0x01000193), low, dtype=np.uint32))
    return state


def sobol_owen(n: int, dims: int, seed, start: int = 0, shuffle: bool = False) -> np.ndarray:
    """Points ``start`` … ``start + n − 1`` of an Owen-scrambled Sobol sequence: (n, dims) float32 in [0, 1).

    Every dimension is scrambled on its own (Burley 2020 §3, with Vegdahl's hash). The first two dimensions are a
    (0, 2)-sequence: each aligned block of 2^k points has exactly one point in each elementary interval of area 2^−k.
    ``shuffle`` also permutes the order within every such block, which decorrelates two sequences that are used side by side
    (padding, §4). ``seed`` is any integer. Raises ValueError for more dimensions than ``SOBOL_DIMENSIONS``.
    """
    index = np.arange(start, start + n, dtype=np.uint32)
    return sobol_owen_at(index, dims, np.uint32(int(seed) & 0xFFFFFFFF), shuffle)


def sobol_owen_at(index: np.ndarray, dims: int, seed, shuffle: bool = False, first: int = 0) -> np.ndarray:
    """As ``sobol_owen`` for any integer ``index`` and ``seed`` arrays, which broadcast: dimensions ``first`` … ``dims`` − 1 as
    (…, dims − first) float32 in [0, 1)."""
    if not 1 <= dims <= SOBOL_DIMENSIONS:
        raise ValueError(f"{dims} dimensions asked for; 1 to {SOBOL_DIMENSIONS} are there")
    index, seed = np.asarray(index).astype(np.uint32), np.asarray(seed).astype(np.uint32)
    if shuffle:
        index = _reverse_bits(_owen_of_reversed(_reverse_bits(index), hash_u32(seed, dims)))
    if kernels.is_available():
        shape = np.broadcast_shapes(index.shape, seed.shape)
        index, seed = (np.ascontiguousarray(np.broadcast_to(part, shape)).reshape(-1) for part in (index, seed))
        points = np.empty((*shape, dims - first), np.float32)
        kernels.call("sobol_owen", sobol_tables(), SOBOL_DIMENSIONS, index.size, index, seed, first, dims, points)
        return points
    octets = [(index >> np.uint32(shift)) & np.uint32(255) for shift in (0, 8, 16, 24)]
    points = np.empty((*np.broadcast_shapes(index.shape, seed.shape), dims - first), np.float32)
    tables = sobol_tables()
    for d in range(first, dims):
        reversed_bits = tables[d, 0][octets[0]]
        for table, octet in zip(tables[d, 1:], octets[1:], strict=True):
            reversed_bits = reversed_bits ^ table[octet]
        points[..., d - first] = unit_interval(_reverse_bits(_owen_of_reversed(reversed_bits, hash_u32(seed, d + 1))))
    return points


def r2(n: int, seed, start: int = 0) -> np.ndarray:
    """Points ``start`` … of Roberts' R2 sequence, shifted on the torus by a hash of ``seed``: (n, 2) float32 in [0, 1)."""
    index = np.arange(start, start + n, dtype=np.uint64)
    points = np.empty((n, 2), np.float32)
    for d, step in enumerate(_R2_STEP):
        shift = np.uint64(int(hash_u32(seed, d)) << 32)
        points[:, d] = unit_interval(((index * step + shift) >> np.uint64(32)).astype(np.uint32))
    return points


def fibonacci_sphere(n: int) -> np.ndarray:
    """n near-uniform directions (n, 3) float32 on the spherical Fibonacci lattice, offset ½ (one ring per point, none at a
    pole); each stands for the solid angle 4π/n."""
    index = np.arange(n, dtype=np.float64)
    azimuth = 2.0 * np.pi * np.mod(index * GOLDEN_FRACTION, 1.0)
    z = 1.0 - (2.0 * index + 1.0) / n
    ring = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=-1).astype(np.float32)


def sphere_from_square(u: np.ndarray) -> np.ndarray:
    """Equal-area map from [0, 1)² (n, 2) to unit directions (n, 3): z = 1 − 2u₀, azimuth 2πu₁ (Archimedes); pdf 1/4π."""
    u = np.asarray(u)
    z = 1.0 - 2.0 * u[..., 0]
    # 4u(1−u) is 1 − z² without the cancellation at the poles.
    ring = 2.0 * np.sqrt(np.maximum(0.0, u[..., 0] * (1.0 - u[..., 0])))
    azimuth = (2.0 * np.pi) * u[..., 1]
    return np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=-1).astype(u.dtype, copy=False)


def disk_from_square(u: np.ndarray) -> np.ndarray:
    """Shirley and Chiu's concentric, equal-area map from [0, 1)² (n, 2) to the unit disk (n, 2)."""
    u = np.asarray(u)
    a, b = 2.0 * u[..., 0] - 1.0, 2.0 * u[..., 1] - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0.0, 1.0, radius)
    angle = (np.pi / 4.0) * ratio
    cosine, sine = np.cos(angle), np.sin(angle)
    disk = np.stack([np.where(wide, cosine, sine), np.where(wide, sine, cosine)], axis=-1) * radius[..., None]
    return disk.astype(u.dtype, copy=False)


def cosine_hemisphere(u: np.ndarray) -> np.ndarray:
    """Directions (n, 3) about +z from [0, 1)² (n, 2) with density cosθ/π (Malley: the disk, lifted to the hemisphere)."""
    disk = disk_from_square(u)
    z = np.sqrt(np.maximum(0.0, 1.0 - np.sum(disk * disk, axis=-1)))
    return np.concatenate([disk, z[..., None]], axis=-1)


def frame(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tangent and bitangent (n, 3) each that make a right-handed orthonormal basis with unit ``normals`` (n, 3) (Duff 2017)."""
    normals = np.asarray(normals)
    x, y, z = normals[..., 0], normals[..., 1], normals[..., 2]
    sign = np.copysign(np.ones((), normals.dtype), z)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=-1)
    return tangent.astype(normals.dtype, copy=False), bitangent.astype(normals.dtype, copy=False)


def about(normals: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Directions ``local`` (n, 3) about +z turned to lie about unit ``normals`` (n, 3); not normalized again."""
    tangent, bitangent = frame(normals)
    return tangent * local[:, :1] + bitangent * local[:, 1:2] + normals * local[:, 2:]


def random_rotations(n: int, rng: np.random.Generator) -> np.ndarray:
    """n rotation matrices (n, 3, 3) float64, uniform over SO(3) (Shoemake 1992: a uniform unit quaternion)."""
    u = rng.random((n, 3))
    radius = np.sqrt(np.stack([1.0 - u[:, 0], u[:, 0]]))
    theta = 2.0 * np.pi * u[:, 1:]
    x, y = radius[0] * np.sin(theta[:, 0]), radius[0] * np.cos(theta[:, 0])
    z, w = radius[1] * np.sin(theta[:, 1]), radius[1] * np.cos(theta[:, 1])
    return np.stack([
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ], axis=-1).reshape(n, 3, 3)


def _multiply(a, b) -> np.ndarray:
    # The ufunc, not the operator: on numpy scalars `*` and `+` warn when uint32 arithmetic wraps around, as it is meant to here.
    return np.multiply(a, np.uint32(b), dtype=np.uint32)


def _lowbias32(x: np.ndarray) -> np.ndarray:
    x = x ^ (x >> np.uint32(16))
    x = _multiply(x, 0x7FEB352D)
    x = x ^ (x >> np.uint32(15))
    x = _multiply(x, 0x846CA68B)
    return x ^ (x >> np.uint32(16))


def _reverse_bits(x: np.ndarray) -> np.ndarray:
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        shift, mask = np.uint32(shift), np.uint32(mask)
        x = ((x >> shift) & mask) | ((x & mask) << shift)
    return (x >> np.uint32(16)) | (x << np.uint32(16))


def _owen_of_reversed(x: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Vegdahl's Laine-Karras style hash: each bit is flipped by a function of the lower bits only, which is an Owen scramble
    once the bits are read in reverse."""
    x = x ^ _multiply(x, 0x3D20ADEA)
    x = np.add(x, seed, dtype=np.uint32)
    x = np.multiply(x, (seed >> np.uint32(16)) | np.uint32(1), dtype=np.uint32)
    x = x ^ _multiply(x, 0x05526C56)
    x = x ^ _multiply(x, 0x53A22864)
    return x


def wrapped(numbers: np.ndarray) -> np.ndarray:
    """``numbers`` on the torus [0, 1): after a shift (Cranley and Patterson 1976) the part behind the point."""
    return numbers - np.floor(numbers)


def unit_interval(x: np.ndarray) -> np.ndarray:
    """float32 in [0, 1) from the top 24 bits: the largest value stays below 1 and no elementary interval is left by rounding."""
    return (x >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


@cache
def sobol_tables() -> np.ndarray:
    """(dimension, octet, 256) uint32: the bit-reversed Sobol point of every value of each octet of the index; the point of a
    whole index is the XOR over its octets."""
    directions = np.zeros((SOBOL_DIMENSIONS, 32), np.uint32)
    directions[0] = [1 << (31 - bit) for bit in range(32)]
    for d, (degree, inner, initial) in enumerate(_JOE_KUO_D6, start=1):
        m = list(initial)
        for i in range(degree, 32):
            value = m[i - degree] ^ (m[i - degree] << degree)
            for k in range(1, degree):
                if (inner >> (degree - 1 - k)) & 1:
                    value ^= m[i - k] << k
            m.append(value)
        directions[d] = [m[bit] << (31 - bit) for bit in range(32)]
    octet = np.arange(256, dtype=np.uint32)
    tables = np.zeros((SOBOL_DIMENSIONS, 4, 256), np.uint32)
    for bit in range(8):
        chosen = ((octet >> np.uint32(bit)) & np.uint32(1)).astype(bool)
        tables ^= np.where(chosen, directions.reshape(SOBOL_DIMENSIONS, 4, 8)[:, :, bit, None], np.uint32(0))
    return np.ascontiguousarray(_reverse_bits(tables))
