"""The architecture as a test: imports go down, outside packages have one owner, modules stay small, the public is documented."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "rtgi_addon"

# A module may import strictly lower ranks and its own folder. Modules beside the folders that are not named here (register,
# the command-line entry) stand on top of everything.
RANKS = {
    "errors": -1, "progress": -1, "numerics": 0, "scene": 1, "transport": 2, "techniques": 3, "passes": 3, "exchange": 4,
    "evaluate": 4, "preview": 4, "jobs": 5, "blender": 6,
}
TOP = 7
LEAVES = {"errors", "progress"}

# Who may import what from outside; numpy and the standard library are everybody's.
OWNERS = {
    "bpy": {"blender"}, "_cycles": {"blender"}, "bpy_extras": {"blender"}, "bmesh": {"blender"}, "addon_utils": {"blender"},
    "bpy_types": {"blender"}, "bl_operators": {"blender"}, "bl_ui": {"blender"},
    "mathutils": {"blender", "transport"}, "gpu": {"preview"}, "gpu_extras": {"preview"}, "blf": {"preview"},
    "matplotlib": {"evaluate"}, "embreex": {"transport"},
}
# Heavy, and not there in Blender: imported inside the function that draws.
LATE = {"matplotlib"}


def modules():
    """Every Python file of the package."""
    return sorted((ROOT / PACKAGE).rglob("*.py"))


def folder_of(parts):
    """The ranked name a dotted module belongs to: its folder, or the module itself right below the package."""
    return parts[1] if len(parts) > 1 else "__init__"


def imports(source, module, is_package):
    """Every import in ``source`` as (line, absolute dotted parts, at module level): plain, relative, inside functions, and by
    ``import_module("…")`` or ``__import__("…")`` with a literal name."""
    def visit(node, top_level):
        for child in ast.iter_child_nodes(node):
            yield from found(child, top_level)
            inside = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
            yield from visit(child, top_level and not inside)

    def found(node, top_level):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name.split("."), top_level
        elif isinstance(node, ast.ImportFrom):
            base = node.module.split(".") if node.module else []
            if node.level:
                here = module if is_package else module[:-1]
                base = here[:len(here) - node.level + 1] + base
            for alias in node.names:
                yield node.lineno, [*base, alias.name], top_level
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = getattr(node.func, "attr", getattr(node.func, "id", None))
            if called in ("import_module", "__import__") and isinstance(node.args[0].value, str):
                yield node.lineno, node.args[0].value.split("."), top_level

    yield from visit(ast.parse(source), True)


def faults(source, module, is_package=False):
    """What in ``source`` breaks the layers, one line each."""
    own = folder_of(module)
    rank = RANKS.get(own, TOP)
    for line, target, top_level in imports(source, module, is_package):
        where = f"{'.'.join(module)}:{line} imports {'.'.join(target)}"
        if target[0] == PACKAGE:
            other = folder_of(target)
            # Version, name and the like in the package's own __init__ are nobody's rank; a folder or a module is.
            if other == "__init__" or other == own:
                continue
            if RANKS.get(other, TOP) >= rank and not (own in LEAVES and other in LEAVES):
                yield f"{where}: {other} does not stand below {own}"
        elif target[0] in OWNERS:
            if own not in OWNERS[target[0]]:
                yield f"{where}: only {', '.join(sorted(OWNERS[target[0]]))} may"
            elif target[0] in LATE and top_level:
                yield f"{where}: import it inside the function that needs it"
        elif target[0] not in sys.stdlib_module_names and target[0] != "numpy":
            yield f"{where}: not a package this product depends on"


def test_imports_go_down_and_outside_packages_have_one_owner():
    wrong = []
    for path in modules():
        parts = list(path.relative_to(ROOT).with_suffix("").parts)
        is_package = parts[-1] == "__init__"
        wrong += faults(path.read_text(), parts[:-1] if is_package else parts, is_package)
    assert not wrong, "\n" + "\n".join(wrong)


@pytest.mark.parametrize(("module", "source"), [
    ("scene.checks", "from ..transport import rays"),
    ("scene.checks", "def f():\n    from ..transport.rays import make_tracer"),
    ("scene.checks", "from .. import transport"),
    ("scene.checks", "import rtgi_addon.transport.rays"),
    ("scene.checks", "class A:\n    def f(self):\n        import importlib\n        importlib.import_module('rtgi_addon.jobs')"),
    ("techniques.probes.bake", "from ...jobs import bake"),
    ("techniques.probes.bake", "from ...passes import ssr"),
    ("jobs.bake", "from ..blender import extract"),
    ("jobs.bake", "if True:\n    import bpy"),
    ("errors", "from . import numerics"),
    ("blender.overlay", "import gpu"),
    ("exchange.exr", "import OpenEXR"),
    ("evaluate.chart", "import matplotlib.pyplot as plt"),
    ("numerics.sh", "import scipy.special"),
    ("exchange.bundle", "from .. import __main__"),
])
def test_a_climbing_import_is_found(module, source):
    assert list(faults(source, [PACKAGE, *module.split(".")]))


@pytest.mark.parametrize(("module", "source"), [
    ("progress", "from .errors import Cancelled"),
    ("techniques.probes.bake", "from ..base import Field\nfrom ...transport import rays\nfrom .field import ProbeField"),
    ("jobs.bake", "from .. import exchange\nfrom ..techniques import get"),
    ("evaluate.chart", "def draw():\n    import matplotlib\n"),
    ("transport.rays", "import embreex.rtcore_scene\nfrom mathutils import bvhtree"),
    ("__main__", "from .blender import cli"),
])
def test_a_falling_import_is_let_through(module, source):
    assert not list(faults(source, [PACKAGE, *module.split(".")]))


def test_modules_do_one_thing():
    folders = (PACKAGE, "tests", "tools", "benchmarks", "sample_blends")
    checked = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    long = {str(path.relative_to(ROOT)): lines for path in checked if (lines := len(path.read_text().splitlines())) > 400}
    assert checked and not long, f"longer than 400 lines; make a folder of the same name: {long}"


def undocumented(tree):
    """Public functions and classes of a module without a docstring, and public methods of classes that inherit none."""
    for node in tree.body:
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) or node.name.startswith("_"):
            continue
        if not ast.get_docstring(node):
            yield node.name, node.lineno
        if isinstance(node, ast.ClassDef) and not node.bases:
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and not method.name.startswith("_") and not ast.get_docstring(method):
                    yield f"{node.name}.{method.name}", method.lineno


def test_the_public_is_documented():
    bare = []
    for path in modules():
        tree = ast.parse(path.read_text())
        name = path.relative_to(ROOT)
        if tree.body and not ast.get_docstring(tree):
            bare.append(f"{name}: the module itself")
        bare += [f"{name}:{line} {what}" for what, line in undocumented(tree)]
    assert not bare, "without a docstring:\n" + "\n".join(bare)
