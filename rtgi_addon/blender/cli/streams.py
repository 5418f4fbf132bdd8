"""Whose words reach the user: ours. Blender and its importers print on both streams as they please."""

import os
import sys


class Streams:
    """The process's own stdout and stderr, kept apart from what libraries print.

    From construction on, file descriptors 1 and 2 lead nowhere for the rest of the process (restoring them would let through
    what C libraries still hold in their buffers); ``out`` and ``err`` are the real ones. With ``loud`` the libraries' words all
    go to stderr, for debugging.
    """

    def __init__(self, loud: bool = False):
        for number, stream in ((1, sys.stdout), (2, sys.stderr)):
            # None, and a number that is nobody's, where whoever started us closed it.
            if stream is not None:
                stream.flush()
            try:
                os.fstat(number)
            except OSError:
                os.dup2(os.open(os.devnull, os.O_WRONLY), number)
        self.out = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace")
        self.err = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace")
        if loud:
            os.dup2(2, 1)
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        os.close(nowhere)
