"""Live probes in the preview: a worker traces frame after frame while anything changes, and the picture shows the newest that is
there. Nothing waits for it."""

from dataclasses import replace

import gpu

from ...errors import Cancelled
from ...scene import Scene, World
from ...techniques.base import Field
from ...techniques.probes.live import LiveProbes, LiveSettings
from ...transport.parallel import thread_count
from ..indirect_pass import WorldLight
from .following import FollowingLight
from .probes import probe_tables
from .tables import Tables


class LiveProbesLight(FollowingLight):
    """Probes of ``scene`` that are kept up to date as ``settings`` say: dark before their first frame. ``field`` is what is shown
    (None: nothing yet), ``notes`` what of the scene it does not follow."""

    follows_surfaces = True
    thread_name = "rtgi live probes"

    def __init__(self, settings: LiveSettings, scene: Scene):
        # Without the base's: there are no tables yet.
        dark = WorldLight(replace(scene, world=World.constant(0.0)))
        self.program, self.uniforms, self.direct_lamps, self.error = dark.program, dark.uniforms, frozenset(), None
        self.samplers: dict[str, gpu.types.GPUTexture] = {}
        self.field: Field | None = None
        self.notes: tuple[str, ...] = ()
        self._settings = settings
        self._live: LiveProbes | None = None
        self._begin()
        self.follow(scene)

    def take(self, field: Field, tables: Tables, notes: tuple[str, ...]) -> None:
        """See FollowingLight."""
        self.field, self.notes = field, notes
        self.set(tables)
        self.direct_lamps = field.direct_lamps

    def _work(self) -> None:
        """Frames until the light has settled and nothing waits, or something fails."""
        # A core is left to whoever drags the lamp.
        threads = max(1, thread_count() - 1)
        shown = True
        while True:
            with self._lock:
                scene, self._waiting = self._waiting, None
                if scene is None and shown and (self._live is None or self._live.settled):
                    self._worker = None
                    return
            try:
                result, shown = self._step(scene, threads)
            except Cancelled:
                result, shown, self._live = None, True, None
            except Exception as error:  # it belongs to who asks with `update`; its frames refer to it, and to this light
                result, shown, self._live = error.with_traceback(None), True, None
            with self._lock:
                self._result = self._result if result is None else result

    def _step(self, scene: Scene | None, threads: int):
        """A frame in ``scene`` (None: the one before), and its light, unless what was made before it has not been taken yet; and
        whether all of the light is shown."""
        if self._live is None:
            self._live = LiveProbes(scene, self._settings, threads=threads, progress=self._progress)
        elif scene is not None:
            self._live.follow(scene, self._progress)
        traced = self._live.frame(self._progress).rays
        with self._lock:
            waits = self._result is not None
        if waits and not self._live.settled:
            return None, False
        field = self._live.field
        return ((field, probe_tables(field), self._live.notes), True) if traced or self.field is None or waits else (None, True)
