"""Runs a real Godot for tests: RTGI_GODOT is the command that starts it, with a display where something is drawn."""

import os
import re
import shlex
import subprocess
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from rtgi_addon.exchange.exr import read_exr

ROOT = Path(__file__).resolve().parents[2]
needs_godot = pytest.mark.skipif("RTGI_GODOT" not in os.environ,
                                 reason="needs a real Godot: RTGI_GODOT is the command that starts it")
# The two ways in which Godot draws that differ most.
each_renderer = pytest.mark.parametrize("options", [("--rendering-driver", "vulkan"), ("--rendering-driver", "opengl3")],
                                        ids=["forward+", "compatibility"])


def real(test):
    """Mark a test that runs a Godot."""
    return needs_godot(pytest.mark.slow(test))


def godot(project, *words):
    """Exit code and everything that Godot says about ``project``."""
    command = [*shlex.split(os.environ["RTGI_GODOT"]), "--audio-driver", "Dummy", "--path", str(project), *map(str, words)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return ran.returncode, ran.stdout + ran.stderr


def complaints(said):
    """What Godot complains of in what it ``said``, but for what a machine without a sound card or a display does."""
    lines = [line for line in said.splitlines() if re.search(r"\b(ERROR|WARNING)\b", line)]
    return [line for line in lines if not re.search(r"V-Sync|vsync|ALSA|audio|dbus|libdecor|RADV|MESA", line, re.IGNORECASE)]


def imported(folder):
    """``folder`` after Godot has imported it."""
    code, said = godot(folder, "--headless", "--import")
    assert code == 0 and not complaints(said), said
    return folder


def as_read(path):
    """The numbers of an .exr as Godot's importer reads them, (height, width, channels) float64: halves below 2^-14 as 0."""
    planes, _ = read_exr(path)
    numbers = np.stack([planes[name] for name in sorted(planes, key="RGBA".index)], axis=-1)
    if numbers.dtype == np.float16:
        numbers[np.abs(numbers) < np.finfo(np.float16).smallest_normal] = 0.0
    return numbers.astype(np.float64)


def same_numbers(found, wanted):
    """Hold ``found`` and ``wanted`` to have the same numbers in any order, but for zeros."""
    found, wanted = (np.sort(values[values != 0]) for values in (np.asarray(found), np.asarray(wanted, np.float64)))
    assert len(found) == len(wanted) and np.allclose(found, wanted, rtol=1e-12, atol=0.0)


def drawing(said):
    """Skip where Godot found no driver to draw with."""
    if "Using Device" not in said:
        pytest.skip(f"this Godot cannot draw here: {(complaints(said) or said.splitlines())[-1:]}")


def replacing(text, wrong):
    """The damage that puts ``wrong`` in the place of ``text``."""
    def damage(whole):
        assert text in whole
        return whole.replace(text, wrong)

    return damage


@contextmanager
def damaged(paths, text, wrong):
    """Files that say ``wrong`` in the place of ``text`` for as long as it lasts."""
    whole = [path.read_text() for path in paths]
    try:
        for path, before in zip(paths, whole, strict=True):
            path.write_text(replacing(text, wrong)(before))
        yield
    finally:
        for path, before in zip(paths, whole, strict=True):
            path.write_text(before)


def headless(project, script, count):
    """Hold a conformance script's ``count`` checks to pass without a display."""
    _all_pass(godot(project, "--headless", "--script", script), count)


def drawn(project, script, options, count):
    """Hold a conformance script's ``count`` checks to pass as Godot draws with ``options``; what it said."""
    ran = godot(project, *options, "--script", script)
    drawing(ran[1])
    _all_pass(ran, count)
    return ran[1]


def opens(project, options):
    """Hold the project to run for some frames without a word."""
    code, said = godot(project, *options, "--quit-after", 4)
    assert code == 0 and not complaints(said), said


def finds(project, script, failing, driver="opengl3"):
    """Hold a conformance script to fail with a line that begins ``FAIL failing``; what it said."""
    code, said = godot(project, "--rendering-driver", driver, "--script", script)
    drawing(said)
    assert code == 1 and f"FAIL {failing}" in said, said
    return said


def _all_pass(ran, count):
    code, said = ran
    assert code == 0 and said.count("PASS ") == count and "FAIL" not in said and not complaints(said), said
