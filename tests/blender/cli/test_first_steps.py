"""What somebody tries first at the shell: the FILE after the subcommand, a folder that is not there yet, --resume of nothing,
errors for programs; and the same mistake has the same exit code wherever it is found."""

import json
import shutil
import subprocess
import sys
import zipfile
from types import SimpleNamespace

import pytest
from command_line import CORNELL, ROOT, assert_failed, bake, run

from rtgi_addon.blender.cli.plan import strictly
from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.exchange.bundle import read_bundle


def test_the_file_may_stand_behind_the_subcommand_and_parents_are_made(tmp_path):
    out = tmp_path / "a/b/c"
    for words in (("bake", CORNELL, "--technique", "tiny", "--out", out), ("bake", "--technique", "tiny", "--out", out, CORNELL)):
        code, text, err = run(*words)
        assert code == 0 and text.startswith(f"Baked {out}"), err
    assert read_bundle(out).grids
    assert_failed(run("bake", CORNELL, CORNELL, "--out", out), "needs one file", code=2)
    assert_failed(run(CORNELL, "bake", CORNELL, "--out", out), "needs one file", code=2)
    assert_failed(run("bake", tmp_path / "none.blend", "--technique", "tiny", "--out", tmp_path / "x/y"), "there is no file")
    assert not (tmp_path / "x").exists()


def test_resume_without_anything_to_resume_says_so(tmp_path):
    code, _, err = bake("--out", tmp_path / "out", "--resume")
    note, = [line for line in err if line.startswith("rtgi: note: ")]
    assert code == 0 and "nothing to go on from" in note and str(tmp_path / "out") in note


@pytest.mark.parametrize(("words", "code", "cause"), [
    ((CORNELL, "bake", "--out", "x", "--threads", "0", "--json"), 2, "threads"),
    ((CORNELL, "bake", "--technique", "tiny", "--out", "x", "--volume", "Attic", "--json"), 2, "unknown volume 'Attic'"),
    ((CORNELL, "bake", "--out", "x", "--technique", "magic", "--json"), 2, "unknown technique"),
    ((CORNELL, "chart", "--out", "x", "--techniques", "magic", "--json"), 2, "unknown technique"),
    (("none.blend", "bake", "--technique", "tiny", "--out", "x", "--json"), 1, "there is no file"),
    (("info", "nowhere", "--json"), 1, "there is no bundle"),
])
def test_programs_get_errors_as_json_and_the_same_mistake_has_the_same_code(tmp_path, words, code, cause):
    returned, text, err = run(*words, cwd=tmp_path)
    error = json.loads(text)["error"]
    assert returned == error["exit_code"] == code and cause in error["cause"] and error["remedy"]
    assert err[-1] == f"rtgi: error: {error['message']}"
    assert not list(tmp_path.iterdir())


def outcome(monkeypatch, capfd, report=None, error=None, words=("--json",)):
    """Exit code and stdout of an `info` that gives ``report`` or raises ``error``."""
    from rtgi_addon.blender.cli import doors

    def do(arguments, session):
        if error:
            raise error
        return report

    class Streams:
        out, err = sys.stdout, sys.stderr

        def __init__(self, loud=False):
            pass

    monkeypatch.setattr(doors, "Streams", Streams)
    monkeypatch.setitem(doors.SUBCOMMANDS, "info", doors.replace(doors.SUBCOMMANDS["info"], run=do))
    code = doors.main_module(["info", "x", *words])
    return code, capfd.readouterr().out


class Report:
    refusal = BakeError("it differs", "look")

    def to_json(self):
        return {"figure": 1}

    def to_text(self):
        return "figure 1"


def test_what_has_failed_after_its_report_is_one_object_with_both(monkeypatch, capfd):
    code, out = outcome(monkeypatch, capfd, Report())
    assert code == 1 and json.loads(out) == {"figure": 1, "error": {"message": "it differs: look", "cause": "it differs",
                                                                    "remedy": "look", "exit_code": 1}}
    assert outcome(monkeypatch, capfd, Report(), words=()) == (1, "figure 1\n")


@pytest.mark.parametrize(("error", "code"), [(UsageError("no such", "choose"), 2), (BakeError("gone", "restore"), 1),
                                             (Cancelled("half is kept"), 130), (ValueError("a bug"), 1)])
def test_every_end_has_its_code(monkeypatch, capfd, error, code):
    returned, out = outcome(monkeypatch, capfd, error=error)
    assert returned == json.loads(out)["error"]["exit_code"] == code


def test_a_strict_plan_fails_where_its_error_is_out_of_reach():
    plan = SimpleNamespace(met=False, target=SimpleNamespace(error=0.01), chosen=SimpleNamespace(
        error=SimpleNamespace(value=0.0234)))
    strict, lax = SimpleNamespace(strict=True), SimpleNamespace(strict=False)
    report = Report()
    told = strictly(report, plan, strict)
    assert "0.01 is out of reach" in str(told.refusal) and "0.023" in str(told.refusal) and told.to_json() == {"figure": 1}
    assert strictly(report, plan, lax) is report
    plan.met = True
    assert strictly(report, plan, strict) is report


def test_strict_is_for_plans():
    assert_failed(run(CORNELL, "bake", "--out", "x", "--strict"), "--strict are for a plan", code=2)


@pytest.mark.slow
def test_pip_installs_everything_and_rtgi_runs_anywhere(tmp_path):
    # Building leaves its traces beside pyproject.toml.
    source = tmp_path / "source"
    shutil.copytree(ROOT / "rtgi_addon", source / "rtgi_addon", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", source)
    built = subprocess.run([sys.executable, "-m", "pip", "wheel", "--no-deps", "-q", "-w", tmp_path, source],
                           capture_output=True, text=True, timeout=300)
    if built.returncode and "No matching distribution found for setuptools" in built.stderr:
        pytest.skip("building fetches setuptools, and there is no network")
    assert built.returncode == 0, built.stderr
    wheel, = tmp_path.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(["git", "ls-files", "rtgi_addon"], cwd=ROOT, capture_output=True, text=True,
                             check=True).stdout.split("\n")
    assert not set(filter(None, tracked)) - names and not [name for name in names if name.endswith(".pyc")]
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--prefix", tmp_path / "here", wheel], check=True)
    command = next((tmp_path / "here").rglob("rtgi"), None) or next((tmp_path / "here").rglob("rtgi.exe"))
    site = next((tmp_path / "here").rglob("rtgi_addon")).parent
    done = subprocess.run([command, "info", "nowhere"], cwd=tmp_path, env={"PYTHONPATH": str(site)}, capture_output=True,
                          text=True)
    assert done.returncode == 1 and "there is no bundle" in done.stderr
