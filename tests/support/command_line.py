"""The module's door as a process, with the technique that bakes numbers (tiny_technique.py) in place of the real ones."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TINY = ROOT / "tests/support/tiny_technique.py"
CORNELL = ROOT / "sample_blends/cornell_box.blend"
PROGRESS = re.compile(r"rtgi: +\d+ % ")


def start(*words, **options):
    """The command line with the tiny technique as a process that hears every signal."""
    options = {"preexec_fn": hear, **options} if os.name != "nt" else options
    return subprocess.Popen([sys.executable, str(TINY), *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, encoding="utf-8", **{"env": {**os.environ, "PYTHONPATH": str(ROOT)}, **options})


def hear():
    # What a shell runs in its background ignores Ctrl-C, and so do the tests there and all they start.
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def run(*words, **options):
    """Exit code, stdout and the lines on stderr."""
    process = start(*words, **options)
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err.splitlines()


def bake(*words, file=CORNELL, **options):
    return run(file, "bake", "--technique", "tiny", *words, **options)


def contents(folder):
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    manifest = json.loads(files.pop("bake.json"))
    manifest.pop("stats")
    return files, manifest


def assert_failed(outcome, *words, code=1):
    """One error line that holds ``words``, progress at most beside it, nothing on stdout."""
    returned, out, err = outcome
    errors = [line for line in err if not PROGRESS.match(line)]
    assert returned == code, (returned, out, err)
    assert out == "" and len(errors) == 1 and errors[0].startswith("rtgi: error: "), (out, err)
    for word in words:
        assert word in errors[0], errors[0]
    assert errors[0].count(": ") >= 2, f"no remedy: {errors[0]}"


def wait_for_checkpoint(process, out):
    """Return once ``process`` has saved a part of the bake to ``out``."""
    partial = out.with_name(out.name + ".partial")
    while process.poll() is None and not list(partial.glob("*.part")):
        time.sleep(0.01)
    assert process.poll() is None, process.communicate()


SLOW = ("--set", "pause=0.3", "--checkpoint-seconds", "0")


def begin(out, words=SLOW, **options):
    """A bake under way, with a part of it saved."""
    process = start(CORNELL, "bake", "--technique", "tiny", "--out", out, *words, **options)
    wait_for_checkpoint(process, out)
    return process
