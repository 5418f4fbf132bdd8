"""The rays of probes as the light at what they hit is asked for them."""

from dataclasses import dataclass

import numpy as np

from ...transport.cache.hit_light import Arrivals, HitRays
from .gather_kernels import ray_points

# One emitter (and one bright world) sample for so many rays.
RAYS_PER_LIGHT_SAMPLE = 8
# Rays of a probe in one block: a multiple of what light samples come with, and those of the first round.
BLOCK_RAYS = 64
# Rays of one work item.
ITEM_RAYS = 1 << 16
# Dimensions of a group's sequence that are a ray's direction; what a hit samples of lamps follows.
DIRECTION = 2


@dataclass(frozen=True, eq=False)
class ItemRays(HitRays):
    """The rays of an Item that a Gatherer has Traced, as HitLight asks about them; see HitRays."""

    gatherer: object
    item: object
    traced: object

    def take(self, rows: np.ndarray) -> "ItemRays":
        return ItemRays(self.gatherer, self.item, self.traced.take(rows))

    def points(self, rows: np.ndarray) -> np.ndarray:
        points = self._directions(rows) * self.reach(rows)[:, None]
        points += self.gatherer.positions(self.item, self.traced.rows[rows])
        return points

    def lit_sides(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        return ray_points(self.item.shape, self.gatherer.context.geometry.normals_world, self.gatherer.positions_of(self.item),
                          self.traced, rows)

    def reach(self, rows: np.ndarray) -> np.ndarray:
        return self.traced.t[rows]

    def cosine(self, rows: np.ndarray) -> np.ndarray:
        return self.traced.cosine[rows]

    def arrivals(self) -> Arrivals:
        return Arrivals(self.traced.cosine, self.traced.t, float(self.gatherer.pdf), RAYS_PER_LIGHT_SAMPLE)

    def numbers(self, rows: np.ndarray, count: int) -> np.ndarray:
        return self.gatherer.shifted(self.item, self.traced.rows[rows], DIRECTION, DIRECTION + count)

    def share(self, rows: np.ndarray, pdf_area: np.ndarray) -> np.ndarray:
        by_ray = self.gatherer.pdf * np.abs(self.cosine(rows)) / np.maximum(self.reach(rows) ** 2, np.float32(1e-20))
        return (by_ray / np.maximum(by_ray + pdf_area / RAYS_PER_LIGHT_SAMPLE, 1e-30))[:, None]

    def _directions(self, rows: np.ndarray) -> np.ndarray:
        return np.take(self.traced.directions, self.traced.rows[rows] // self.item.shape[2], axis=0)
