"""Rays against the scene's triangles through Embree, in chunks over every core."""

import numpy as np

from ...machine.memory import address_bytes_left, available_bytes
from ..parallel import chunks, parallel_for
from ..surfaces.geometry import Geometry
from .ray_counter import record
from .tracer import INFINITE, Hits, Tracer

try:
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh
except ImportError:  # no wheel for this platform (Windows and Linux on Arm), or one that this system cannot load
    rtcore_scene = None

# Memory at the peak of building the BVH of a mesh or of loose triangles, 165 bytes each measured from 100,000 to 3 million.
BYTES_PER_TRIANGLE = 170
# And of the device, which reserves more address space than it uses.
BYTES, ADDRESS_BYTES = 8 << 20, 144 << 20


def is_available() -> bool:
    """Whether Embree can be used here."""
    return rtcore_scene is not None


def require_memory(triangles: int) -> None:
    """Raises MemoryError if there is too little for a BVH of so many ``triangles``: Embree itself would end the process."""
    needed, address_left = BYTES + BYTES_PER_TRIANGLE * triangles, address_bytes_left()
    for wanted, left in ((needed, available_bytes()), (needed + ADDRESS_BYTES, address_left)):
        if left is not None and wanted > left:
            raise MemoryError(f"the ray tracer needs {wanted / 2**20:,.0f} MiB, {left / 2**20:,.0f} are left")


class EmbreeTracer(Tracer):
    """Embree 4 in robust mode (watertight at shared edges), one ray at a time per thread.

    Calls of at most one chunk run on the calling thread, so that a worker's own chunks never nest pools.
    """

    def __init__(self, geometry: Geometry, threads: int | None = None):
        """Raises MemoryError if there is too little for the triangles: Embree itself would end the process."""
        require_memory(geometry.count)
        self._scene = rtcore_scene.EmbreeScene()
        # embreex copies vertex by vertex through Python objects; indexed or not costs the same, the flat form keeps one array.
        self._mesh = TriangleMesh(self._scene, geometry.triangles_world)
        self._threads = threads
        # The first query builds the BVH; doing it here keeps two threads from building it at once.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        parts = self._run(origins, directions, t_max, self._intersect_chunk)
        if len(parts) == 1:
            return parts[0]
        return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("primitive", "u", "v", "t")))

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        parts = self._run(origins, directions, t_max, self._occluded_chunk)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _run(self, origins, directions, t_max, function):
        record(len(origins))
        spans = chunks(len(origins)) or [slice(0, 0)]
        limits = None if t_max is None else np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),))
        return parallel_for(lambda i: function(origins[spans[i]], directions[spans[i]],
                                               None if limits is None else limits[spans[i]]), len(spans), self._threads)

    def _intersect_chunk(self, origins, directions, limits) -> Hits:
        # embreex overwrites the limits with the hit distances.
        dists = None if limits is None else np.array(limits, np.float32)
        out = self._scene.run(origins, directions, dists, query="INTERSECT", output=True)
        u, v, t = out["u"], out["v"], out["tfar"]
        # Of what missed, embreex leaves whatever stood in the memory, which need not be numbers.
        missed = out["primID"] < 0
        u[missed], v[missed], t[missed] = 0.0, 0.0, np.inf
        return Hits(out["primID"], u, v, t)

    def _occluded_chunk(self, origins, directions, limits) -> np.ndarray:
        dists = None if limits is None else np.array(np.minimum(limits, INFINITE), np.float32)
        return self._scene.run(origins, directions, dists, query="OCCLUDED") >= 0
