"""Every document that the code names is there, and so is the section it names: `docs/physics.md §1`, `docs/panel.md#presets`."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("rtgi_addon", "tests", "tools", "benchmarks", "sample_blends")
KINDS = {".py", ".glsl", ".js", ".mjs", ".ts", ".html", ".gd", ".gdshader", ".gdshaderinc", ".in", ".sh", ".toml"}
# A path, and the section after it. Names in a code's own placeholders (`{name}.md`, `*.md`) are none.
NAMED = re.compile(r"(?<![\w{}*/.-])((?:[\w.-]+/)*[\w-]+\.md)\b(?:#([\w-]+)|,? (?:§|[Ss]ection )\s?(\d+(?:\.\d+)*))?")
# What commands write: into exports, charts and reports of the suite.
WRITTEN = {"README.md", "chart.md", "stability.md"}
DOCUMENTS = [path for path in ROOT.rglob("*.md") if not {"node_modules", ".venv"} & set(path.parts)]


def named(text):
    """(document, anchor or None, number of a section or None) of everything that ``text`` names."""
    return [match.groups() for match in NAMED.finditer(text)]


def headings(path):
    """(number or "", anchor) of a document's headings."""
    for heading in re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE):
        number = re.match(r"(\d+(?:\.\d+)*)\.? ", heading)
        yield number[1] if number else "", re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def fault(document, anchor, number):
    """What is wrong with naming a section of a document; None if nothing is. The end of a path names a document as well."""
    path = next((path for path in DOCUMENTS if f"/{path.relative_to(ROOT).as_posix()}".endswith(f"/{document}")), None)
    if path is None:
        written = Path(document).name in WRITTEN and not document.startswith("docs/")
        return None if written and not (anchor or number) else f"{document} is not in the repository"
    if number and number not in {known for known, _ in headings(path)}:
        return f"{document} has no section {number}"
    if anchor and anchor not in {known for _, known in headings(path)}:
        return f"{document} has no heading {anchor}"
    return None


def sources():
    """Every file of code."""
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in KINDS and path.is_file()]
    return [path for path in [*files, ROOT / "Makefile"] if not {"node_modules", "__pycache__"} & set(path.parts)
            and path != Path(__file__)]


def test_documents_that_the_code_names_are_there():
    wrong, seen = [], 0
    for path in sources():
        for entry in named(path.read_text(encoding="utf-8", errors="ignore")):
            seen += 1
            found = fault(*entry)
            wrong += [f"{path.relative_to(ROOT)}: {found}"] if found else []
    assert seen > 40 and not wrong, "\n".join(wrong)


def test_nothing_is_named_without_its_place():
    """Documents are named by their path, so that a reader finds them and the test above sees them."""
    bare = [f"{path.relative_to(ROOT)}: {line.strip()}" for path in sources()
            for line in path.read_text(encoding="utf-8", errors="ignore").splitlines()
            if re.search(r"\b(PHYSICS|FORMATS|SYSTEMS|ARCHITECTURE)\b", line)]
    assert not bare, "\n".join(bare)


@pytest.mark.parametrize(("text", "wrong"), [
    ("as in docs/physics.md §1", None), ("(docs/panel.md#presets)", None), ("README.md says", None),
    ("as in docs/physics.md §99", "no section 99"), ("see docs/nothing.md", "not in the repository"),
    ("see NOTHING.md, section 2", "not in the repository"), ("docs/panel.md#nowhere", "no heading nowhere"),
    ("docs/physics.md section 98", "no section 98"), ("docs/shell.md §1", "no section 1"),
])
def test_a_wrong_name_is_found(text, wrong):
    ((document, anchor, number),) = named(text)
    found = fault(document, anchor, number)
    assert (found is None) == (wrong is None) and (wrong is None or wrong in found)


def test_places_in_names_are_no_names():
    assert named('f"{name}.md" *.md docs/techniques/{name}.md') == []
