"""The architecture as a test: imports go down and never in circles, outside packages have one owner, modules stay small, the
public is documented."""

import ast
import re
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "rtgi_addon"

# A module may import strictly lower ranks and its own folder. Modules beside the folders that are not named here (register,
# the command-line entry) stand on top of everything.
RANKS = {
    "errors": -1, "progress": -1, "words": -1, "interrupts": -1, "discovery": -1, "kernels": -1,
    "numerics": 0, "machine": 0, "storage": 0, "scene": 1,
    "transport": 2, "techniques": 3, "effects": 4, "exchange": 5, "evaluate": 5, "preview": 5, "jobs": 6,
    "blender": 7,
}
TOP = 8
# Within transport: a wing imports strictly lower wings and itself. What is not named here (parallel, vectors) is everybody's.
WINGS = {"surfaces": 1, "rays": 2, "lights": 2, "media": 3, "context": 4, "paths": 5, "cache": 6, "views": 6, "voxels": 6}
LEAVES = {"errors", "progress", "words", "interrupts", "discovery"}

# Who may import what from outside; numpy and the standard library are everybody's.
OWNERS = {
    "bpy": {"blender"}, "_cycles": {"blender"}, "bpy_extras": {"blender"}, "bmesh": {"blender"}, "addon_utils": {"blender"},
    "bpy_types": {"blender"}, "bl_operators": {"blender"}, "bl_ui": {"blender"},
    "mathutils": {"blender", "transport"}, "gpu": {"preview"}, "gpu_extras": {"preview"}, "blf": {"preview"},
    "matplotlib": {"evaluate"}, "embreex": {"transport"}, "distributed": {"jobs"},
}
# Heavy, and not there in Blender: imported inside the function that draws.
LATE = {"matplotlib", "distributed"}


def modules():
    """Every Python file of the package."""
    return sorted((ROOT / PACKAGE).rglob("*.py"))


def named(path):
    """A file's dotted module as parts, and whether it is a package."""
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    is_package = parts[-1] == "__init__"
    return parts[:-1] if is_package else parts, is_package


def folder_of(parts):
    """The ranked name a dotted module belongs to: its folder, or the module itself right below the package."""
    return parts[1] if len(parts) > 1 else "__init__"


def wing_of(parts):
    """The folder or module right below the ranked folder that a dotted module belongs to."""
    return parts[2] if len(parts) > 2 else "__init__"


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
                here, there = wing_of(module), wing_of(target)
                if own == other == "transport" and here != there and WINGS.get(there, 0) >= WINGS.get(here, 0) > 0:
                    yield f"{where}: {there} does not stand below {here}"
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
        wrong += faults(path.read_text(), *named(path))
    assert not wrong, "\n" + "\n".join(wrong)


@pytest.mark.parametrize(("module", "source"), [
    ("scene.checks", "from ..transport import rays"),
    ("scene.checks", "def f():\n    from ..transport.rays import make_tracer"),
    ("scene.checks", "from .. import transport"),
    ("scene.checks", "import rtgi_addon.transport.rays.embree"),
    ("scene.checks", "class A:\n    def f(self):\n        import importlib\n        importlib.import_module('rtgi_addon.jobs')"),
    ("techniques.probes.bake", "from ...jobs import bake"),
    ("techniques.probes.bake", "from ...effects import get"),
    ("effects.depth_fog", "from ..preview.renderer import Renderer"),
    ("transport.surfaces.solids", "from ..rays.tracer import Hits"),
    ("transport.lights.lamps", "from ..rays.tracer import Hits"),
    ("transport.rays.choose", "from ..context import LightContext"),
    ("transport.views.shadow_views", "from ..cache.texels import Focus"),
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
    ("transport.cache.solver", "from ..parallel import chunks\nfrom ..paths import sources\nfrom .texels import Focus"),
    ("transport.rays.embree", "import embreex.rtcore_scene\nfrom mathutils import bvhtree"),
    ("__main__", "from .blender import cli"),
])
def test_a_falling_import_is_let_through(module, source):
    assert not list(faults(source, [PACKAGE, *module.split(".")]))


