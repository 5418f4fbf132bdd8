"""tools/blender_modules.py: which Blenders it makes, which it leaves out and says so, and that a second run does nothing."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOLS))
    return importlib.import_module("blender_modules")


@pytest.fixture
def installed(tool, monkeypatch, tmp_path):
    """What was asked of pip; environments appear as if it had been done."""
    asked = []

    def run(command, check, stdout):
        if "venv" in command:
            (Path(command[-1]) / "bin").mkdir(parents=True)
            (Path(command[-1]) / "bin/python").touch()
        else:
            asked.append(command[command.index(":all:") + 1:])
            if any("5.0" in word for word in command[-2:]):
                raise subprocess.CalledProcessError(1, command)

    monkeypatch.setattr(tool.subprocess, "run", run)
    monkeypatch.setattr(sys, "argv", ["blender_modules.py", str(tmp_path)])
    return asked


def test_every_supported_blender_is_made_once(tool, installed, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(tool, "BLENDERS", [entry for entry in tool.BLENDERS if entry[0] != "5.0.1"])
    monkeypatch.setattr(tool, "interpreters", lambda: {"3.11": "/a", "3.13": "/b"})
    assert tool.main() == 0
    made = capsys.readouterr().out.strip().split(tool.os.pathsep)
    assert made == [str(tmp_path / f"bpy-{version}/bin/python") for version in ("4.5.15", "5.1.2", "5.2.3")]
    assert installed[0] == ["bpy==4.5.15", "numpy==1.26.4"] and len(installed) == 3
    assert tool.main() == 0 and len(installed) == 3


def test_a_blender_without_its_python_is_left_out_and_named(tool, installed, monkeypatch, capsys):
    monkeypatch.setattr(tool, "interpreters", lambda: {"3.13": "/b"})
    assert tool.main() == 0
    said = capsys.readouterr()
    assert "Blender 4.5.15 is left out: there is no Python 3.11 here" in said.err and "bpy-4.5" not in said.out


def test_one_that_cannot_be_installed_is_a_failure_and_the_others_are_made(tool, installed, monkeypatch, capsys):
    monkeypatch.setattr(tool, "interpreters", lambda: {"3.11": "/a", "3.13": "/b"})
    assert tool.main() == 1
    said = capsys.readouterr()
    assert "Blender 5.0.1 could not be installed" in said.err and "bpy-5.1.2" in said.out


def test_incomplete_interpreters_do_not_count(tool, monkeypatch):
    facts = {
        "good": {"version": [3, 13, 1], "missing": [], "fits": True},
        "bare": {"version": [3, 11, 2], "missing": ["ssl"], "fits": True},
        "odd": {"version": [3, 11, 0], "missing": [], "fits": False},
        "dead": None,
    }
    monkeypatch.setattr(tool, "candidates", lambda own_folder: list(facts))
    monkeypatch.setattr(tool, "probe", facts.get)
    assert tool.interpreters() == {"3.13": "good"}
