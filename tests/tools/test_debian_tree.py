"""The Debian tree's tool: which mirror it reads, and what a command in the tree sees."""

import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOLS))
    monkeypatch.delitem(sys.modules, "debian_tree", raising=False)
    import debian_tree
    return debian_tree


@pytest.mark.parametrize(("name", "text", "mirror"), [
    ("debian.sources", "Types: deb\nURIs: http://mirror.example/debian\nSuites: bookworm\n", "http://mirror.example/debian"),
    ("own.list", "# deb http://old.example/debian x main\ndeb [signed-by=/k.gpg] https://m.example/debian/ bookworm main\n",
     "https://m.example/debian"),
    ("security.list", "deb http://m.example/debian-security bookworm-security main\n", "http://deb.debian.org/debian"),
    ("own.list.disabled", "deb http://m.example/debian bookworm main\n", "http://deb.debian.org/debian"),
])
def test_the_mirror_is_the_one_apt_uses(tool, tmp_path, name, text, mirror):
    (tmp_path / "sources.list.d").mkdir()
    (tmp_path / "sources.list.d" / name).write_text(text)
    assert tool.apt_mirror(tmp_path) == mirror


def test_a_command_sees_its_folders_and_nothing_of_it_stays_mounted(tool, tmp_path, monkeypatch):
    shared = tmp_path / "a folder"
    shared.mkdir()
    monkeypatch.chdir(shared)
    line = tool.command_in(Path("/tree"), ["echo", "two words"], (shared,), {"NAME": "a b"})
    assert line[:2] == ["unshare", "--mount"]
    script = line[-1]
    assert f"mount --rbind '{shared}' '/tree{shared}'" in script
    assert "NAME='a b'" in script and "chroot /tree" in script
    offline = tool.command_in(Path("/tree"), ["true"], network=False)
    assert "--net" in offline and "--net" not in line
    assert "two words" in script and f"cd '\"'\"'{shared}'\"'\"'" in script


def test_the_command_begins_after_the_first_dashes(tool):
    assert tool.split_at(["run", "tree", "--", "blender", "--", "x"], "--") == (["run", "tree"], ["blender", "--", "x"])
    assert tool.split_at(["create", "tree"], "--") == (["create", "tree"], [])


def test_a_command_that_a_signal_ends_has_the_exit_code_of_shells(tool):
    killed = subprocess.run(["sh", "-c", "kill -SEGV $$"], check=False).returncode
    assert killed == -11 and tool.exit_code(killed) == 139
    assert tool.exit_code(5) == 5
