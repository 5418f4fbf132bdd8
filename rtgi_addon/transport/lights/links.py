"""Light and shadow linking: which instances each lamp and each emissive instance lights, and which stand in its light's way.

Linked lights share few sets of instances, so sets are numbered, 0 being everything; Cycles does so too (`kernel/light/common.h`).
"""

import numpy as np

from ...scene import Scene
from ...scene.linking import Linking


class LightLinks:
    """Sets of receivers and of blockers of the lights of ``scene``.

    ``has_receivers`` and ``has_blockers`` say whether any light is restricted; ``blockers`` (s, i) bool are the sets of instances
    that cast shadows, the first of which has all; ``lit_alike`` (i,) numbers instances that the same lights light. Lights are
    numbered as lamps, emissive ones by their instance.
    """

    def __init__(self, scene: Scene):
        count = len(scene.instances)
        self._receivers, self.blockers = [np.ones(count, bool)], [np.ones(count, bool)]
        self._lamp_receivers, self._lamp_blockers = self._sets([light.linking for light in scene.lights])
        self._instance_receivers, self._instance_blockers = self._sets([instance.linking for instance in scene.instances])
        self._receivers, self.blockers = np.stack(self._receivers), np.stack(self.blockers)
        self.lit_alike = np.unique(self._receivers, axis=1, return_inverse=True)[1].reshape(-1)
        self.has_receivers, self.has_blockers = len(self._receivers) > 1, len(self.blockers) > 1

    def _sets(self, linkings: list[Linking | None]) -> tuple[np.ndarray, np.ndarray]:
        """The numbers of each linking's sets of receivers and of blockers; ones that are new are added."""
        linkings = [linking or Linking() for linking in linkings]
        return (_numbered([linking.receivers for linking in linkings], self._receivers),
                _numbered([linking.blockers for linking in linkings], self.blockers))

    def lamp_lights(self, lamp, instance: np.ndarray | None) -> np.ndarray:
        """Whether (n,) bool ``lamp`` (an index, or (n,)) lights what lies on ``instance`` (n,) (None: in free space, which all
        light reaches); beyond the last lamp stands the world, which lights everything."""
        return self._lit(self._lamp_receivers, lamp, instance)

    def emitter_lights(self, emitter: np.ndarray, instance: np.ndarray | None) -> np.ndarray:
        """As ``lamp_lights`` for emissive instances ``emitter`` (n,); −1 is none in particular, like ``instance`` −1."""
        return self._lit(self._instance_receivers, emitter, instance)

    def lamp_blockers(self, lamp):
        """The number of the set of blockers of ``lamp`` (an index, or (n,))."""
        return _at(self._lamp_blockers, lamp)

    def emitter_blockers(self, emitter: np.ndarray) -> np.ndarray:
        """The numbers (n,) of the sets of blockers of emissive instances ``emitter`` (n,)."""
        return _at(self._instance_blockers, emitter)

    def found_by_rays(self, emitter: np.ndarray, instance: np.ndarray) -> np.ndarray:
        """Whether (n,) bool rays from ``instance`` (n,) that meet an emissive ``emitter`` (n,) carry its light. Of one with
        blockers of its own they do not tell what is in the way: it is sampled alone."""
        return self.emitter_lights(emitter, instance) & (self.emitter_blockers(emitter) == 0)

    @property
    def restricts_emitters(self) -> bool:
        """Whether any emissive instance lights or is shadowed by some instances only."""
        return self.emitters_have_blockers or bool(self._instance_receivers.any())

    @property
    def emitters_have_blockers(self) -> bool:
        """Whether any emissive instance has blockers of its own."""
        return bool(self._instance_blockers.any())

    def _lit(self, sets, light, instance):
        if instance is None:
            return np.ones(np.shape(light), bool)
        return self._receivers[_at(sets, light), np.maximum(instance, 0)] | (np.asarray(instance) < 0)


def _at(sets: np.ndarray, index):
    inside = (np.asarray(index) >= 0) & (np.asarray(index) < len(sets))
    return np.where(inside, np.append(sets, 0)[np.where(inside, index, 0)], 0)


def _numbered(masks: list[np.ndarray | None], known: list[np.ndarray]) -> np.ndarray:
    numbers = np.zeros(len(masks), np.intp)
    places = {mask.tobytes(): number for number, mask in enumerate(known)}
    for index, mask in enumerate(masks):
        if mask is None:
            continue
        mask = np.asarray(mask, bool)
        numbers[index] = places.setdefault(mask.tobytes(), len(known))
        if numbers[index] == len(known):
            known.append(mask)
    return numbers
