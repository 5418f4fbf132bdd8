"""Every command and every piece of Python in the documentation is run, as it stands, on the smallest scene there is.

A command runs in a folder of its own that holds FILE.blend, FILE.glb, BUNDLE, PREP and PARTS; OUT, DIR and X.png are what it makes
there. What takes minutes does less of the same (FEWER). What this machine cannot run, or what would run all tests again,
is in ELSEWHERE with the reason and the place that does run it; a command that is neither fails.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
MEASURED = sorted(path.relative_to(ROOT).as_posix() for folder in ("benchmarks", "benchmarks/measured")
                  for path in (ROOT / folder).glob("*.md"))
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Fences that hold neither commands nor Python.
OTHER = {"text"}


class Elsewhere(NamedTuple):
    """Commands that this test does not run: why, and which file does."""

    pattern: str
    reason: str
    run_by: str


ELSEWHERE = [
    Elsewhere(r"make (test|test-fast)", "would run this very test again", ".ci/run"),
    Elsewhere(r"(RTGI_VENV=\S+ )?RTGI_PYTHON=\S+ make test", "would run this very test again, set up anew", ".ci/run"),
    Elsewhere(r"make campaign", "takes an hour; a short form is in the suite", "tests/campaign"),
    Elsewhere(r"make lint", "is a step of its own", ".ci/run"),
    Elsewhere(r"make (bench|charts)", "takes many minutes; that its scripts are there is tested below",
              "tests/docs/test_commands.py"),
    Elsewhere(r"make extension", "downloads wheels", "tests/extension"),
    Elsewhere(r"python tools/build_kernels\.py( --pin| --install)?", "downloads a compiler, and writes into tools/ and this Python",
              "tests/kernels/test_build.py"),
    Elsewhere(r"python tools/build_kernels\.py --checked PATH", "takes a C compiler with sanitizers",
              "tests/kernels/test_build.py"),
    Elsewhere(r"\.ci/run", "would run this very test again", ".ci/run"),
    Elsewhere(r"blender --command extension (install-file|remove) .*", "needs a real Blender or its module with a user folder",
              "tests/extension"),
    Elsewhere(r'ln -s "\$PWD" ~/\.config/blender/.*', "would change this user's Blender", "tests/blender/conftest.py"),
    Elsewhere(r"mkdir -p ~/\.config/blender/.*|blender -b --python-expr .*addon_enable.*", "would change this user's Blender",
              "tests/blender/test_window.py"),
    Elsewhere(r"PATH_TO_BLENDER/\S+ -m pip install embreex", "needs a real Blender and a network", "tools/debian_tree.py"),
    Elsewhere(r'python3 -m pip install "\.\[blender\]"|rtgi bake FILE\.blend --out OUT', "would download Blender",
              "tests/blender/cli/test_first_steps.py"),
    Elsewhere(r"\.venv/bin/python -m rtgi_addon stability --out DIR", "takes minutes: every case of the suite",
              "tests/evaluate/test_stability.py"),
    Elsewhere(r"rtgi farm PREP .*", "needs a cluster", "tests/jobs/test_farm.py"),
    Elsewhere(r"python -m rtgi_addon stability --case NAME .*", "NAME stands for what one has just written",
              "tests/evaluate/test_stability.py"),
]
# What takes long even on the smallest scene.
SLOW = re.compile(r" (chart|stability|plan|render)( |$)|--technique auto|make demo")
# What takes minutes even there measures less of the same: options that are added to the command.
FEWER = {"chart": ["--techniques", "probes", "--seeds", "1", "--points", "8", "--probes", "2", "--noise", "0.1",
                   "--no-pictures"],
         "stability": ["--case", "rotation", "--technique", "probes", "--no-variants"], "render": ["--samples", "4"]}
NEEDS_GPU = re.compile(r" render ")


def commands(text):
    """The commands in the fences of a page: comments and prompts taken off, lines that go on joined."""
    for language, body in FENCE.findall(text):
        if language in {"", "sh", "bash"}:
            for line in body.replace("\\\n", " ").splitlines():
                line = re.sub(r"(^|\s)#.*$", "", line).strip()
                if line:
                    yield " ".join(line.split())


def named(text):
    """Commands that stand in a sentence between backticks."""
    text = FENCE.sub("", text)
    for code in re.findall(r"`([^`]+)`", text):
        code = " ".join(code.split())
        if re.match(r"(RTGI_\w+=\S+ )*(make [a-z-]+$|make [a-z-]+ |python3? (?!-m http))|\.ci/run$", code):
            yield code


def all_commands():
    """{command: the first page that has it}."""
    found = {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for command in (*commands(text), *named(text)):
            found.setdefault(command, page.relative_to(ROOT).as_posix())
    return found


def elsewhere(command):
    """The row of ELSEWHERE for a command, or None."""
    return next((row for row in ELSEWHERE if re.fullmatch(row.pattern, command)), None)


ALL = all_commands()
HERE = [command for command in ALL if elsewhere(command) is None]


def test_there_are_commands():
    assert len(ALL) > 20 and len(HERE) > 12
    assert "make demo" in HERE and ".venv/bin/python -m rtgi_addon info BUNDLE" in HERE


def test_what_runs_elsewhere_runs_there():
    for row in ELSEWHERE:
        assert any(re.fullmatch(row.pattern, command) for command in ALL), f"no page has {row.pattern}"
        assert row.reason and (ROOT / row.run_by).exists(), row
    ci = (ROOT / ".ci/run").read_text()
    assert "make lint" in ci and "make test" in ci and os.access(ROOT / ".ci/run", os.X_OK)
    assert re.search(r"extension.*install-file|package_install_files", "".join(
        path.read_text() for folder in ("tests/extension", "tests/support") for path in (ROOT / folder).glob("*.py")))


def test_every_fence_is_of_a_known_kind():
    for page in PAGES:
        for language, _ in FENCE.findall(page.read_text(encoding="utf-8")):
            assert language in {"", "sh", "bash", "python", *OTHER}, f"{page}: {language}"


def test_every_target_of_make_is_there():
    targets = set(re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(), re.MULTILINE))
    asked = {word for command in ALL for word in re.findall(r"\bmake ([a-z-]+)", command)}
    assert asked and asked <= targets


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", *MEASURED])
def test_scripts_that_are_named_are_there_and_take_their_options(page):
    """Benchmarks take minutes to hours; that they exist and know the options given to them is all that is asked here."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for code in re.findall(r"`([^`]+)`", FENCE.sub("", text)):
        found = re.search(r"\b((?:benchmarks|tests|tools|sample_blends)/[\w/]+\.py)(.*)", " ".join(code.split()))
        if not found:
            continue
        script = ROOT / found[1]
        assert script.is_file(), code
        source = script.read_text(encoding="utf-8")
        # Options that several scripts have are in a module beside them.
        beside = [script.parent / f"{name}.py" for name in re.findall(r"^from (\w+) import", source, re.MULTILINE)]
        source += "".join(path.read_text(encoding="utf-8") for path in beside if path.is_file())
        for option in re.findall(r"(?<!\S)(--[a-z][a-z-]+)", found[2]):
            assert f'"{option}"' in source, f"{code}: no {option}"


@pytest.fixture(scope="session")
def prepared(tiny_scene, tmp_path_factory):
    """A folder with FILE.blend, FILE.glb, BUNDLE, PREP and its two PARTS."""
    folder = tmp_path_factory.mktemp("prepared")
    for path in (tiny_scene, tiny_scene.with_suffix(".glb")):
        shutil.copy(path, folder)
    done = run([sys.executable, "-m", "rtgi_addon", "FILE.blend", "bake", "--out", "BUNDLE", "--preset", "draft"], folder)
    assert done.returncode == 0, done.stderr
    for words in (["FILE.blend", "prepare", "--out", "PREP", "--error", "0.2"], *(
            ["bake", "PREP", "--part", f"{part}/2", "--out", f"PARTS/{part}"] for part in (1, 2))):
        done = run([sys.executable, "-m", "rtgi_addon", *words], folder)
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def folder(prepared, tmp_path):
    """A copy of it for one command, with the samples beside."""
    where = tmp_path / "here"
    shutil.copytree(prepared, where)
    (where / "sample_blends").symlink_to(ROOT / "sample_blends")
    return where


def run(words, folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"}
    return subprocess.run([str(word) for word in words], cwd=folder, env=environment, capture_output=True, text=True,
                          encoding="utf-8", timeout=1200, check=False)


# What stands in for a real Blender: its command's own handler, in Blender's module, with the file open.
HANDLER = """
import sys
import bpy, rtgi_addon
from rtgi_addon.__main__ import leave
rtgi_addon.register()
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
from rtgi_addon.blender.cli.doors import main_blender
leave(main_blender(sys.argv[2:]))
"""


def words_of(command):
    """The words to run for a command of the documentation, or None if nobody knows how."""
    words = shlex.split(command)
    if words[:3] == [".venv/bin/python", "-m", "rtgi_addon"]:
        return [sys.executable, *words[1:]]
    if words[0] in {"python", "python3"}:
        return [sys.executable, ROOT / words[1] if words[1].endswith(".py") else words[1], *words[2:]]
    if words[:2] == ["blender", "-b"] and words[3:5] == ["--command", "rtgi"]:
        return [sys.executable, "-c", HANDLER, words[2], *words[5:]]
    return None


@pytest.mark.parametrize("command", [pytest.param(command, marks=[pytest.mark.slow] if SLOW.search(command) else [])
                                     for command in HERE if not command.startswith("make ")])
def test_the_command_does_what_it_says(command, folder):
    words = words_of(command)
    assert words is not None, f"{ALL[command]} has a command that no test knows: run it here, or say in ELSEWHERE who does"
    if words[1:2] and str(words[1]).endswith("settings_tables.py"):
        pytest.skip("writes into docs/; tests/docs/test_pages.py compares what it would write")
    done = run([*words, *(option for name, options in FEWER.items() if name in words for option in options)], folder)
    if NEEDS_GPU.search(command) and done.returncode == 1 and re.search("OpenGL|libEGL|GPU", done.stderr):
        pytest.skip("needs a driver with OpenGL 4.3, which is not here")
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    for made in {"OUT", "DIR", "X.png"} & set(words):
        assert (folder / made).exists(), made


def recipe(target):
    """The commands of a target of the Makefile, without those of its set-up."""
    # These tests may themselves run under make, which then says which folder it enters.
    said = subprocess.run(["make", "--no-print-directory", "-n", target], cwd=ROOT, text=True, check=True,
                          capture_output=True).stdout
    return [line for line in said.splitlines() if not line.startswith(("sh tools/setup.sh", "echo "))]


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@pytest.mark.parametrize("command", [pytest.param(command, marks=[pytest.mark.slow] if SLOW.search(command) else [])
                                     for command in HERE if command.startswith("make ")])
def test_the_target_of_make_does_what_it_says(command, folder):
    """Its recipe is run; `setup`, which needs a network, is what the tests themselves were set up with."""
    target = command.split()[1]
    if target == "setup":
        assert recipe("setup") == []
        return
    for line in recipe(target):
        words = shlex.split(line)
        if words[-4:] and words[0].endswith("/python"):
            words = [sys.executable, *words[1:]]
        done = run(words, folder)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
    if target == "demo":
        assert (folder / "demo/cornell_box/bake.json").is_file() and (folder / "demo/cornell_box.png").is_file()


SNIPPETS = [(page, code) for page in PAGES for language, code in FENCE.findall(page.read_text(encoding="utf-8"))
            if language == "python" and page.name != "CONTRIBUTING.md"]  # those are files: test_one_file.py


@pytest.mark.parametrize(("page", "code"), SNIPPETS, ids=[page.relative_to(ROOT).as_posix() for page, _ in SNIPPETS])
def test_python_runs_as_it_stands(page, code, folder):
    (folder / "demo").mkdir()
    (folder / "BUNDLE").rename(folder / "demo/cornell_box")
    before = ""
    if "import bpy" in code:
        before = "import bpy, rtgi_addon\nrtgi_addon.register()\nbpy.ops.wm.open_mainfile(filepath='FILE.blend')\n"
    if "import OpenEXR" in code:
        pytest.importorskip("OpenEXR", reason="needs OpenEXR")
    (folder / "snippet.py").write_text(before + code, encoding="utf-8")
    done = run([sys.executable, "snippet.py"], folder)
    assert done.returncode == 0, done.stderr
    if "last_bake" in code:
        assert "8 probes, light on surfaces off by" in done.stdout and (folder / "light/bake.json").is_file()


def test_the_reader_on_the_page_reads_what_the_bake_measured(folder):
    """The floor's irradiance by the page's fifteen lines, and by our own reader without visibility weights."""
    import numpy as np

    from rtgi_addon.exchange.bundle import read_bundle
    from rtgi_addon.techniques.lattice.reconstruction import linear
    pytest.importorskip("OpenEXR", reason="needs OpenEXR")
    code = next(code for page, code in SNIPPETS if page.name == "engines.md")
    names = {}
    exec(code.replace("demo/cornell_box", str(folder / "BUNDLE")), names)
    grid = read_bundle(folder / "BUNDLE").grids[0]
    expected = np.maximum(linear(grid.sh, np.broadcast_to(np.float32([0, 0, 1]), (*grid.sh.shape[:3], 3))), 0.0)
    assert names["E"].shape == (2, 2, 2, 3)
    np.testing.assert_allclose(names["E"], expected, rtol=1e-4)
