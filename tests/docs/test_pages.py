"""The pages hold what the code says: settings, options, links, pictures, names of files."""

import argparse
import importlib.util
import re
from pathlib import Path

import pytest

from rtgi_addon import effects, techniques
from rtgi_addon.exchange import engines

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "benchmarks/README.md",
         *sorted((ROOT / "docs").rglob("*.md")), *sorted((ROOT / "benchmarks/measured").glob("*.md"))]
LINK = re.compile(r"(?<!`)!?\[[^\]]*\]\(([^)\s]+)\)")


def page_id(path):
    return path.relative_to(ROOT).as_posix()


def anchors(path):
    """The anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if target.startswith(("http://", "https://")):
            continue
        file, _, anchor = target.partition("#")
        path = (page.parent / file).resolve() if file else page
        assert path.exists(), f"{target} is not there"
        if anchor:
            assert anchor in anchors(path), f"{target}: no such heading"


def test_every_page_is_in_the_index():
    for folder, below in ((ROOT / "docs", "**/*.md"), (ROOT / "benchmarks", "measured/*.md")):
        index = (folder / "README.md").read_text(encoding="utf-8")
        for page in folder.glob(below):
            name = page.relative_to(folder).as_posix()
            assert name == "README.md" or f"({name})" in index, name


def test_every_picture_is_shown_somewhere():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for picture in (ROOT / "docs/images").iterdir():
        assert f"images/{picture.name})" in text, f"{picture.name} is on no page"


def tables():
    """tools/settings_tables.py as a module."""
    spec = importlib.util.spec_from_file_location("settings_tables", ROOT / "tools/settings_tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", techniques.names())
def test_the_page_of_a_technique_has_its_settings(name):
    technique, module = techniques.get(name), tables()
    text = module.page(technique).read_text(encoding="utf-8")
    assert module.with_table(text, technique) == text, "run python tools/settings_tables.py"
    for heading in ("## Formula", "## What it cannot do", "## When to use it", "## Settings"):
        assert f"\n{heading}\n" in text
    assert re.search(r"^Papers?: ", text, re.MULTILINE)


@pytest.mark.parametrize("name", effects.names())
def test_the_page_of_an_effect_has_its_settings(name):
    effect, module = effects.get(name), tables()
    text = module.page(effect).read_text(encoding="utf-8")
    assert module.with_table(text, effect) == text, "run python tools/settings_tables.py"
    for heading in ("## Formula", "## What it cannot do", "## When to use it", "## Settings"):
        assert f"\n{heading}\n" in text
    assert re.search(r"^(Source|Paper)s?: ", text, re.MULTILINE)
    assert f"effects/{name}.md" in (ROOT / "docs/panel.md").read_text(encoding="utf-8")


def test_the_table_of_presets_names_what_they_set():
    rows = {row.split("|")[1].strip(" `"): row for row in section(ROOT / "docs/panel.md", "## Presets").splitlines()
            if row.startswith("| `")}
    assert set(rows) == set(techniques.names())
    for name, row in rows.items():
        for cell, preset in zip(row.split("|")[2:], techniques.PRESETS, strict=False):
            for setting, value in techniques.get(name).presets[preset].items():
                shown = {"error": f"{100 * value:g} %", "visibility": "visibility" if value is True else "",
                         "max_rays": ""}.get(setting, f"{value:,}")
                assert shown in cell, f"{name}, {preset}: {setting}"


def section(page, heading):
    """The text below ``heading`` up to the next of its kind."""
    text = page.read_text(encoding="utf-8")
    assert f"\n{heading}" in text, heading
    return text.split(f"\n{heading}", 1)[1].split("\n## ", 1)[0]


def subcommands():
    """{name: its long options} of the command line."""
    from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser
    parser = build_parser("rtgi")
    choices = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction)).choices
    return {name: {option for action in choices[name]._actions for option in action.option_strings if option.startswith("--")}
            for name in SUBCOMMANDS}


@pytest.mark.parametrize("name", ["bake", "check", "verify", "plan", "render", "chart", "stability", "export", "info"])
def test_every_option_is_on_the_page_and_no_other(name):
    from rtgi_addon.blender.cli.parser import SUBCOMMANDS
    everywhere, of_files = (set(re.findall(r"--[a-z][a-z-]*", section(ROOT / "docs/shell.md", heading)))
                            for heading in ("## Options of every subcommand", "## What is read of a FILE"))
    common = everywhere | (of_files if SUBCOMMANDS[name].takes_scene else set())
    assert common <= subcommands()[name] and not (of_files & subcommands()[name] - common)
    shown = set(re.findall(r"--[a-z][a-z-]*", section(ROOT / "docs/shell.md", f"## `{name}")))
    options = subcommands()[name] - {"--help"} - common
    assert options <= shown, f"not on the page: {sorted(options - shown)}"
    assert shown <= options, f"not an option of {name}: {sorted(shown - options)}"


def test_every_subcommand_has_a_section():
    assert set(subcommands()) == set(re.findall(r"^## `(\w+)", (ROOT / "docs/shell.md").read_text(encoding="utf-8"), re.MULTILINE))


def test_every_technique_and_engine_is_named_where_one_looks_for_it():
    readme, page = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/engines.md"))
    for name in techniques.names():
        assert f"[`{name}`](docs/techniques/{name}.md)" in readme
    for name, engine in engines.registry().items():
        assert f"--engine {name}" in page and f"`{name}`" in page and engine.title in readme and engine.title in page


def test_the_changelog_has_this_version():
    import tomllib
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    assert f"## {version}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_licence_is_whole():
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "GNU GENERAL PUBLIC LICENSE" in text and "Version 3, 29 June 2007" in text and "END OF TERMS AND CONDITIONS" in text
