"""GLSL bodies from files: `shaders/NAME.STAGE.glsl`, with `#include "include/FILE.glsl"` resolved, each file once."""

import re
from functools import cache
from pathlib import Path

SHADERS = Path(__file__).resolve().parents[1] / "shaders"
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$', re.MULTILINE)


@cache
def source(name: str, stage: str) -> str:
    """The text of a stage ('comp', 'vert' or 'frag') of program ``name`` without its declarations."""
    return _expand(SHADERS / f"{name}.{stage}.glsl", set())


def _expand(path: Path, seen: set[Path]) -> str:
    def include(match: re.Match) -> str:
        target = SHADERS / match[1]
        return "" if target in seen else _expand(target, seen)

    seen.add(path)
    return _INCLUDE.sub(include, path.read_text(encoding="utf-8"))
