"""Fields that are relit by the CPU, on a thread beside the picture."""

import threading
from collections.abc import Callable

from ...errors import Cancelled
from ...progress import Progress
from ...scene import Scene
from ...techniques.base import Field
from .base import FieldLight
from .tables import DARK, Tables


class RelitLight(FieldLight):
    """The irradiance function of ``field`` (None: dark until the first is there), followed through ``relight`` on a worker (None:
    the field's own).

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
        self._lock = threading.Lock()
        self._waiting: Scene | None = None
        self._result: tuple[Field, Tables] | Exception | None = None
        self._worker: threading.Thread | None = None
        self._progress = Progress()
        self._refine, self._refining = refine, Progress()

    @property
    def busy(self) -> bool:
        """See FieldLight."""
        with self._lock:
            return self._worker is not None or self._result is not None

    def follow(self, scene: Scene) -> bool:
        """See FieldLight."""
        if self._relight is None:
            self.error = f"{self._name} cannot follow a change of light: bake again"
            return False
        with self._lock:
            self._waiting = scene
            self._refining.cancel()
            if self._worker is None:
                self._worker = threading.Thread(target=self._work, name="rtgi relight", daemon=True)
                self._worker.start()
        return self.error is None

    def update(self) -> bool:
        """See FieldLight."""
        with self._lock:
            result, self._result = self._result, None
        if result is None:
            return False
        if isinstance(result, Exception):
            self.error = str(result)
            return False
        self.error = None
        self.take(*result)
        return True

    def take(self, field: Field, tables: Tables) -> None:
        """Show the relit ``field``."""
        self.set(tables)
        self.atlas = field.atlas
        self.direct_lamps = field.direct_lamps if self._holds_direct else frozenset()

    def forget(self) -> None:
        """Drop what waits and what has come out; what is being worked on will be shown still."""
        with self._lock:
            self._waiting = self._result = None

    def close(self) -> None:
        """See FieldLight; waits until the worker has felt it."""
        self.forget()
        self._progress.cancel()
        with self._lock:
            self._refining.cancel()
        worker = self._worker
        if worker is not None:
            worker.join()

    def _work(self) -> None:
        while True:
            with self._lock:
                scene, self._waiting = self._waiting, None
                if scene is None:
                    self._worker = None
                    return
            # From the bake's own field each time: only it has been measured, whatever the lamps did since.
            self._deliver(self._relight, scene, self._progress)
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
        except Exception as error:  # it belongs to who asks with `update`
            result = error
        with self._lock:
            self._result = result
