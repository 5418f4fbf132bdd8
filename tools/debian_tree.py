#!/usr/bin/env python3
"""Make a Debian tree that holds a real Blender and a real Godot, and run commands in it.

    sudo python tools/debian_tree.py create DIR            about 2 GB and a few minutes; again: only what is missing
    sudo python tools/debian_tree.py run DIR -- blender -b sample_blends/cornell_box.blend --command rtgi bake --out OUT

The bpy module has no window, no `--command` and another Python than Blender's own, so the window tests, the extension's
installation and the engines' test scripts need the real programs. Debian sid ships both; the tree is made with debootstrap
from the mirror that this machine's apt already uses, and touches nothing outside DIR.

`run` enters the tree in a mount namespace of its own: /proc, /sys, /dev, this repository and every `--bind` path appear in
it under the same names and are gone when the command ends. The working directory is kept if it is one of them.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from build_kernels import KernelError, host, wheel

REPOSITORY = Path(__file__).resolve().parents[1]
SUITE = "sid"
PACKAGES = (
    "blender", "godot", "libgl1-mesa-dri", "libegl1", "mesa-vulkan-drivers", "xvfb", "xauth", "python3-numpy", "python3-cattr",
    "python3-requests", "imagemagick", "xdotool", "fonts-dejavu-core",
)
# apt drops to a user of its own, which cannot work where the tree lies below a private folder; a caching mirror may hold an
# index of sid that is past its date, which its signature covers all the same.
APT_CONFIGURATION = """\
APT::Sandbox::User "root";
Acquire::Check-Valid-Until "false";
DPkg::Options {"--force-unsafe-io";};
"""
# numpy is Debian's own (the one its Blender was built for), so wheels are installed without what they depend on.
WHEELS = ("embreex", "pytest", "iniconfig", "pluggy", "packaging", "pygments")
WHEEL_PLATFORMS = ("manylinux_2_17_x86_64", "manylinux2014_x86_64", "manylinux_2_28_x86_64", "manylinux_2_34_x86_64")


def apt_mirror(etc: Path = Path("/etc/apt")) -> str:
    """The first Debian archive in this machine's apt sources, else Debian's own address."""
    sources = [etc / "sources.list", *sorted((etc / "sources.list.d").glob("*"))]
    for source in sources:
        if source.suffix not in (".list", ".sources") or not source.is_file():
            continue
        for line in source.read_text().splitlines():
            match = re.match(r"\s*(?:deb\s+(?:\[[^]]*\]\s*)?|URIs:\s*)(\S+)", line)
            if match and re.search(r"/debian/?$", match[1]):
                return match[1].rstrip("/")
    return "http://deb.debian.org/debian"


def create(tree: Path, extra_packages: list[str], extra_wheels: list[str]) -> None:
    """Bring ``tree`` to a Debian with Blender, Godot and the Python packages the add-on needs; finished parts are kept."""
    if not (tree / "etc/debian_version").exists() or (tree / "debootstrap").exists():
        if shutil.which("debootstrap") is None:
            sys.exit("debootstrap is missing: apt-get install debootstrap")
        if (tree / "debootstrap").exists():
            sys.exit(f"{tree} holds a tree that was interrupted half way: remove it and start again")
        check_run(["debootstrap", "--variant=minbase", SUITE, str(tree), apt_mirror()])
    (tree / "etc/mtab").unlink(missing_ok=True)
    (tree / "etc/mtab").symlink_to("/proc/mounts")
    (tree / "etc/apt/apt.conf.d/90rtgi").write_text(APT_CONFIGURATION)
    if Path("/etc/resolv.conf").exists():
        shutil.copyfile("/etc/resolv.conf", tree / "etc/resolv.conf")

    wanted = [*PACKAGES, *extra_packages]
    missing = [name for name in wanted if not installed(tree, name)]
    if missing:
        environment = {"DEBIAN_FRONTEND": "noninteractive"}
        check_run(command_in(tree, ["apt-get", "update"], environment=environment))
        check_run(command_in(tree, ["apt-get", "install", "-y", "--no-install-recommends", *missing], environment=environment))
        check_run(command_in(tree, ["apt-get", "clean"], environment=environment))
    install_wheels(tree, [*WHEELS, *extra_wheels])
    install_kernels(tree)


def installed(tree: Path, package: str) -> bool:
    """True if dpkg in ``tree`` has ``package`` installed."""
    status = subprocess.run(["chroot", str(tree), "dpkg-query", "-W", "-f", "${db:Status-Status}", package],
                            capture_output=True, text=True, check=False)
    return status.stdout.strip() == "installed"


def python_packages(tree: Path) -> tuple[str, Path]:
    """The version of the tree's Python, and where its Blender finds packages that are not Debian's."""
    version = subprocess.run(["chroot", str(tree), "python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])"],
                             capture_output=True, text=True, check=True).stdout.strip()
    return version, tree / f"usr/local/lib/python{version}/dist-packages"


def install_kernels(tree: Path) -> None:
    """Put the compiled kernels of these sources into ``tree``, as the extension carries them; without them numpy works."""
    try:
        path = wheel(host(), REPOSITORY / "dist/wheels")
    except KernelError as error:
        print(f"debian_tree: {error}", file=sys.stderr)
        return
    _, target = python_packages(tree)
    check_run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--upgrade", "--target", str(target),
               str(path)])


def install_wheels(tree: Path, wheels: list[str]) -> None:
    """Put ``wheels`` for the tree's Python where its Blender finds them, with this machine's pip and its configuration."""
    version, target = python_packages(tree)
    present = {re.split(r"-\d", path.name)[0].lower() for path in target.glob("*.dist-info")}
    missing = [name for name in wheels if name.lower() not in present]
    if missing:
        platforms = [option for platform in WHEEL_PLATFORMS for option in ("--platform", platform)]
        check_run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--only-binary=:all:", "--target", str(target),
                   "--python-version", version, *platforms, *missing])


def command_in(tree: Path, command: list[str], binds: tuple[Path, ...] = (), environment: dict | None = None,
               network: bool = True) -> list[str]:
    """The command line that runs ``command`` in ``tree``: a private mount namespace, then chroot.

    Without ``network`` it also has a network namespace of its own, in which there is no interface that is up.
    """
    mounts = []
    for source in (Path("/proc"), Path("/sys"), Path("/dev"), *binds):
        inside = tree / source.relative_to("/")
        if source.is_dir():
            mounts.append(f"mkdir -p {shlex.quote(str(inside))}")
        mounts.append(f"mount --rbind {shlex.quote(str(source))} {shlex.quote(str(inside))}")
    here = Path.cwd()
    directory = here if any(here.is_relative_to(bind) for bind in binds) else Path("/")
    settings = {"PATH": "/usr/local/bin:/usr/bin:/bin:/usr/games:/usr/sbin:/sbin", "HOME": "/root", "LANG": "C.UTF-8",
                **(environment or {})}
    assignments = " ".join(f"{name}={shlex.quote(value)}" for name, value in settings.items())
    inner = f"cd {shlex.quote(str(directory))} && exec {shlex.join(command)}"
    script = " && ".join([*mounts, f"exec env {assignments} chroot {shlex.quote(str(tree))} /bin/sh -c {shlex.quote(inner)}"])
    return ["unshare", "--mount", *([] if network else ["--net"]), "/bin/sh", "-c", script]


def check_run(command: list[str]) -> None:
    """Run ``command`` and end with its exit code if it fails."""
    code = subprocess.run(command, check=False).returncode
    if code:
        sys.exit(code)


def split_at(words: list[str], separator: str) -> tuple[list[str], list[str]]:
    """The words before the first ``separator`` and those after it."""
    at = words.index(separator) if separator in words else len(words)
    return words[:at], words[at + 1:]


def exit_code(returned: int) -> int:
    """What a shell says of a process that ``subprocess`` says ``returned``: 128 and the number of the signal that ended it."""
    return 128 - returned if returned < 0 else returned


def main() -> None:
    """Read the command line and do what it says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("create", help="make the tree, or bring it up to date")
    making.add_argument("tree", type=Path)
    making.add_argument("--package", action="append", default=[], help="one more Debian package")
    making.add_argument("--wheel", action="append", default=[], help="one more Python wheel, without what it depends on")
    running = commands.add_parser("run", help="run a command in the tree")
    running.add_argument("tree", type=Path)
    running.add_argument("--bind", type=Path, action="append", default=[], help="one more path that the command may see")
    running.add_argument("--env", action="append", default=[], metavar="NAME=VALUE", help="a variable for the command")
    running.add_argument("--no-network", action="store_true", help="the command finds no network, not even this machine's own")
    given, line = split_at(sys.argv[1:], "--")
    arguments = parser.parse_args(given)
    if os.geteuid() != 0:
        sys.exit("a Debian tree takes root to make and to enter: run this with sudo")
    tree = arguments.tree.resolve()
    if arguments.command == "create":
        create(tree, arguments.package, arguments.wheel)
        return
    if not line:
        running.error("give the command after --")
    if not (tree / "usr/bin").exists():
        sys.exit(f"{tree} is no Debian tree: make it with `{Path(sys.argv[0]).name} create {tree}`")
    binds = (REPOSITORY, *(path.resolve() for path in arguments.bind))
    environment = dict(item.split("=", 1) for item in arguments.env)
    code = subprocess.run(command_in(tree, line, binds, environment, not arguments.no_network), check=False).returncode
    sys.exit(exit_code(code))


if __name__ == "__main__":
    main()
