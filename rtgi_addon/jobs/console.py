"""Progress on stderr: one updating line on a terminal, else a line every few seconds."""

import shutil
import time

from ..words import one_line


class ConsoleProgress:
    """The ``report`` of a ``Progress``, writing to the text stream ``stream``.

    On a terminal it rewrites one line; elsewhere (a log, a farm) it adds a line at most every ``interval`` seconds and whenever
    the whole is done.
    """

    def __init__(self, stream, interval: float = 5.0):
        self._stream = stream
        self._interval = interval
        self._terminal = stream.isatty()
        self._last = None
        self._width = 0

    def __call__(self, fraction: float, label: str, seconds_left: float | None) -> None:
        """Show that ``fraction`` is done. Never raises: a closed stream must not end a bake."""
        now = time.monotonic()
        if not self._terminal and fraction < 1.0 and self._last is not None and now - self._last < self._interval:
            return
        self._last = now
        left = "" if seconds_left is None or fraction >= 1.0 else f", {duration(seconds_left)} left"
        self._write(one_line(f"rtgi: {100.0 * fraction:3.0f} % {label}{left}"))

    def close(self) -> None:
        """Take the updating line away, so that the next output starts on a clean line."""
        if self._width:
            self._put("\r" + " " * self._width + "\r")
            self._width = 0

    def _write(self, line: str) -> None:
        if not self._terminal:
            self._put(line + "\n")
            return
        line = line[:max(shutil.get_terminal_size().columns - 1, 10)]
        self._put("\r" + line.ljust(self._width))
        self._width = len(line)

    def _put(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):
            pass


def duration(seconds: float) -> str:
    """Seconds as a person says them: `9 s`, `3 min 20 s`, `1 h 05 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, seconds = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {seconds:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"
