"""What Cycles said about nodes, kept for readings that cannot ask it: while Blender renders, and where a viewport waits.

Keys are digests of all that the answer depends on as far as `fingerprint` sees it, so a texture that was painted over is missed
until the next bake, which always asks anew.
"""

from collections import OrderedDict
from collections.abc import Callable
from contextlib import contextmanager

# Panoramas are 6 MB, baked materials 12 MB at most.
_MOST = 64
_answers: OrderedDict[str, object] = OrderedDict()
_reusing = False


@contextmanager
def reuse(wanted: bool = True):
    """Within it ``answer`` gives what it remembers, if ``wanted``."""
    global _reusing
    before, _reusing = _reusing, wanted
    try:
        yield
    finally:
        _reusing = before


def answer(key: Callable[[], str], ask: Callable[[], object]):
    """What ``ask`` returns, kept under ``key()``; within ``reuse`` what was kept there before, if anything was."""
    name = key()
    if not (_reusing and name in _answers):
        _answers[name] = ask()
    _answers.move_to_end(name)
    while len(_answers) > _MOST:
        _answers.popitem(last=False)
    return _answers[name]


def remembers(name: str) -> bool:
    """Whether ``answer`` has something kept under the key ``name``."""
    return name in _answers


def forget() -> None:
    """Drop everything: another file is open."""
    _answers.clear()
