"""How the command line ends when it is told to, from its first line on, and what it says to a terminal."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest
from command_line import CORNELL, PROGRESS, ROOT, SLOW, TINY, assert_failed, bake, begin, contents, run, start

pytest.importorskip("bpy", reason="needs Blender's Python module")
unix = pytest.mark.skipif(os.name == "nt", reason="Windows has no signals to send to one process")


@unix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_is_130_and_one_line_and_keeps_the_checkpoint(tmp_path, number):
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("the tests run under nohup, and so the command heeds no hang-up, as it should")
    (tmp_path / "temporary").mkdir()
    out = tmp_path / "out"
    process = begin(out, env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "temporary")})
    process.send_signal(number)
    text, err = process.communicate(timeout=60)
    said = [line for line in err.splitlines() if not PROGRESS.match(line)]
    assert (process.returncode, text, said) == (130, "", ["rtgi: cancelled"])
    assert not os.listdir(tmp_path / "temporary") and sorted(os.listdir(tmp_path)) == ["out.partial", "temporary"]
    assert not (tmp_path / "out.partial/new").exists()
    assert bake("--out", out, "--resume", *SLOW)[0] == 0
    assert bake("--out", tmp_path / "whole", *SLOW)[0] == 0
    assert contents(out) == contents(tmp_path / "whole")


# Says when it has come so far that it hears: Python's own beginning comes before.
HEARD = """
import runpy
from rtgi_addon.interrupts import Interrupts

made = Interrupts.__init__

def announced(self):
    made(self)
    print("here", flush=True)

Interrupts.__init__ = announced
runpy.run_module("rtgi_addon", run_name="__main__", alter_sys=True)
"""


@unix
@pytest.mark.parametrize("wait", [0.0, 0.2, 0.6, 1.0])
def test_a_signal_while_the_program_is_loaded_is_130_too(tmp_path, wait):
    (tmp_path / "temporary").mkdir()
    process = subprocess.Popen([sys.executable, "-c", HEARD, CORNELL, "bake", "--out", tmp_path / "out"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True,
                               env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "temporary")})
    assert process.stdout.readline() == "here\n"
    time.sleep(wait)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    said = [line for line in err.splitlines() if not PROGRESS.match(line)]
    assert (process.returncode, said) == (130, ["rtgi: cancelled"])
    assert not os.listdir(tmp_path / "temporary") and not (tmp_path / "out").exists()


@unix
def test_nohup_is_respected(tmp_path):
    process = start(CORNELL, "bake", "--technique", "tiny", "--out", tmp_path / "out", *SLOW,
                    preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    while process.poll() is None and not list(tmp_path.glob("out.partial/*.part")):
        time.sleep(0.01)
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=120)
    assert process.returncode == 0 and (tmp_path / "out").is_dir()


@unix
@pytest.mark.slow
def test_two_bakes_to_one_place_do_not_mix(tmp_path):
    out = tmp_path / "out"
    slower = ("--set", "pause=1", "--checkpoint-seconds", "0")
    first = begin(out, slower)
    # However long the others take to start, it is still at it.
    first.send_signal(signal.SIGSTOP)
    try:
        for words in ((), ("--resume",)):
            assert_failed(bake("--out", out, *words), f"process {first.pid} on ", f"is writing {out} (bake, since 20", "wait until")
    finally:
        first.send_signal(signal.SIGCONT)
    first.communicate(timeout=120)
    assert first.returncode == 0
    assert bake("--out", tmp_path / "alone")[0] == 0
    assert contents(out)[0] == contents(tmp_path / "alone")[0] and sorted(os.listdir(tmp_path)) == ["alone", "out"]


HOSTILE = "Pro\x1b]0;owned\x07bes\nrtgi: error: all is lost\r\x9b31m\u202e"


@pytest.mark.slow
def test_names_give_no_orders_to_a_terminal(tmp_path):
    import bpy
    bpy.ops.wm.open_mainfile(filepath=str(CORNELL))
    for item in [*bpy.data.objects, *bpy.data.materials, *bpy.data.scenes, *bpy.data.meshes]:
        item.name = f"{item.name[:10]}{HOSTILE}"
    bpy.context.scene.camera.name = f"Camera{HOSTILE}"
    file = tmp_path / f"a{HOSTILE.replace('/', '')}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), check_existing=False)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    out = tmp_path / f"o\x1b[31m\nut{HOSTILE}"
    for words in ((file, "bake", "--technique", "tiny", "--out", out), ("info", out), ("info", f"{out}\x1b"),
                  (file, "bake", "--technique", "tiny", "--out", out, "--volume", f"no\x1b\n{HOSTILE}"),
                  (file, "bake", "--technique", "tiny", "--out", out, "--set", "fail_at=2"),
                  (file, "bake", "--technique", "\x1b[2J", "--out", out), (file, "bake", "--\x1b[2J\n", "x"),
                  ("export", out, "--engine", "godot", "--out", tmp_path / f"e\x1b\n{HOSTILE}")):
        code, text, err = run(*words)
        said = text + "\n".join(err)
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", said), (words, said)
        errors = [line for line in err if line.startswith("rtgi: error")]
        assert len(errors) == (code != 0) and not [line for line in text.splitlines() if line.startswith("rtgi")], (words, said)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
def test_a_result_that_cannot_be_written_is_an_error(tmp_path):
    assert bake("--out", tmp_path / "out")[0] == 0
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, str(TINY), "info", str(tmp_path / "out")], stdout=full, stderr=subprocess.PIPE,
                              text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=60, check=False)
    assert done.returncode == 1 and done.stderr.startswith("rtgi: error: cannot write the result, no space left on device")


@unix
def test_closed_streams_are_no_trouble(tmp_path):
    for closed in (">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"):
        command = f'"{sys.executable}" "{TINY}" "{CORNELL}" bake --technique tiny --out "{tmp_path}/out" {closed}'
        done = subprocess.run(["sh", "-c", command], capture_output=True, timeout=120, check=False,
                              env={**os.environ, "PYTHONPATH": str(ROOT)})
        assert done.returncode == 0 and b"Traceback" not in done.stderr, (closed, done)
