"""Light that a worker makes beside the picture, of the newest scene there is."""

import threading

from ...progress import Progress
from ...scene import Scene
from .base import FieldLight


class FollowingLight(FieldLight):
    """Light whose ``_work`` runs on a thread of its own for as long as it has something to do. Scenes that arrive meanwhile wait in
    ``_waiting``, all but the newest forgotten; what it makes waits in ``_result`` for ``update``, which hands it to ``take``. Both
    and ``_worker`` are read and written with ``_lock`` held."""

    thread_name = "rtgi relight"

    def _begin(self) -> None:
        """Have everything ready for ``follow``."""
        self._lock = threading.Lock()
        self._waiting: Scene | None = None
        self._result: tuple | Exception | None = None
        self._worker: threading.Thread | None = None
        self._progress = Progress()

    @property
    def busy(self) -> bool:
        """See FieldLight."""
        with self._lock:
            return self._worker is not None or self._result is not None

    def follow(self, scene: Scene) -> bool:
        """See FieldLight: all of it on the worker."""
        with self._lock:
            self._waiting = scene
            self._interrupt()
            if self._worker is None:
                self._worker = threading.Thread(target=self._work, name=self.thread_name, daemon=True)
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

    def take(self, *result) -> None:
        """Show what the worker has made."""
        raise NotImplementedError

    def forget(self) -> None:
        """Drop what waits and what has come out; what is being worked on will be shown still."""
        with self._lock:
            self._waiting = self._result = None

    def close(self) -> None:
        """See FieldLight; waits until the worker has felt it."""
        self._progress.cancel()
        with self._lock:
            self._waiting = self._result = None
            self._interrupt()
            worker = self._worker
        if worker is not None:
            worker.join()
        super().close()

    def _interrupt(self) -> None:
        """Break off what need not be done first where a scene waits; with the lock held."""

    def _work(self) -> None:
        """Work until nothing waits, and then set ``_worker`` to None; on the worker."""
        raise NotImplementedError
