"""Writes the styles that come with the product as Blender's presets, from `effects/stylized/presets.py`.

    python tools/style_presets.py            # needs the bpy module
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "rtgi_addon" / "blender" / "presets" / "rtgi_style"


def files() -> dict[str, str]:
    """The text of each preset by its file's name."""
    from rtgi_addon.blender.styles import STYLES, style_file
    from rtgi_addon.effects import get
    defaults = get("stylized").Settings()
    titles = {name: name.replace("_", " ").capitalize() for name in STYLES}
    return {f"{titles[name]}.py": style_file(titles[name], settings, defaults) for name, settings in STYLES.items()}


def main() -> int:
    """Write them all."""
    sys.path.insert(0, str(ROOT))
    PLACE.mkdir(parents=True, exist_ok=True)
    for name, text in files().items():
        (PLACE / name).write_text(text, encoding="utf-8")
        print(PLACE / name)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
