#!/usr/bin/env python3
"""Build the extension: one zip per platform, with the wheels for every Python that Blender 4.5 to 5.2 carries.

    python tools/build_extension.py                          every platform, into dist/
    python tools/build_extension.py --platform linux-x64     only that one; may be repeated

Wheels come from PyPI through pip, which refuses any file whose SHA-256 is not in wheels.txt, and the kernels' are built by
build_kernels.py, whose checksums are in kernels.sha256; they stay in dist/wheels for the next run, which then needs no network.
Blender's own tool (in the bpy module of this Python) builds and validates the zips. The same
source gives the same bytes.
"""

import argparse
import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

# Also where this file is loaded by its path.
sys.path.insert(0, str(Path(__file__).resolve().parent))

from build_kernels import KernelError, pinned_wheel, sha256

ROOT = Path(__file__).resolve().parents[1]
WHEELS = ROOT / "tools/wheels.txt"
MANIFEST = "blender_manifest.toml"

# Blender 4.5 and 5.0; 5.1 and 5.2; 5.2 as Debian builds it.
PYTHONS = ("3.11", "3.13", "3.14")
# Blender's name of a platform and the wheel tags that its systems may load. Those without have no Embree: bakes go through
# Blender's own BVH there.
PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_13_0_arm64", "macosx_12_0_arm64", "macosx_11_0_arm64"),
    "macos-x64": ("macosx_13_0_x86_64", "macosx_12_0_x86_64", "macosx_11_0_x86_64", "macosx_10_15_x86_64"),
    "windows-arm64": (),
    "linux-arm64": (),
}
# Zip files know no earlier moment.
MOMENT = (1980, 1, 1, 0, 0, 0)


class BuildError(Exception):
    """What went wrong and what to do, as one line."""


def add_on_files() -> list[str]:
    """Every file of the add-on, relative to the repository, sorted: the package with its shaders and engine templates."""
    package = [path.relative_to(ROOT) for path in (ROOT / "rtgi_addon").rglob("*") if path.is_file()]
    hidden = [path for path in package if any(part.startswith(".") or part == "__pycache__" for part in path.parts)]
    return sorted([path.as_posix() for path in {*package} - {*hidden}] + ["__init__.py", "LICENSE"])


def blender_tool() -> Path:
    """Blender's extension tool inside the bpy module. Raises BuildError."""
    found = importlib.util.find_spec("bpy")
    folders = list(found.submodule_search_locations or ()) if found else []
    tools = [path for folder in folders for path in Path(folder).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")]
    if not tools:
        raise BuildError(f"{sys.executable} has no bpy module, which holds Blender's extension tool: run `make extension`")
    return tools[0]


def pinned_hashes() -> set[str]:
    """The SHA-256 of every wheel in wheels.txt."""
    return set(re.findall(r"--hash=sha256:([0-9a-f]{64})", WHEELS.read_text()))


def fetch_wheels(platform: str, folder: Path) -> list[Path]:
    """The wheels of ``platform`` for every Python in ``folder``, downloaded where they are not there yet. Raises BuildError."""
    folder.mkdir(parents=True, exist_ok=True)
    tags, pinned, wheels = PLATFORMS[platform], pinned_hashes(), []
    for python in PYTHONS if tags else ():
        abi = "cp" + python.replace(".", "")
        present = [path for path in sorted(folder.glob(f"*-{abi}-{abi}-*.whl"))
                   if any(tag in path.name for tag in tags) and sha256(path) in pinned]
        wheels += present or [download(platform, python, folder)]
    return wheels


def download(platform: str, python: str, folder: Path) -> Path:
    """One wheel by pip, which checks it against wheels.txt. Raises BuildError with pip's own reason."""
    print(f"downloading the wheel of {platform} for Python {python}", flush=True)
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        options = [option for tag in PLATFORMS[platform] for option in ("--platform", tag)]
        ran = subprocess.run([
            sys.executable, "-m", "pip", "download", "--disable-pip-version-check", "--no-deps", "--only-binary=:all:",
            "--implementation", "cp", "--python-version", python, *options, "--dest", temporary, "--require-hashes",
            "--requirement", str(WHEELS),
        ], capture_output=True, text=True, check=False)
        if ran.returncode:
            said = [line.strip() for line in (ran.stdout + ran.stderr).splitlines()]
            wheel = f"the wheel of {platform} for Python {python}"
            if any("DO NOT MATCH" in line for line in said):
                raise BuildError(f"{wheel} is not the one that tools/wheels.txt pins: find out why the package index has another")
            # Without network pip's last words are that it found no version; why stands in a warning before.
            reasons = [line for line in said if "connection" in line.lower()] or [line for line in said if line.startswith("ERROR")]
            raise BuildError(f"cannot download {wheel} ({(reasons or ['pip gave no reason'])[0][:300]}): connect to the network, "
                             f"or put the wheels of tools/wheels.txt into {folder}")
        found, = Path(temporary).iterdir()
        return found.replace(folder / found.name)


def stage(folder: Path, platforms: list[str], wheels: list[Path]) -> None:
    """Lay out in ``folder`` what Blender's tool packs: the add-on's files, the wheels, and a manifest that lists both."""
    (folder / "wheels").mkdir()
    for wheel in wheels:
        shutil.copyfile(wheel, folder / "wheels" / wheel.name)
    for name in add_on_files():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)

    def listed(key: str, values: list[str]) -> str:
        return f"{key} = [\n" + "".join(f'    "{value}",\n' for value in values) + "]\n"

    head, tables = re.split(r"^(?=\[)", (ROOT / MANIFEST).read_text(), maxsplit=1, flags=re.MULTILINE)
    carried = listed("platforms", platforms)
    if wheels:
        carried += listed("wheels", [f"./wheels/{name}" for name in sorted(wheel.name for wheel in wheels)])
    (folder / MANIFEST).write_text(f"{head}{carried}\n{tables}")


