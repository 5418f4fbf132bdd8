"""Random command lines, as processes: any subcommand with any options, good values and bad, and paths to everything that may lie
on a disk. Held to: an exit code that is promised; a failure is one line, without an internal error; nothing that a terminal would
obey; what fails leaves every file as it was, and what succeeds changes nothing but its result; SIGTERM ends it.
"""

import argparse
import contextlib
import json
import os
import re
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
from common import MOST_SECONDS, Tally, differences, rng_of, snapshot
from jobs import JOBS, ready
from scene_builders import closed_box

# A command that has taken so much of a processor, or that is still at work then, is told to stop; it hangs if it then takes nothing
# of a processor for so long, or goes on for as long as ENOUGH [s].
WORK, PATIENCE, GRACE, ENOUGH = 4.0, 25.0, 60.0, 600.0
NUMBERS = ("0", "1", "2", "-1", "0.05", "0.5", "nan", "inf", "1e999", "-0", "99999999999999999999", "", "abc", "1,2", "0x10", "٣",
           "1_000", " 1", "1e-400", "true")
NAMES = ("Probes", "Camera", "probes", "tiny", "offset", "vpl", "auto", "godot", "threejs", "made-up", "", "no such", "\x1b[31m",
         "a\nb", "ü" * 300, "--out", "order=1", "rays=16", "fail_at=1", "pause=60", "pause=0.1", "not_finite=True", "order=", "=",
         "x=y", "order=nan", "draft", "final", "1G", "-5M", "0")
PATHS = ("bundle", "damaged", "edited", "game/out", "measured/out", "file", "x.png", "x.exr", "thesis", "mine", "empty", "link",
         "circle", "to bundle", "pipe", "pipe.png", "room.blend", "room.glb", "wood.png", "bad.blend", "bad.glb", "new", "new.png",
         "new.exr", "none/new", "bundle/new", "bundle/Volume/new.png", "new.partial", "mine.partial", "a b\x1b[31m\nc/new", "", ".",
         "..", "/", "/dev/null", "/dev/full", "/proc/new", "/dev/null/x", "x" * 300, "ü" * 130, "new\0", "~/new", "~nobody/new",
         "game/out/new.png", "game/new", "room.blend/new", "-new", "\udcff\udcfe")
CONTROL = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")

_BLEND = """
import bpy, sys
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_cube_add(size=4)
bpy.context.object.name = "Walls"
for name, kind in (("Lamp", "POINT"),):
    bpy.context.collection.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, kind)))
probe = bpy.data.lightprobes.new("Probes", "VOLUME")
probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
bpy.context.collection.objects.link(bpy.data.objects.new("Probes", probe))
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
bpy.context.collection.objects.link(camera)
bpy.context.scene.camera = camera
bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 32, 24
image = bpy.data.images.new("wood", 4, 4)
image.filepath_raw, image.file_format = sys.argv[-1] + "/wood.png", "PNG"
image.save()
material = bpy.data.materials.new("Wood")
if material.node_tree is None:
    material.use_nodes = True
material.node_tree.nodes.new("ShaderNodeTexImage").image = image
bpy.data.objects["Walls"].data.materials.append(material)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1] + "/room.blend", check_existing=False)
bpy.ops.export_scene.gltf(filepath=sys.argv[-1] + "/room.glb", export_lights=True)
"""


