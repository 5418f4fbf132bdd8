"""Draw the pictures of README.md and docs/ again.

    python tools/readme_pictures.py                        what a shell can draw: the demo, the atrium's probes, the chart
    python tools/readme_pictures.py --screenshots FOLDER   what the tests kept in a real Blender and a real Godot

Tests keep their pictures where RTGI_SCREENSHOTS says: `RTGI_SCREENSHOTS=FOLDER .ci/run`. Needs Pillow, which matplotlib brings.
Look at every picture before you commit it.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs/images"
# JPEG's quality for photographs of a room; screens of text stay PNG.
QUALITY = 88


def rtgi(sample: str, *words) -> None:
    """Run a subcommand of the command line on a sample scene."""
    subprocess.run([sys.executable, "-m", "rtgi_addon", ROOT / f"sample_blends/{sample}.blend", *map(str, words)], check=True,
                   cwd=ROOT)


def from_shell(folder: Path) -> list[Path]:
    """The pictures that a shell can draw, with work files in ``folder``."""
    rtgi("cornell_box", "bake", "--out", folder / "cornell_box", "--picture", IMAGES / "demo_probes.png")
    rtgi("atrium", "bake", "--out", folder / "atrium", "--picture", folder / "atrium.png")
    rtgi("cornell_box", "chart", "--out", folder / "chart")
    rtgi("toon_street", "bake", "--out", folder / "street", "--error", 0.03)
    return [*styles(folder), IMAGES / "demo_probes.png", _jpeg(Image.open(folder / "atrium.png"), "atrium_probes"),
            _copy(folder / "chart/chart.png", "chart")]


def styles(folder: Path) -> list[Path]:
    """toon_street as it is lit and in every style, by the bundle in ``folder / "street"``."""
    drawn = []
    for name in ("", "cel", "ink_and_wash", "blueprint", "painted_background"):
        path = folder / f"street_{name or 'lit'}.png"
        rtgi("toon_street", "render", "--bundle", folder / "street", "--samples", 16, "--out", path,
             "--scale", 1.0 if name == "cel" else 0.5, *(("--style", name) if name else ()))
        drawn.append(Image.open(path).convert("RGB"))
    width, height = drawn[0].size
    sheet = Image.new("RGB", (2 * width, 2 * height))
    for place, picture in enumerate((drawn[0], *drawn[2:])):
        sheet.paste(picture, (place % 2 * width, place // 2 * height))
    return [_jpeg(drawn[1], "style_cel"), _jpeg(sheet, "styles")]


def from_screenshots(folder: Path) -> list[Path]:
    """The pictures that tests/blender/test_window.py and test_preview_window.py, and tests/engines/test_godot.py and
    test_threejs_pages.py, kept in ``folder``."""
    drawn = [_copy(folder / f"{kept}.png", name) for kept, name in (("panel", "panel"), ("baked", "baked"), ("volume", "overrides"))
             if (folder / f"{kept}.png").exists()]
    viewport = folder / "preview lamp moved.png"
    if viewport.exists():
        drawn.append(_jpeg(Image.open(viewport), "preview"))
    pair, ball = folder / "godot beside our own.png", folder / "godot with its ball.png"
    if pair.exists() and ball.exists():
        both, left = Image.open(pair), Image.open(ball)
        both.paste(left, (0, 0))
        drawn.append(_jpeg(both.resize((2 * both.width, 2 * both.height), Image.Resampling.LANCZOS), "godot"))
    three = folder / "cornell_box in three beside our own.png"
    if three.exists():
        drawn.append(_jpeg(Image.open(three), "threejs"))
    return drawn


def _jpeg(picture: Image.Image, name: str) -> Path:
    path = IMAGES / f"{name}.jpg"
    picture.convert("RGB").save(path, quality=QUALITY, optimize=True)
    return path


def _copy(source: Path, name: str) -> Path:
    path = IMAGES / f"{name}.png"
    Image.open(source).convert("RGB").save(path, optimize=True)
    return path


def main(argv: list[str]) -> int:
    """The exit code: 1 if there was nothing to draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--screenshots", type=Path, metavar="FOLDER")
    options = parser.parse_args(argv)
    if options.screenshots is not None:
        drawn = from_screenshots(options.screenshots)
    else:
        with tempfile.TemporaryDirectory() as folder:
            drawn = from_shell(Path(folder))
    for path in drawn:
        print(path.relative_to(ROOT))
    if not drawn:
        print(f"{options.screenshots} holds none of the pictures", file=sys.stderr)
    return int(not drawn)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
