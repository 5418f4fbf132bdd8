"""The sparse form factors: which texels each texel's rays hit, all with equal weight."""

import numpy as np

from ... import kernels


class FormFactors:
    """Blocks of consecutive texels, in order: ``hits``, each (R, nᵢ) int32 of texels hit (−1: none), and ``density``, each (R, nᵢ)
    float32 [m⁻²]: that of the ray on the surface that it met. ``angles``, where some surface reflects by the angle, each (R, nᵢ)
    uint16: the row of ``Surfaces.albedo_by_angle`` under which the ray sees what it hit. ``tints``, where surfaces colour what
    passes them, each (R, nᵢ, 3) float16: what is left of the light that comes along the ray, whether it hit or not.

    Where media scatter, each ray has a second row in its column, R further on: where its walk ended that began at a point along it
    (transport/paths/scattering.py). It weighs as much as a ray, but for its tint.
    """

    def __init__(self, rays: int):
        self.rays = rays
        self.hits: list[np.ndarray] = []
        self.density: list[np.ndarray] = []
        self.angles: list[np.ndarray] = []
        self.tints: list[np.ndarray] = []

    def append(self, found: np.ndarray, texels: np.ndarray, density: np.ndarray, angles: np.ndarray | None,
               tints: np.ndarray | None) -> None:
        """Add a block whose rays ``found`` (h,), of R·n, hit ``texels`` (h,), under ``angles`` (h,) if they count; ``density``
        (R, n) and ``tints`` (R·n, 3), if any."""
        if tints is not None:
            self.tints.append(tints.reshape(*density.shape, 3).astype(np.float16))
        block = np.full(density.size, -1, np.int32)
        block[found] = texels
        self.hits.append(block.reshape(density.shape))
        self.density.append(density)
        if angles is not None:
            block = np.zeros(density.size, np.uint16)
            block[found] = angles
            self.angles.append(block.reshape(density.shape))

    def seen(self, block: int, radiance: np.ndarray, by_angle: np.ndarray) -> np.ndarray:
        """``radiance`` (n + 1, c) of texels as the rays of a ``block`` bring it (R, nᵢ, c), whose first three columns are colours;
        ``by_angle`` (m, 3) are the factors that ``angles`` index."""
        incoming = np.take(radiance, self.hits[block], axis=0, mode="wrap")
        if self.angles:
            incoming[..., :3] *= by_angle[self.angles[block]]
        if self.tints:
            incoming[..., :3] *= self.tints[block]
        return incoming

    @property
    def is_plain(self) -> bool:
        """Whether what rays see is the same from everywhere, and nothing colours it on its way."""
        return not self.angles and not self.tints

    def spread(self, block: int, radiance: np.ndarray, first: np.ndarray) -> np.ndarray:
        """``first`` (nᵢ, 3) and, by the compiled kernel, π times the mean over the rays of a ``block`` of ``radiance`` (n + 1, 4)
        of texels: (nᵢ, 3). For ``is_plain`` alone."""
        hits, result = self.hits[block], np.empty(first.shape, np.float32)
        if first.shape != (hits.shape[1], 3) or radiance.shape[1:] != (4,):
            raise ValueError(f"{first.shape} and {radiance.shape} for {hits.shape} hits")
        kernels.call("spread", len(radiance), radiance, *hits.shape, np.ascontiguousarray(hits), np.pi / self.rays,
                     np.ascontiguousarray(first), result)
        return result

    def difference(self, block: int, radiance: np.ndarray, by_angle: np.ndarray) -> np.ndarray:
        """By how much the mean (nᵢ, 3), as in ``spread``, of ``radiance`` (n + 1, 4) is more over the first half of the rays of a
        ``block`` than over the second. ``by_angle`` as in ``seen``."""
        half, total = self.rays // 2, np.zeros((2, self.hits[block].shape[1], 3), np.float32)
        if self.is_plain and kernels.is_available():
            for start in range(0, len(self.hits[block]), half):
                part, own = np.ascontiguousarray(self.hits[block][start:start + half]), total[start // half % 2]
                kernels.call("spread", len(radiance), radiance, *part.shape, part, np.pi / half, own.copy(), own)
        else:
            seen = self.seen(block, radiance, by_angle)[..., :3]
            total = seen.reshape(-1, 2, half, *seen.shape[1:]).sum(axis=(0, 2)) * np.float32(np.pi / half)
        return total[0] - total[1]

    def spans(self) -> list[slice]:
        """The texels of each block."""
        ends = np.cumsum([block.shape[1] for block in self.hits], dtype=np.int64).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything in them, for a checkpoint."""
        empty = np.zeros((len(self.hits[0]) if self.hits else self.rays, 0), np.int32)
        return {"rays": np.array([self.rays], np.int64), "widths": np.array([block.shape[1] for block in self.hits], np.int64),
                "form_factors": np.concatenate([empty, *self.hits], axis=1),
                "ray_density": np.concatenate([empty.astype(np.float32), *self.density], axis=1),
                "angles": np.concatenate([empty.astype(np.uint16), *self.angles], axis=1),
                "tints": np.concatenate([np.zeros((*empty.shape, 3), np.float16), *self.tints], axis=1)}

    @staticmethod
    def of(arrays: dict[str, np.ndarray]) -> "FormFactors":
        """Those that gave ``arrays``."""
        result = FormFactors(int(arrays["rays"][0]))
        ends = np.cumsum(arrays["widths"])[:-1]
        if len(arrays["widths"]):
            result.hits = np.split(arrays["form_factors"], ends, axis=1)
            result.density = np.split(arrays["ray_density"], ends, axis=1)
            result.angles = np.split(arrays["angles"], ends, axis=1) if arrays["angles"].size else []
            result.tints = np.split(arrays["tints"], ends, axis=1) if arrays["tints"].size else []
        return result
