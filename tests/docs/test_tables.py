"""benchmarks/tables.py: every table that it makes is for a section of benchmarks/measured, and every script runs to its end."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MEASURED = sorted((ROOT / "benchmarks/measured").glob("*.md"))


def tables():
    """benchmarks/tables.py as a module."""
    spec = importlib.util.spec_from_file_location("tables", ROOT / "benchmarks/tables.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["tables"] = module
    spec.loader.exec_module(module)
    return module


TABLES = tables().TABLES


@pytest.mark.parametrize("name", TABLES)
def test_every_table_is_for_a_section_that_names_its_script(name):
    pages, table = "\n".join(path.read_text(encoding="utf-8") for path in MEASURED), TABLES[name]
    script = table.command.split()[0]
    section = re.search(rf"^#+ {re.escape(table.section)}\n(.*?)(?=^#+ |\Z)", pages, re.MULTILINE | re.DOTALL)
    assert section, f"no page has a section {table.section!r}"
    assert f"benchmarks/{script}" in section[1]


@pytest.mark.parametrize("name", TABLES)
def test_scripts_take_the_options_of_both_runs(name):
    script, *options = f"{TABLES[name].command} {TABLES[name].tiny}".split()
    source = (ROOT / "benchmarks" / script).read_text(encoding="utf-8")
    assert all(f'"{word}"' in source for word in options if word.startswith("--"))


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLES)
def test_a_tiny_run_comes_to_its_end(name):
    words = [sys.executable, str(ROOT / "benchmarks" / TABLES[name].command.split()[0]), *TABLES[name].tiny.split()]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
    assert re.search(r"\d", done.stdout), "it printed nothing that was measured"
