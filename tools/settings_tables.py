"""Writes the table of settings into the page of every technique in docs/techniques, from its Settings: the panel's own words.

    python tools/settings_tables.py

A test holds the pages to it.
"""

import sys
from dataclasses import fields
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = ROOT / "docs/techniques"
BEGIN, END = "<!-- settings: written by tools/settings_tables.py -->\n", "<!-- end of settings -->"


def table(technique) -> str:
    """The settings of a technique as a Markdown table."""
    rows = ["| `--set` | in the panel | default | range | what it does |", "|---|---|---:|---|---|"]
    for item in fields(technique.Settings):
        meta = item.metadata
        rows.append(f"| `{item.name}` | {meta['label']} | {_value(item.default)} | {_range(meta)} | {meta['description']} |")
    return "\n".join(rows) + "\n"


def page(technique) -> Path:
    """Where a technique's page is."""
    return PAGES / f"{technique.name}.md"


def with_table(text: str, technique) -> str:
    """A page's ``text`` with the table of today's settings between its marks. Raises ValueError without them."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + table(technique) + END + rest.split(END)[1]


def _value(value) -> str:
    if value is None:
        return "unset"
    return str(value).lower() if isinstance(value, bool) else f"{value:,}" if isinstance(value, int) else str(value)


def _range(meta) -> str:
    if meta["choices"]:
        return ", ".join(f"`{choice}`" for choice in meta["choices"])
    low, high, unit = meta["minimum"], meta["maximum"], meta["unit"]
    bounds = "" if low is None or high is None else f"{_bound(low)} to {_bound(high)}"
    return f"{bounds} {unit}".strip()


def _bound(number) -> str:
    return f"{number:,.6f}".rstrip("0").rstrip(".")


def main() -> None:
    """Rewrite every page."""
    sys.path.insert(0, str(ROOT))
    from rtgi_addon.techniques import registry
    for technique in registry().values():
        path = page(technique)
        path.write_text(with_table(path.read_text(encoding="utf-8"), technique), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
