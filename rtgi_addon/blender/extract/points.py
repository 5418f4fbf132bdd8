"""Places for probes that scatter: Empties, by the collections that hold them."""

import numpy as np


class PointCollector:
    """Gathers the Empties of a scene; ``collections`` are the names of those that hold each original object, by its address."""

    def __init__(self, collections: dict[int, tuple[str, ...]]):
        self._collections = collections
        self._found: dict[str, list] = {}

    def add(self, item) -> None:
        """An Empty of the dependency graph, or an instance of one, which belongs to the collections that it was made in."""
        for name in self._collections.get(item.object.original.as_pointer(), ()):
            self._found.setdefault(name, []).append(np.array(item.matrix_world, np.float64)[:3, 3])

    def points(self) -> dict[str, np.ndarray]:
        """Places (n, 3) float64 in the world by the name of a collection."""
        return {name: np.array(places) for name, places in sorted(self._found.items())}