class Commanding:
    """Trials by number, in the folder ``place``."""

    def __init__(self, seed: int, place: Path):
        ready()
        # What real techniques take is no business of a command line.
        from rtgi_addon import techniques
        registry = techniques.registry()
        for name in set(registry) - {"tiny", "offset", "probes"}:
            del registry[name]
        self.seed, self._place = seed, place
        self._template = place / "template"
        self._make_template()
        self._options = _options()

    def _make_template(self) -> None:
        import subprocess
        root = self._template
        root.mkdir()
        from rtgi_addon.jobs.bake import bake_scene
        bake_scene(closed_box(resolution=(2, 2, 2)), "tiny", {}, root / "bundle", threads=1)
        shutil.copytree(root / "bundle", root / "damaged")
        (root / "damaged/bake.json").write_text("{")
        shutil.copytree(root / "bundle", root / "edited")
        next((root / "edited").glob("*/sh0.exr")).write_bytes(b"mine")
        (root / "game").mkdir()
        JOBS["godot"].run(root / "game", False, False)
        JOBS["godot"].plant(root / "game")
        (root / "measured").mkdir()
        JOBS["stability"].run(root / "measured", False, False)
        for name, text in (("file", "mine"), ("x.png", "mine"), ("x.exr", "mine"), ("bad.blend", "BLENDER"), ("bad.glb", "glTF"),
                           ("thesis/chapter.txt", "mine"), ("mine.partial/notes", "mine"), ("a b\x1b[31m\nc/ü", "mine")):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        (root / "empty").mkdir()
        (root / "link").symlink_to("empty")
        (root / "circle").symlink_to("circle")
        (root / "to bundle").symlink_to("bundle")
        os.mkfifo(root / "pipe")
        os.mkfifo(root / "pipe.png")
        subprocess.run([sys.executable, "-c", _BLEND, str(root)], check=True, capture_output=True, timeout=300)
        for copy in root.glob("*.blend1"):
            copy.unlink()

    def command(self, rng: np.random.Generator) -> list[str]:
        """A random command line, in words."""
        def choose(values):
            return values[int(rng.integers(len(values)))]

        def value(action):
            word = f"{action.dest} {action.metavar or ''}".lower()
            if action.choices and rng.random() < 0.8:
                return choose(list(action.choices))
            if any(part in word for part in ("out", "file", "dir", "bundle", "picture", "model", "import")) and rng.random() < 0.9:
                return choose(PATHS)
            if (action.type is not None or "n" == word.split()[-1]) and rng.random() < 0.8:
                return choose(NUMBERS)
            return choose(NAMES)

        name = choose(list(self._options))
        words = [] if rng.random() < (0.75 if name in ("info", "export") else 0.1) else [
            "room.blend" if rng.random() < 0.75 else choose(PATHS)]
        words.append(name)
        for action in self._options[name]:
            wanted = action.required or not action.option_strings
            if rng.random() > (0.93 if wanted else 0.12):
                continue
            if action.option_strings:
                words.append(choose(action.option_strings))
            if action.nargs == 0:
                continue
            for _ in range(int(rng.integers(1, 3)) if action.nargs in ("+", "*") else 1):
                good = {"engine": "godot", "technique": "tiny", "bundle": "bundle", "error": "0.5"}.get(action.dest)
                words.append(good if good and rng.random() < 0.6 else value(action))
        if name in ("bake", "render") and "--technique" not in words:
            words += ["--technique", "tiny"]
        if rng.random() < 0.05:
            words.insert(int(rng.integers(len(words) + 1)), choose(NAMES))
        return [word for word in words if isinstance(word, str)]

    def trial(self, number: int, tally: Tally) -> None:
        """Run one command line."""
        rng = rng_of("commands", self.seed, number)
        words = self.command(rng)
        root = self._place / f"trial-{number}"
        shutil.copytree(self._template, root, symlinks=True, copy_function=shutil.copy2, ignore=_pipes)
        for name in ("pipe", "pipe.png"):
            os.mkfifo(root / name)
        before = snapshot(root)
        code, out, err, seconds, peak = self._run(words, root)
        shown = " ".join(json.dumps(word) for word in words)

        def find(what: str) -> None:
            tally.findings.append((number, f"{shown}: {what}"))

        tally.count("commands")
        tally.count(f"that ended with {code}")
        # Blender and its importers are part of what a command takes.
        tally.costs(number, seconds, peak, WORK + MOST_SECONDS)
        self._judge(words, root, before, code, out, err, find)
        shutil.rmtree(root)

    def _judge(self, words, root, before, code, out, err, find) -> None:
        # A note (nothing to resume) is no error; what ends the command is one line all the same.
        errors = [line for line in err.splitlines() if not re.match(r"rtgi: +\d+ % |rtgi: note: ", line)]
        if code not in (0, 1, 2, 130):
            find(f"ended with {code}: {err[-300:]}")
        if "internal error" in err or ("Traceback" in err and "--traceback" not in words):
            find(f"an internal error: {err[-400:]}")
        if code in (1, 2) and "--traceback" not in words and (len(errors) != 1 or not errors[0].startswith("rtgi: error: ")):
            find(f"not one line of error: {errors}")
        if code != 0 and out and not (any(word.startswith("--j") for word in words) and _is_error(out)):
            find(f"a failure with a result: {out[:200]!r}")
        if code == 0 and "--json" in words and "--help" not in words and "-h" not in words:
            try:
                json.loads(out)
            except ValueError:
                find(f"no JSON: {out[:200]!r}")
        if "--traceback" not in words and CONTROL.search(out + err):
            find(f"orders to a terminal: {CONTROL.search(out + err)}")
        changed = differences(before, snapshot(root))
        allowed = [] if code == 2 else _results(words, root)
        after = snapshot(root)
        touched = {name.rstrip("/") for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
        strange = sorted(name for name in touched if not any(
            name == result or name.startswith(result + "/") for result in (
                allowed if code in (0, 130) or "--picture" in words else []) + [result + ".partial" for result in allowed]))
        if strange:
            find(f"ended with {code} and touched {', '.join(strange[:4])} ({changed})")
        left = sorted(name for name in touched if name in after and re.search(r"\.partial/(new|old|commit|written)", name))
        if left:
            find(f"left {', '.join(left[:4])}")

    def _run(self, words: list[str], root: Path) -> tuple[int, str, str, float, int]:
        """The exit code, what was said on both streams, and the costs."""
        out, err, temporary = (self._place / f"{root.name}.{what}" for what in ("out", "err", "tmp"))
        temporary.mkdir()
        started = time.monotonic()
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            _command(words, root, out, err, temporary)
        told, since, work = None, started, 0.0
        while True:
            ended = os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT | os.WNOHANG)
            if ended is not None:
                break
            now, before = time.monotonic(), work
            work = _work_of(child)
            if told is None and (now > started + PATIENCE or work > WORK):
                os.kill(child, signal.SIGTERM)
                told = since = now
            elif work > before:
                # A busy machine may give it little at a time.
                since = now
            if told is not None and (now > since + GRACE or now > told + ENOUGH):
                os.kill(child, signal.SIGKILL)
            time.sleep(0.05)
        _, status, usage = os.wait4(child, 0)
        code = os.waitstatus_to_exitcode(status)
        said = [path.read_text(encoding="utf-8", errors="replace") for path in (out, err)]
        if os.listdir(temporary):
            said[1] += f"\nrtgi: left in the folder of temporary files: {os.listdir(temporary)}"
        for path in (out, err):
            path.unlink()
        shutil.rmtree(temporary)
        # One that failed in that moment says so in its own way.
        if told is not None and code not in (0, 1, 2, 130):
            said[1] += f"\nrtgi: told to stop, it ended with {code}"
        return code, *said, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def _work_of(process: int) -> float:
    """Seconds that all threads of a process have taken of processors."""
    ticks = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def _command(words, root, out, err, temporary):
    """In the child: be the command line."""
    code = 99
    try:
        for path, number in ((out, 1), (err, 2)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
        os.chdir(root)
        os.environ["TMPDIR"] = str(temporary)
        import tempfile
        tempfile.tempdir = None
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        from rtgi_addon.blender.cli import main_module
        from rtgi_addon.interrupts import Interrupts
        sys.argv = ["rtgi", *words]
        with Interrupts() as interrupts:
            code = main_module(words, interrupts)
        if "bpy" in sys.modules:
            shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
    except BaseException as error:
        with contextlib.suppress(BaseException):
            os.write(2, f"Traceback: {type(error).__name__}: {error}\n".encode("utf-8", "replace"))
    finally:
        with contextlib.suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def _is_error(text: str) -> bool:
    """Whether ``text`` is the JSON of an error, which a program that asked for JSON gets in place of a result."""
    try:
        return set(json.loads(text)) == {"error"}
    except ValueError:
        return False


def _options() -> dict[str, list[argparse.Action]]:
    """The options of every subcommand."""
    from rtgi_addon.blender.cli.parser import build_parser
    parser = build_parser("rtgi")
    (subparsers,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return {name: list(sub._actions) for name, sub in subparsers.choices.items()}


def _results(words: list[str], root: Path) -> list[str]:
    """Where a command line may write, relative to ``root``."""
    found = []
    for index, word in enumerate(words):
        name, equals, value = word.partition("=")
        if not (len(name) > 3 and ("--out".startswith(name) or "--picture".startswith(name))):
            continue
        value = value if equals else words[index + 1] if index + 1 < len(words) else ""
        with contextlib.suppress(OSError, ValueError, RuntimeError):
            path = (root / value).resolve()
            if path.is_relative_to(root) and path != root:
                found.append(path.relative_to(root).as_posix())
    return found


def _pipes(folder, names):
    return [name for name in names if name.startswith("pipe")]


