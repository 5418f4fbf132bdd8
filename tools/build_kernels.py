#!/usr/bin/env python3
"""Build the compiled kernels, rtgi_addon/kernels/src, as wheels that carry one library each.

    python tools/build_kernels.py --install                  this machine's, into this Python (`make setup` does it)
    python tools/build_kernels.py --platform linux-arm64     wheels into dist/wheels; may be repeated, without it all six
    python tools/build_kernels.py --pin                      all six, and their checksums into tools/kernels.sha256
    python tools/build_kernels.py --checked PATH             this machine's with every index checked and sanitizers, for CI

The compiler is Zig's, from PyPI through pip, which refuses any file whose SHA-256 is not in kernels.txt; it stays beside this
Python for the next run. It needs nothing else for any of the platforms, and the same sources give the same bytes on each.
"""

import argparse
import base64
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "rtgi_addon/kernels/src"
COMPILER, PINS = ROOT / "tools/kernels.txt", ROOT / "tools/kernels.sha256"
PACKAGE = "rtgi_kernels"
# What the compiler is told everywhere: no product and sum at once, so that both variants give the same bits. Nothing of the machine
# that compiles goes in: no debug information, and no path.
OPTIONS = ("-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-sanitize=all", "-fvisibility=hidden", "-g0",
           "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror")
# Variants by what processor they take; the second is chosen where it can run.
_X86 = (("base", "x86_64"), ("avx2", "x86_64_v3"))
_ARM = (("base", "baseline"),)
# Blender's name of a platform: Zig's, the tag of its wheel, the end of the library's name, variants.
PLATFORMS = {
    "linux-x64": ("x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64", "so", _X86),
    "windows-x64": ("x86_64-windows-gnu", "win_amd64", "dll", _X86),
    "macos-arm64": ("aarch64-macos.12.0-none", "macosx_12_0_arm64", "dylib", _ARM),
    "macos-x64": ("x86_64-macos.12.0-none", "macosx_12_0_x86_64", "dylib", _X86),
    "windows-arm64": ("aarch64-windows-gnu", "win_arm64", "dll", _ARM),
    "linux-arm64": ("aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64", "so", _ARM),
}
# What linking takes beside that, by how the library's name ends: mathematics.
_LINKED = {"so": ("-lm",), "dylib": ("-Wl,-install_name,rtgi_kernels.dylib",)}
# Zip files know no earlier moment.
MOMENT = (1980, 1, 1, 0, 0, 0)


class KernelError(Exception):
    """What went wrong and what to do, as one line."""


def host() -> str:
    """Blender's name of this machine's platform. Raises KernelError where it has none."""
    system = {"linux": "linux", "win32": "windows", "darwin": "macos"}.get(sys.platform)
    machine = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "aarch64": "arm64"}.get(platform.machine().lower())
    if not system or not machine:
        raise KernelError(f"there are no kernels for {sys.platform} on {platform.machine()}: numpy does their work")
    return f"{system}-{machine}"


def sources_digest() -> str:
    """The SHA-256 of all that decides what is built."""
    digest = hashlib.sha256(repr((OPTIONS, PLATFORMS, _LINKED)).encode())
    for path in [*sorted(SOURCES.glob("*.[ch]")), COMPILER]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def version() -> str:
    """The version of the wheel: that of the functions' arguments, which Python checks."""
    return re.search(r"^#define VERSION (\d+)$", (SOURCES / "library.c").read_text(), re.MULTILINE)[1] + ".0"


def wheel_name(target: str) -> str:
    """The file name of the wheel of a platform."""
    return f"{PACKAGE}-{version()}-py3-none-{PLATFORMS[target][1]}.whl"


def pins() -> dict[str, str]:
    """The SHA-256 of each wheel by its name, and under "sources" of what they are built from."""
    if not PINS.exists():
        return {}
    return {name: digest for digest, name in (line.split() for line in PINS.read_text().splitlines() if line[:1] not in ("", "#"))}


