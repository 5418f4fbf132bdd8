"""What `make extension` packs: the add-on alone, the wheels as pinned, the same bytes every time, one line where it cannot."""

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import tomllib
import zipfile

import pytest
from extension_zip import OFFLINE, PLATFORM, REPOSITORY, build_extension

NO_WHEELS = "linux-arm64"


@pytest.fixture(scope="module")
def tool():
    """tools/build_extension.py as a module."""
    spec = importlib.util.spec_from_file_location("build_extension", REPOSITORY / "tools/build_extension.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A zip of a platform without wheels but the kernels', built where there is no network."""
    pytest.importorskip("bpy", reason="the bpy module holds Blender's extension tool")
    output = tmp_path_factory.mktemp("dist")
    keep_kernels(output / "wheels")
    ran = build_extension("--platform", NO_WHEELS, "--output", output, "--wheels", output / "wheels", environment=OFFLINE)
    if "cannot download the compiler" in ran.stderr:
        pytest.skip(ran.stderr.strip())
    assert ran.returncode == 0, ran.stderr
    path, = output.glob("*.zip")
    return path


def keep_kernels(folder):
    """Put the kernels' wheel that `make extension` has kept into ``folder``, if it has."""
    folder.mkdir(parents=True)
    for wheel in (REPOSITORY / "dist/wheels").glob("rtgi_kernels-*aarch64.whl"):
        shutil.copy(wheel, folder)


def names(path):
    with zipfile.ZipFile(path) as archive:
        return archive.namelist()


def test_the_add_on_is_in_it_and_nothing_else(small):
    packed = set(names(small))
    assert {"blender_manifest.toml", "__init__.py", "LICENSE"} == {name for name in packed if "/" not in name}
    assert {name.split("/")[0] for name in packed if "/" in name} == {"rtgi_addon", "wheels"}
    assert [name.split("-")[0] for name in packed if name.endswith(".whl")] == ["wheels/rtgi_kernels"]
    assert not [name for name in packed if "__pycache__" in name or name.endswith((".pyc", ".blend", ".zip", ".so", ".dll"))]
    sources = {path.relative_to(REPOSITORY).as_posix() for path in (REPOSITORY / "rtgi_addon").rglob("*")
               if path.is_file() and path.suffix in (".py", ".glsl", ".gd", ".gdshaderinc", ".js", ".html", ".c", ".h")}
    assert sources <= packed and any(name.endswith(".glsl") for name in sources)


def test_what_git_knows_of_the_package_is_in_it(small):
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "rtgi_addon"], cwd=REPOSITORY,
                            capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("this is no git clone")
    present = {name for name in listed.stdout.splitlines() if (REPOSITORY / name).exists()}
    assert {name for name in names(small) if name.startswith("rtgi_addon/")} == present


def test_wheels_are_the_pinned_ones_for_every_python(archive, tool):
    import build_kernels  # beside the tool, which has put its folder on the path
    with zipfile.ZipFile(archive) as opened:
        carried = {name: hashlib.sha256(opened.read(name)).hexdigest() for name in opened.namelist() if name.endswith(".whl")}
        manifest = tomllib.loads(opened.read("blender_manifest.toml").decode())
    of_kernels, = [name for name in carried if "/rtgi_kernels-" in name]
    assert carried[of_kernels] == build_kernels.pins()[of_kernels.split("/")[1]]
    assert {digest for name, digest in carried.items() if name != of_kernels} <= tool.pinned_hashes()
    expected = ["cp" + python.replace(".", "") for python in tool.PYTHONS] if tool.PLATFORMS[PLATFORM] else []
    assert sorted(re.search(r"-(cp\d+)-", name)[1] for name in carried if name != of_kernels) == sorted(expected)
    assert manifest["build"]["generated"]["platforms"] == [PLATFORM]
    assert {f"./{name}" for name in carried} == set(manifest["build"]["generated"]["wheels"])


def test_every_wheel_of_every_platform_is_pinned(tool):
    with_wheels = [platform for platform, tags in tool.PLATFORMS.items() if tags]
    assert with_wheels == ["linux-x64", "windows-x64", "macos-arm64", "macos-x64"]
    assert len(tool.pinned_hashes()) == len(with_wheels) * len(tool.PYTHONS)


def test_the_manifest_asks_for_files_alone(small, tool):
    import build_kernels
    with zipfile.ZipFile(small) as opened:
        manifest = tomllib.loads(opened.read("blender_manifest.toml").decode())
    assert list(manifest["permissions"]) == ["files"]
    kernels = f"./wheels/{build_kernels.wheel_name(NO_WHEELS)}"
    assert manifest["build"]["generated"] == {"platforms": [NO_WHEELS], "wheels": [kernels]}
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]


def test_versions_are_written_once(tool):
    manifest = tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text())
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert manifest["version"] == project["version"]
    pinned = re.search(r"^embreex==(\S+)", tool.WHEELS.read_text(), re.MULTILINE)[1]
    assert re.search(r"^embreex==([^;\s]+)", (REPOSITORY / "tools/requirements.txt").read_text(), re.MULTILINE)[1] == pinned


def test_the_same_source_gives_the_same_bytes(tool, small, tmp_path, monkeypatch):
    """Whatever the order, the times and the modes of the files on the disk."""
    zips = []
    for step, mode in ((1, 0o644), (-1, 0o600)):
        copy = tmp_path / f"copy{step}"
        with zipfile.ZipFile(small) as packed:
            for name in packed.namelist()[::step]:
                packed.extract(name, copy)
                (copy / name).chmod(mode)
                os.utime(copy / name, (10**9 - step, 10**9 - step))
        shutil.copy(REPOSITORY / "blender_manifest.toml", copy)
        monkeypatch.setattr(tool, "ROOT", copy)
        shutil.copytree(small.parent / "wheels", copy / "kept")
        zips += tool.build([NO_WHEELS], copy / "dist", copy / "kept")
    assert zips[0].read_bytes() == zips[1].read_bytes()


def test_without_a_network_one_line_says_what_to_do(tmp_path):
    pytest.importorskip("bpy", reason="the bpy module holds Blender's extension tool")
    ran = build_extension("--platform", "windows-x64", "--output", tmp_path, "--wheels", tmp_path / "wheels", environment=OFFLINE)
    assert ran.returncode == 1
    line, = ran.stderr.strip().splitlines()
    assert "cannot download the wheel of windows-x64 for Python 3.11" in line and "connect to the network" in line
    assert not list(tmp_path.glob("*.zip")) and not list((tmp_path / "wheels").iterdir())


def test_a_wheel_of_other_bytes_is_refused(tool, tmp_path, monkeypatch):
    """As pip reports it, which compares what it downloads with wheels.txt."""
    said = "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE."
    monkeypatch.setattr(tool.subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 1, "", said))
    with pytest.raises(tool.BuildError, match=r"not the one that tools/wheels\.txt pins"):
        tool.download("windows-x64", "3.11", tmp_path)


def test_a_kept_wheel_that_is_not_the_pinned_one_is_fetched_anew(tool, tmp_path, monkeypatch):
    fetched = []
    monkeypatch.setattr(tool, "download", lambda platform, python, folder: fetched.append(python) or folder / python)
    (tmp_path / "embreex-4.4.0.post1-cp311-cp311-win_amd64.whl").write_bytes(b"something else")
    assert len(tool.fetch_wheels("windows-x64", tmp_path)) == len(tool.PYTHONS)
    assert fetched == list(tool.PYTHONS)
