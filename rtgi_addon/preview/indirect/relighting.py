"""Fields that are relit by the CPU, on a thread beside the picture."""

from collections.abc import Callable

from ...errors import Cancelled
from ...progress import Progress
from ...scene import Scene
from ...techniques.base import Field
from .following import FollowingLight
from .tables import DARK, Tables


class RelitLight(FollowingLight):
    """The irradiance function of ``field`` (None: dark until the first is there), followed through ``relight`` on a worker (None:
    the field's own). What needs more than the field is a ``relit`` of its own: no light may refer to itself (see ``close``).

    ``tables_of`` makes the tables of a field; it runs on the worker too. ``holds_direct`` says whether they have the lamps' direct
    light that is in the field. Scenes that arrive while one is worked on wait for it, all but the newest forgotten, so that light
    keeps pace with a lamp that is dragged. ``refine`` makes the best that the field can be, slowly, or None: it follows where no
    other scene waits, and is broken off when one arrives. ``atlas`` is the light atlas of the field that is shown, None where it
    has none.
    """

    def __init__(self, field: Field | None, tables_of: Callable[[Field], Tables],
                 relight: Callable[[Scene, Progress], Field] | None = None, *, holds_direct: bool = True,
                 refine: Callable[[Scene, Progress], Field | None] | None = None):
        super().__init__(DARK if field is None else tables_of(field),
                         field.direct_lamps if holds_direct and field is not None else frozenset())
        self._holds_direct, self.atlas = holds_direct, getattr(field, "atlas", None)
        self._tables_of, self._relight = tables_of, relight or getattr(field, "relight", None)
        self._name = getattr(field, "technique", None)
        self._refine, self._refining = refine, Progress()
        self._begin()

    @property
    def can_follow(self) -> bool:
        """Whether there is a way to the light of another scene."""
        return self._relight is not None

    def relit(self, scene: Scene, progress: Progress) -> Field:
        """The field in the light of ``scene``; on the worker."""
        return self._relight(scene, progress)

    def follow(self, scene: Scene) -> bool:
        """See FieldLight."""
        if not self.can_follow:
            self.error = f"{self._name} cannot follow a change of light: bake again"
            return False
        return super().follow(scene)

    def take(self, field: Field, tables: Tables) -> None:
        """Show the relit ``field``."""
        self.set(tables)
        self.atlas = field.atlas
        self.direct_lamps = field.direct_lamps if self._holds_direct else frozenset()

    def _interrupt(self) -> None:
        self._refining.cancel()

    def _work(self) -> None:
        while True:
            with self._lock:
                scene, self._waiting = self._waiting, None
                if scene is None:
                    self._worker = None
                    return
            # From the bake's own field each time: only it has been measured, whatever the lamps did since.
            self._deliver(self.relit, scene, self._progress)
            if self._refine is None:
                continue
            with self._lock:
                self._refining = Progress()
                if self._waiting is not None or self._progress.cancelled:
                    continue
            self._deliver(self._refine, scene, self._refining)

    def _deliver(self, relight: Callable[[Scene, Progress], Field | None], scene: Scene, progress: Progress) -> None:
        """Have what ``relight`` makes of ``scene`` ready for ``update``."""
        try:
            field = relight(scene, progress)
            if field is None:
                return
            result = field, self._tables_of(field)
        except Cancelled:
            return
        except Exception as error:  # it belongs to who asks with `update`; its frames refer to it, and to this light
            result = error.with_traceback(None)
        with self._lock:
            self._result = result