def sha256(path: Path) -> str:
    """The checksum of a file, in hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def compiler() -> Path:
    """A folder with the package of Zig, installed where it is not there yet. Raises KernelError."""
    folder = Path(sys.prefix) / "zig"
    wanted = re.search(r"^ziglang==(\S+)", COMPILER.read_text(), re.MULTILINE)[1]
    if (folder / f"ziglang-{wanted}.dist-info").is_dir():
        return folder
    print("downloading the compiler of the kernels (80 MB)", flush=True)
    partial = folder.with_name("zig.part")
    shutil.rmtree(partial, ignore_errors=True)
    ran = subprocess.run([sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--no-deps",
                          "--quiet", "--only-binary=:all:", "--retries", "1", "--require-hashes", "--target", str(partial),
                          "--requirement", str(COMPILER)], capture_output=True, text=True, check=False)
    if ran.returncode:
        said = [line for line in (ran.stdout + ran.stderr).splitlines() if line.startswith("ERROR")] or ["pip gave no reason"]
        raise KernelError(f"cannot download the compiler of the kernels ({said[0][:200]}): connect to the network")
    shutil.rmtree(folder, ignore_errors=True)
    partial.replace(folder)
    return folder


def run_compiler(folder: Path, cache: Path, *arguments: str, where: Path = SOURCES) -> None:
    """Run Zig's C compiler among the sources, or ``where``. Raises KernelError with its first words."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "ZIG_GLOBAL_CACHE_DIR": str(cache), "ZIG_LOCAL_CACHE_DIR": str(cache)}
    ran = subprocess.run([sys.executable, "-m", "ziglang", "cc", *arguments], cwd=where, env=environment, capture_output=True,
                         text=True, check=False)
    if ran.returncode:
        said = (ran.stderr or ran.stdout).strip().splitlines() or ["it gave no reason"]
        raise KernelError(f"the compiler of the kernels failed: {said[0][:300]}")


def library(target: str, output: Path) -> None:
    """Compile and link the library of a platform into ``output``. Raises KernelError."""
    zig, _, ending, variants = PLATFORMS[target]
    folder, cache = compiler(), Path(sys.prefix) / "zig-cache"
    place = () if ending == "dll" else ("-fPIC",)
    with tempfile.TemporaryDirectory() as temporary:
        objects = [str(Path(temporary) / name) for name in ("library.o", *(f"{name}.o" for name, _ in variants))]
        common = ("-target", zig, *OPTIONS, *place, "-c")
        run_compiler(folder, cache, *common, f"-mcpu={variants[0][1]}", "library.c", "-o", objects[0])
        for (name, processor), made in zip(variants, objects[1:], strict=True):
            run_compiler(folder, cache, *common, f"-mcpu={processor}", f"-DRTGI_VARIANT={name}", "all.c", "-o", made)
        linked = Path(temporary) / output.name
        # By bare names from where they lie: a path would be written into the library.
        run_compiler(folder, cache, "-target", zig, "-shared", "-s", *_LINKED.get(ending, ()), "-o", linked.name,
                     *(Path(name).name for name in objects), where=Path(temporary))
        output.write_bytes(timeless(linked.read_bytes()) if ending == "dll" else linked.read_bytes())


def timeless(content: bytes) -> bytes:
    """A Windows library without the moment at which it was linked, which the linker cannot be kept from writing into its header."""
    header = int.from_bytes(content[0x3C:0x40], "little")
    if content[header:header + 4] != b"PE\0\0":
        raise KernelError("the linker made no Windows library")
    return content[:header + 8] + bytes(4) + content[header + 12:]


def checked_library(output: Path) -> None:
    """This machine's library by its own C compiler, with indices checked and the address and undefined behaviour sanitizers. Raises
    KernelError."""
    command = ["cc", *(option for option in OPTIONS if option not in ("-fno-sanitize=all", "-g0", "-O3")), "-O1", "-g",
               "-Wno-type-limits", "-DRTGI_CHECKED", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fPIC",
               "-shared", "-o", str(output),
               "all.c", "library.c", "-lm"]
    try:
        ran = subprocess.run(command, cwd=SOURCES, capture_output=True, text=True, check=False)
    except OSError as error:
        raise KernelError(f"a debug build takes a C compiler: {error}") from None
    if ran.returncode:
        raise KernelError(f"the debug build failed: {(ran.stderr.strip().splitlines() or [''])[0][:300]}")