def test_the_extension_names_its_package_from_where_it_stands():
    """Blender imports the folder as `bl_ext.….rtgi_addon`: nothing is called `rtgi_addon` alone there."""
    found = [node for node in ast.walk(ast.parse((ROOT / "__init__.py").read_text())) if isinstance(node, ast.ImportFrom)]
    assert [(node.level, node.module) for node in found] == [(1, PACKAGE)]


def graph():
    """Every module of the package with those it imports, inside functions too."""
    known = {tuple(named(path)[0]): path for path in modules()}
    edges = {}
    for module, path in known.items():
        found = set()
        for _line, target, _top in imports(path.read_text(), *named(path)):
            found.update(name for name in (tuple(target), tuple(target[:-1])) if name in known and name != module)
        # `from package import module` needs the module and, before it, the package; only the closer one is meant.
        edges[module] = {name for name in found if not any(other[:len(name)] == name != other for other in found)}
    return edges


def circles(edges):
    """Sets of modules each of which imports every other, through whatever is between (Tarjan 1972)."""
    order, low, stack, found = {}, {}, [], []

    def visit(node):
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(edges[node]):
            if other not in order:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == order[node]:
            circle = stack[stack.index(node):]
            del stack[stack.index(node):]
            if len(circle) > 1:
                found.append(sorted(".".join(module) for module in circle))

    for node in edges:
        if node not in order:
            visit(node)
    return found


def test_no_circle_of_modules_exists():
    edges = graph()
    assert sum(map(len, edges.values())) > 500  # the walk sees the package at all
    assert circles(edges) == []


def test_a_circle_is_found():
    edges = {("a",): {("b",)}, ("b",): {("c",), ("d",)}, ("c",): {("a",)}, ("d",): set()}
    assert circles(edges) == [["a", "b", "c"]]


# Packages that are one thing of a kind, and no room for more.
ONE_OF_A_KIND = re.compile(r"^(TECHNIQUE|EFFECT|ENGINE) = ", re.MULTILINE)


def test_every_folder_says_what_lives_in_it_and_what_may_come_in():
    bare = []
    for path in (ROOT / PACKAGE).rglob("__init__.py"):
        text = path.read_text()
        opening = (ast.get_docstring(ast.parse(text)) or "").split("\n\n")[:2]
        says = len(" ".join(opening).split()) >= 20 and re.search(r"\bcomes? in\b", " ".join(opening))
        if not says and not (ONE_OF_A_KIND.search(text) and opening != [""]):
            bare.append(str(path.relative_to(ROOT)))
    assert not bare, f"the docstring does not open with what lives here and what may come in: {bare}"


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


def leftovers(sources, others=()):
    """What is made and never looked at in ``sources`` (name to text): modules' constants that no text names again, ``others``
    included, and attributes ``self._name`` that are given a value and that no text reads."""
    named = Counter(word for source in (*sources.values(), *others) for word in re.findall(r"[A-Za-z_]\w*", source))
    for where, source in sources.items():
        tree = ast.parse(source)
        made = [(name.lineno, name.id, 1) for node in tree.body if isinstance(node, ast.Assign) for target in node.targets
                for name in ast.walk(target) if isinstance(name, ast.Name) and name.id[:2] != "__"]
        attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
        read = {node.attr for node in attributes if isinstance(node.ctx, ast.Load)}
        given = [node for node in attributes if node.attr.startswith("_") and node.attr not in read and
                 isinstance(node.value, ast.Name) and node.value.id == "self"]
        made += [(node.lineno, node.attr, sum(node.attr == other.attr for other in given)) for node in given]
        yield from (f"{where}:{line} {name}" for line, name, times in made if named[name] == times)


def test_nothing_is_made_that_nobody_looks_at():
    package = {path.relative_to(ROOT).as_posix(): path.read_text() for path in modules()}
    # Whoever adds an engine or a reader finds it there: what tests hold is for others to use.
    tests = [path.read_text() for path in (ROOT / "tests").rglob("*.py")]
    assert list(leftovers(package, tests)) == []


def test_leftovers_are_found():
    source = "OLD, USED = 1, 2\nclass A:\n    def f(self):\n        self._old, self._new = USED, self\n        return self._new\n"
    assert list(leftovers({"a.py": source})) == ["a.py:1 OLD", "a.py:4 _old"]
