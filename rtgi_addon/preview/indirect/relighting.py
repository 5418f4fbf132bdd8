"""Fields that are relit by the CPU, on a thread beside the picture."""

import threading
from collections.abc import Callable

from ...errors import BakeError, Cancelled
from ...progress import Progress
from ...scene import Scene
from ...techniques.base import Field
from .base import FieldLight
from .tables import Tables


class RelitLight(FieldLight):
    """The irradiance function of ``field``, followed through ``field.relight`` on a worker.

    ``tables_of`` makes the tables of a field; it runs on the worker too. Scenes that arrive while one is worked on wait for it, all
    but the newest forgotten, so that light keeps pace with a lamp that is dragged.
    """

    def __init__(self, field: Field, tables_of: Callable[[Field], Tables]):
        super().__init__(tables_of(field), field.includes_direct)
        self._field, self._tables_of = field, tables_of
        self._lock = threading.Lock()
        self._waiting: Scene | None = None
        self._result: Tables | Exception | None = None
        self._worker: threading.Thread | None = None
        self._progress = Progress()

    @property
    def busy(self) -> bool:
        """See FieldLight."""
        with self._lock:
            return self._worker is not None or self._result is not None

    def follow(self, scene: Scene) -> bool:
        """See FieldLight."""
        if not hasattr(self._field, "relight"):
            self.error = f"{self._field.technique} cannot follow a change of light: bake again"
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
        self.set(result)
        return True

    def close(self) -> None:
        """See Indirect; waits until the worker has felt it."""
        with self._lock:
            self._waiting, worker = None, self._worker
        self._progress.cancel()
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
                result = self._tables_of(self._field.relight(scene, self._progress))
            except Cancelled:
                result = None
            except BakeError as error:
                result = error
            with self._lock:
                self._result = result