def wheel(target: str, folder: Path) -> Path:
    """The wheel of a platform in ``folder``, built unless the one there is the pinned one. Raises KernelError."""
    path, known = folder / wheel_name(target), pins()
    current = known.get("sources") == sources_digest()
    if current and path.exists() and sha256(path) == known.get(path.name):
        return path
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        built = Path(temporary) / f"{PACKAGE}.{PLATFORMS[target][2]}"
        library(target, built)
        pack(target, built.read_bytes(), built.name, path)
    return path


def pack(target: str, content: bytes, name: str, path: Path) -> None:
    """Write a wheel with a library of that ``name`` and ``content``: stored, so that no version of zlib shows."""
    info, tag = f"{PACKAGE}-{version()}.dist-info", f"py3-none-{PLATFORMS[target][1]}"
    files = {
        f"{PACKAGE}/__init__.py": b'"""The compiled kernels of RTGI; their sources are in rtgi_addon/kernels/src."""\n',
        f"{PACKAGE}/{name}": content,
        f"{info}/METADATA": (f"Metadata-Version: 2.1\nName: {PACKAGE}\nVersion: {version()}\n"
                             "Summary: The compiled kernels of RTGI\nLicense: GPL-3.0-or-later\n").encode(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: rtgi\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
    }

    def listed(file: str, data: bytes) -> str:
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        return f"{file},sha256={digest},{len(data)}\n"

    record = "".join(listed(file, data) for file, data in files.items())
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    partial = path.with_suffix(".part")
    with zipfile.ZipFile(partial, "w") as archive:
        for file, data in files.items():
            entry = zipfile.ZipInfo(file, MOMENT)
            entry.external_attr, entry.create_system = 0o644 << 16, 3
            archive.writestr(entry, data)
    partial.replace(path)


def pinned_wheel(target: str, folder: Path) -> Path:
    """As ``wheel``, whose bytes must be the pinned ones. Raises KernelError."""
    path, known = wheel(target, folder), pins()
    if known.get("sources") != sources_digest():
        raise KernelError("the kernels' sources are newer than tools/kernels.sha256: run `python tools/build_kernels.py --pin`")
    if sha256(path) != known.get(path.name):
        raise KernelError(f"{path.name} is not the one that tools/kernels.sha256 pins: find out why the compiler made another")
    return path


def pin(folder: Path) -> None:
    """Build every wheel and write down their checksums. Raises KernelError."""
    lines = ["# What the extension carries of the kernels; `python tools/build_kernels.py --pin` writes this anew.",
             f"{sources_digest()}  sources"]
    for target in PLATFORMS:
        (folder / wheel_name(target)).unlink(missing_ok=True)
        path = wheel(target, folder)
        lines.append(f"{sha256(path)}  {path.name}")
        print(lines[-1], flush=True)
    PINS.write_text("\n".join(lines) + "\n")


def install(folder: Path) -> None:
    """Build this machine's wheel and install it into this Python. Raises KernelError."""
    path = wheel(host(), folder)
    ran = subprocess.run([sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--no-deps",
                          "--no-index", "--quiet", "--force-reinstall", str(path)], capture_output=True, text=True, check=False)
    if ran.returncode:
        raise KernelError(f"pip cannot install {path.name}: {(ran.stderr.strip().splitlines() or [''])[-1][:300]}")
    print(f"the kernels of {host()} are installed")


def main() -> int:
    """Read the command line, build, and say what was made."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", action="append", choices=list(PLATFORMS), help="only this platform; may be repeated")
    parser.add_argument("--wheels", type=Path, default=ROOT / "dist/wheels", help="where wheels are kept (dist/wheels)")
    parser.add_argument("--install", action="store_true", help="this machine's, into this Python")
    parser.add_argument("--pin", action="store_true", help="write the checksums of all six anew")
    parser.add_argument("--checked", type=Path, metavar="PATH", help="a debug build of this machine's library")
    arguments = parser.parse_args()
    folder = arguments.wheels.resolve()
    try:
        if arguments.checked:
            checked_library(arguments.checked.resolve())
        elif arguments.pin:
            pin(folder)
        elif arguments.install:
            install(folder)
        else:
            for target in arguments.platform or list(PLATFORMS):
                path = wheel(target, folder)
                print(f"{path.stat().st_size / 1e3:6.0f} kB  {sha256(path)}  {path}")
    except (KernelError, OSError) as error:
        print(f"build_kernels: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
