"""Writes the table of settings into the page of every technique and effect in docs, from its Settings: the panel's own words.

    python tools/settings_tables.py

A test holds the pages to it.
"""

import sys
from dataclasses import fields
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = ROOT / "docs"
BEGIN, END = "<!-- settings: written by tools/settings_tables.py -->\n", "<!-- end of settings -->"


def table(owner) -> str:
    """The settings of a technique or an effect as a Markdown table."""
    before = f"{owner.name}." if _is_effect(owner) else ""
    rows = ["| `--set` | in the panel | default | range | what it does |", "|---|---|---:|---|---|"]
    for item in fields(owner.Settings):
        meta = item.metadata
        cells = f"`{before}{item.name}`", meta["label"], _value(item.default), _range(meta), meta["description"]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def page(owner) -> Path:
    """Where the page of a technique or an effect is."""
    return PAGES / ("effects" if _is_effect(owner) else "techniques") / f"{owner.name}.md"


def _is_effect(owner) -> bool:
    return hasattr(owner, "stage")


def with_table(text: str, owner) -> str:
    """A page's ``text`` with the table of today's settings between its marks. Raises ValueError without them."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + table(owner) + END + rest.split(END)[1]


def _value(value) -> str:
    if value is None:
        return "unset"
    if isinstance(value, tuple):
        return ",".join(map(str, value))
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
    from rtgi_addon import effects, techniques
    for owner in (*techniques.registry().values(), *effects.registry().values()):
        path = page(owner)
        path.write_text(with_table(path.read_text(encoding="utf-8"), owner), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
