"""Wishes of the system and the user that the process should end: Ctrl-C, SIGTERM, a terminal that goes away. One wish is heeded in
order, as a cancelled bake; a second one at once.
"""

import signal
import threading
from collections.abc import Callable

# SIGBREAK is Ctrl-Break on Windows, which has no SIGHUP.
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class Interrupts:
    """From construction to ``restore``, the first of these signals calls ``on_stop``'s function, and the next ones raise
    KeyboardInterrupt in the main thread. A signal that is ignored stays ignored (`nohup`, a shell's background)."""

    def __init__(self):
        self.arrived = False
        self._stop: Callable[[], None] | None = None
        self._before = {}
        if threading.current_thread() is not threading.main_thread():
            return
        for name in _NAMES:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, self._arrive)

    def on_stop(self, stop: Callable[[], None]) -> None:
        """Have ``stop`` called when a signal arrives; at once if one has."""
        self._stop = stop
        if self.arrived:
            stop()

    def restore(self) -> None:
        """Give the signals back to whoever had them."""
        for number, handler in self._before.items():
            # None stands for a handler of Blender's own, which Python cannot put back.
            signal.signal(number, handler or signal.SIG_DFL)
        self._before.clear()

    def _arrive(self, number, frame) -> None:
        if self.arrived:
            raise KeyboardInterrupt
        self.arrived = True
        if self._stop is not None:
            self._stop()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.restore()
