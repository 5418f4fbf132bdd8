"""Whose words reach the user: ours. Blender and its importers print on both streams as they please."""

import contextlib
import os
import sys


class Streams:
    """The process's own stdout and stderr, kept apart from what libraries print.

    From construction on, file descriptor 1 leads nowhere for the rest of the process (restoring it would let through what C
    libraries still hold in their buffers), and ``out`` is the real stdout. ``err`` is the real stderr; descriptor 2 leads
    nowhere only within ``hush``. With ``loud`` the libraries' words go to stderr instead, for debugging.
    """

    def __init__(self, loud: bool = False):
        sys.stdout.flush()
        sys.stderr.flush()
        self._loud = loud
        self.out = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace")
        self.err = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace")
        _lead(1, 2 if loud else None)

    @contextlib.contextmanager
    def hush(self):
        """Nothing that is printed inside reaches stderr, except through ``err``."""
        if self._loud:
            yield
            return
        sys.stderr.flush()
        _lead(2, None)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(self.err.fileno(), 2)


def _lead(descriptor: int, target: int | None) -> None:
    """Make ``descriptor`` lead to ``target``, or nowhere."""
    if target is not None:
        os.dup2(target, descriptor)
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