def run_tool(*arguments) -> str:
    """Run Blender's extension tool; what it printed. Raises BuildError with that."""
    ran = subprocess.run([sys.executable, str(blender_tool()), *map(str, arguments)], capture_output=True, text=True, check=False)
    printed = (ran.stdout + ran.stderr).strip()
    if ran.returncode:
        raise BuildError(f"Blender's extension tool failed at `{arguments[0]}`: {printed}")
    return printed


def repack(path: Path, target: Path) -> None:
    """Copy a zip with its entries in the order of their names and without times and modes, which depend on the machine."""
    with zipfile.ZipFile(path) as made, zipfile.ZipFile(target, "w") as archive:
        for entry in sorted(made.infolist(), key=lambda entry: entry.filename):
            info = zipfile.ZipInfo(entry.filename, MOMENT)
            info.compress_type, info.external_attr, info.create_system = entry.compress_type, 0o644 << 16, 3
            archive.writestr(info, made.read(entry), compresslevel=9)


def wheels_in(path: Path) -> int:
    """How many wheels a zip carries."""
    with zipfile.ZipFile(path) as archive:
        return sum(name.endswith(".whl") for name in archive.namelist())


def build(platforms: list[str], output: Path, kept: Path) -> list[Path]:
    """The zips of ``platforms`` in ``output``, built and validated; wheels are kept in ``kept``. Raises BuildError."""
    wheels = [wheel for platform in platforms for wheel in [*fetch_wheels(platform, kept), pinned_wheel(platform, kept)]]
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        source, made, packed = (Path(temporary) / name for name in ("source", "made", "packed"))
        for folder in (source, made, packed):
            folder.mkdir()
        stage(source, platforms, wheels)
        run_tool("validate", source)
        run_tool("build", "--source-dir", source, "--output-dir", made, "--split-platforms")
        zips = []
        for platform in platforms:
            path, = made.glob(f"*-{platform.replace('-', '_')}.zip")
            # Those of Embree, and the kernels'.
            if wheels_in(path) != (len(PYTHONS) if PLATFORMS[platform] else 0) + 1:
                raise BuildError(f"{path.name} carries {wheels_in(path)} wheels: Blender's tool does not know a tag of theirs")
            zips.append(packed / path.name)
            repack(path, zips[-1])
            run_tool("validate", zips[-1])
        return [Path(shutil.move(path, output / path.name)) for path in zips]


def main() -> int:
    """Read the command line, build, and say what was made."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", action="append", choices=list(PLATFORMS), help="only this platform; may be repeated")
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="where the zips go (dist)")
    parser.add_argument("--wheels", type=Path, default=ROOT / "dist/wheels", help="where wheels are kept (dist/wheels)")
    arguments = parser.parse_args()
    try:
        zips = build(arguments.platform or list(PLATFORMS), arguments.output.resolve(), arguments.wheels.resolve())
    except (BuildError, KernelError, OSError) as error:
        print(f"build_extension: {error}", file=sys.stderr)
        return 1
    for path in zips:
        print(f"{path.stat().st_size / 1e6:6.1f} MB  {sha256(path)}  {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
