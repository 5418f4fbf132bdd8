"""Every text of the add-on that a user of Blender sees: of the registered classes, by Blender's own reflection, and of the source,
by its syntax tree."""

import ast
from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase

PACKAGE = Path(__file__).resolve().parents[2] / "rtgi_addon"
TRANSLATORS = {"iface_", "rpt_", "tip_"}
SHOWING = {"text", "heading"}


def classes():
    """Every registered class of ours."""
    bases = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.Panel, bpy.types.Menu, bpy.types.RenderEngine)
    return sorted({cls for base in bases for cls in _below(base)
                   if cls.__name__.startswith("RTGI_") and getattr(cls, "is_registered", False)}, key=lambda cls: cls.__name__)


def _below(cls):
    for child in cls.__subclasses__():
        yield child
        yield from _below(child)


def rna_of(cls):
    """What Blender knows of a class; of an operator, what it shows of it."""
    if not issubclass(cls, bpy.types.Operator):
        return cls.bl_rna
    module, _, name = cls.bl_idname.partition(".")
    return getattr(getattr(bpy.ops, module), name).get_rna_type()


def own_properties(cls):
    """The properties of a group or an operator of ours, without those of Blender's own base classes."""
    if not issubclass(cls, (bpy.types.PropertyGroup, bpy.types.Operator)):
        return []
    theirs = {"rna_type", *({"name"} if issubclass(cls, bpy.types.PropertyGroup) else ()), *AddPresetBase.__annotations__}
    return [item for item in rna_of(cls).properties if item.identifier not in theirs]


def enum_items(item):
    """The items of an enumeration with fixed ones."""
    return list(item.enum_items) if item.type == "ENUM" else []


def of_classes():
    """{text: where} of all labels and tooltips."""
    found = {}
    for cls in classes():
        found[getattr(cls, "bl_label", "")] = cls.__name__
        if issubclass(cls, bpy.types.Operator):
            found[rna_of(cls).description] = cls.__name__
        for item in own_properties(cls):
            hidden = item.is_hidden or (item.type == "POINTER")
            where = f"{cls.__name__}.{item.identifier}"
            if not hidden:
                found[item.name], found[item.description] = where, where
                for entry in enum_items(item):
                    found[entry.name], found[entry.description] = where, where
    groups = {cls.bl_rna.name for cls in classes() if issubclass(cls, bpy.types.PropertyGroup)}
    return {text: where for text, where in found.items() if text and text not in groups}


def _sources():
    for path in sorted((PACKAGE / "blender").rglob("*.py")):
        if path.parent.name not in {"cli", "translations"}:
            yield path, ast.parse(path.read_text(encoding="utf-8"))


def _constants():
    """{name: text} of the modules' own string constants."""
    return {target.id: node.value.value for _, tree in _sources() for node in tree.body
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
            for target in node.targets if isinstance(target, ast.Name)}


def called(node) -> str:
    """The last name of what a call calls."""
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def of_source():
    """{text: where} of what goes through a translation function, or is shown by a layout that translates."""
    found, constants = {}, _constants()
    for path, tree in _sources():
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            where = f"{path.relative_to(PACKAGE)}:{node.lineno}"
            if called(node) in TRANSLATORS:
                found.update({text: where for text in _texts(node.args[0], constants)})
            options = {option.arg: option.value for option in node.keywords}
            translated = not (isinstance(options.get("translate"), ast.Constant) and options["translate"].value is False)
            if called(node) in {"label", "prop", "operator", "menu", "row", "column", "popover", "progress"} and translated:
                for name in SHOWING & set(options):
                    found.update({text: where for text in _texts(options[name], constants)})
    from rtgi_addon.blender.ui.presets import TOOLTIPS
    found.update({text: "blender/ui/presets.py" for text in TOOLTIPS.values()})
    return {text: where for text, where in found.items() if text.strip()}


def _texts(node, constants):
    """The strings that an expression may be: constants, and both sides of a choice."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.Name):
        return [constants[node.id]] if node.id in constants else []
    if isinstance(node, ast.IfExp):
        return _texts(node.body, constants) + _texts(node.orelse, constants)
    return []


def untranslated():
    """[where] of calls that show a text of the source as it stands: no translation function, no layout that translates."""
    shown_by = {"report": 1, "poll_message_set": 0, "draw_lines": 1, "update_stats": 1, "status_text_set": 0}
    found = []
    for path, tree in _sources():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and called(node) in shown_by and len(node.args) > shown_by[called(node)]:
                argument = node.args[shown_by[called(node)]]
                bare = isinstance(argument, ast.Constant) and bool(argument.value)
                if isinstance(argument, ast.JoinedStr):
                    bare = any(isinstance(part, ast.Constant) and any(map(str.isalpha, part.value)) for part in argument.values)
                if bare:
                    found.append(f"{path.relative_to(PACKAGE)}:{node.lineno}")
    return found


def sentences():
    """{pattern: where} of the English sentences from below the panel: errors and their remedies, findings, notes and steps of
    progress, with {0}, {1}, … for what is filled in."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if parts[:2] == ("blender", "cli") or parts[:2] == ("blender", "translations"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            for pattern in _patterns_of(node):
                found.setdefault(pattern, f"{path.relative_to(PACKAGE)}:{node.lineno}")
    return found


def _patterns_of(node):
    name, texts = called(node), [_pattern(argument) for argument in node.args]
    if name in {"BakeError", "UsageError"}:
        return [text for text in texts[:2] if text]
    if name == "Finding" and len(texts) >= 4:
        subject = texts[1] or "{0}"
        return [text for text in (texts[2] and _renumbered(f"{subject} ", texts[2]), texts[3]) if text]
    if name in {"step", "Shown"} and len(texts) > 1:
        return [texts[1]] if texts[1] else []
    owner = getattr(node.func, "value", None)
    if name == "add" and getattr(owner, "attr", getattr(owner, "id", "")) in {"omissions", "_omissions"}:
        remedies = [_pattern(option.value) for option in node.keywords if option.arg == "remedy"]
        return [text for text in (*texts[:1], *remedies) if text]
    if name in {"_note", "_omit"} and texts and texts[-1]:
        return [texts[-1] if len(texts) == 1 else _renumbered("{0} ", texts[-1])]
    if name == "_remark" or (name == "append" and getattr(owner, "id", "") == "notes"):
        return [texts[0]] if texts and texts[0] else []
    return []


def _renumbered(subject, problem):
    """``problem`` after ``subject``, its places numbered on."""
    shift = subject.count("{")
    count = problem.count("{")
    for number in reversed(range(count)):
        problem = problem.replace(f"{{{number}}}", f"{{{number + shift}}}")
    return subject + problem


def _pattern(node):
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        text, places = "", 0
        for part in node.values:
            if isinstance(part, ast.Constant):
                text += part.value
            else:
                text, places = f"{text}{{{places}}}", places + 1
        # What has hardly a word of its own cannot be recognized.
        return text if sum(letter.isalpha() for letter in text) >= 7 else None
    return None
