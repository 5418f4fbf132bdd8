"""Errors that reach the user as one line: what went wrong, where, and what to do."""


class BakeError(Exception):
    """A failure the user can act on.

    ``cause`` says what is wrong and where (it names the object, file or option); ``remedy`` says what to do about it.
    Every door (shell, module, panel) prints it as one line without a traceback; anything else that is raised is a bug.
    """

    def __init__(self, cause: str, remedy: str):
        super().__init__(f"{cause}: {remedy}" if remedy else cause)
        self.cause = cause
        self.remedy = remedy

    def __reduce__(self):
        return type(self), (self.cause, self.remedy)


class UsageError(BakeError):
    """The call itself is wrong: an unknown option, technique or volume. The shell answers with exit code 2 for options."""


def out_of_memory(error: BaseException) -> BakeError | None:
    """What to tell the user if ``error`` says that there was no memory, or no room for a thread; None for any other."""
    if not isinstance(error, MemoryError) and not (isinstance(error, RuntimeError) and "can't start new thread" in str(error)):
        return None
    what = " ".join(str(error).split())
    return BakeError(f"there is not enough memory ({what or 'an array did not fit'})",
                     "close other programs, raise the limit if one is set, or lower resolution, order and sizes of images")


class Cancelled(Exception):
    """Raised by ``Progress.step`` once the user has asked to stop. Never an error: the last bake stays whole.

    A message says what was kept of the work so far, where anything was.
    """
