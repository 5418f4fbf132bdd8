"""Fields that are relit by the CPU, on a thread beside the picture."""

import threading
from collections.abc import Callable

from ...errors import Cancelled
from ...progress import Progress
from ...scene import Scene
from ...techniques.base import Field
from .base import FieldLight
from .tables import Tables


class RelitLight(FieldLight):
    """The irradiance function of ``field``, followed through ``relight`` on a worker (None: the field's own).

    ``tables_of`` makes the tables of a field; it runs on the worker too. ``includes_direct`` (None: as the field says) is whether
    lamps are in them. Scenes that arrive while one is worked on wait for it, all but the newest forgotten, so that light keeps
    pace with a lamp that is dragged.
    """

    def __init__(self, field: Field, tables_of: Callable[[Field], Tables],
                 relight: Callable[[Scene, Progress], Field] | None = None, *, includes_direct: bool | None = None):
        super().__init__(tables_of(field), field.includes_direct if includes_direct is None else includes_direct)
        self._tables_of, self._relight = tables_of, relight or getattr(field, "relight", None)
        self._name = field.technique
        self._lock = threading.Lock()
        self._waiting: Scene | None = None
        self._result: tuple[Field, Tables] | Exception | None = None
        self._worker: threading.Thread | None = None
        self._progress = Progress()

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

    def forget(self) -> None:
        """Drop what waits and what has come out; what is being worked on will be shown still."""
        with self._lock:
            self._waiting = self._result = None

    def close(self) -> None:
        """See FieldLight; waits until the worker has felt it."""
        self.forget()
        self._progress.cancel()
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
            try:
                # From the bake's own field each time: only it has been measured, whatever the lamps did since.
                field = self._relight(scene, self._progress)
                result = field, self._tables_of(field)
            except Cancelled:
                result = None
            except Exception as error:  # it belongs to who asks with `update`
                result = error
            with self._lock:
                self._result = result
