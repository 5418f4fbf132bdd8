"""Flamenco's job type, run by node against a stand-in of what its manual says a script is given; the commands it makes are those of
the command line."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser

ROOT = Path(__file__).resolve().parents[2]
SCRIPT, STAND_IN = ROOT / "tools/flamenco/rtgi_bake.js", Path(__file__).with_name("flamenco.js")
SETTINGS = {"parts": 3, "blendfile": "/shared/hall of columns.blend", "output": "/shared/bakes/hall", "error": 0.05, "seed": 7,
            "extra": "--technique probes  --set order=1"}
# What Flamenco's schema of job types knows (its manual, "Job Types", and pkg/api/flamenco-openapi.yaml, AvailableJobSetting).
TYPES = {"string", "int32", "float", "bool"}
SUBTYPES = {"file_path", "dir_path", "file_name", "hashed_file_path"}
VISIBLE = {"visible", "hidden", "submission", "web"}
KEYS = {"key", "type", "subtype", "choices", "propargs", "description", "label", "default", "eval", "evalInfo", "visible",
        "required", "editable"}

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")


def compiled(**changed):
    """What the script makes of a job with the settings of SETTINGS."""
    done = subprocess.run(["node", str(STAND_IN), str(SCRIPT), json.dumps({**SETTINGS, **changed})], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def words(task):
    """What follows `rtgi` in the task's one command, which starts Blender with the file, if any, before `--command`."""
    (command,) = task["commands"]
    assert command["name"] == "exec" and command["parameters"]["exe"] == "{blender}"
    arguments = command["parameters"]["args"]
    at = arguments.index("--command")
    assert arguments[0] == "-b" and arguments[at + 1] == "rtgi"
    return arguments[1:at], arguments[at + 2:]


def test_a_job_is_prepared_made_in_parts_and_merged():
    prepare, *parts, merge = compiled()["tasks"]
    assert [len(task["dependencies"]) for task in (prepare, *parts, merge)] == [0, 1, 1, 1, 3]
    assert all(task["dependencies"] == [0] for task in parts) and merge["dependencies"] == [1, 2, 3]
    parser = build_parser("rtgi")
    files, line = words(prepare)
    told = parser.parse_args(line)
    assert files == [SETTINGS["blendfile"]] and (told.subcommand, told.error, told.seed) == ("prepare", 0.05, 7)
    assert told.technique == "probes" and dict(told.assignments)["order"] in (1, "1")
    places = []
    for number, task in enumerate(parts, start=1):
        files, line = words(task)
        part = parser.parse_args(line)
        assert not files and (part.subcommand, part.prepared, part.part, part.resume) == ("bake", told.out, (number, 3), True)
        places.append(part.out)
    files, line = words(merge)
    merged = parser.parse_args(line)
    assert not files and (merged.subcommand, merged.parts, merged.out) == ("merge", places, SETTINGS["output"])
    assert {"prepare", "bake", "merge"} <= set(SUBCOMMANDS)


def test_settings_are_what_the_submit_panel_knows():
    settings = compiled()["type"]["settings"]
    assert len({entry["key"] for entry in settings}) == len(settings)
    for entry in settings:
        assert entry.keys() <= KEYS and entry["type"] in TYPES and entry.get("subtype", "file_path") in SUBTYPES
        assert entry.get("visible", "visible") in VISIBLE and entry["description"]


def test_a_job_without_parts_is_refused_in_words():
    result = compiled(parts=0)
    assert result["error"] == "RTGI Bake needs at least one part" and not result["tasks"]
