"""The campaign in a short form, with the same trials every time; `make campaign` is the long one."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from kills import needs_fork

pytest.importorskip("bpy", reason="needs Blender's Python module")


@needs_fork
@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts and limits what Linux counts and limits")
@pytest.mark.parametrize(("part", "count"), [("kills", 16), ("mutations", 150), ("commands", 10)])
def test_nothing_is_found(part, count):
    done = subprocess.run([sys.executable, str(Path(__file__).with_name("run.py")), part, "--count", str(count), "--jobs", "1"],
                          capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{count} {part}" in done.stdout or part == "kills"


def test_a_part_leaves_its_process_to_be_ended_as_before(tmp_path, monkeypatch):
    """A pool ends its processes by SIGTERM: one that raised instead while it held the pool's lock kept it waiting for ever."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import run as campaign

    class Part:
        def trial(self, number, tally):
            handlers.append(signal.getsignal(signal.SIGTERM))

    handlers, before = [], signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(campaign, "part_of", lambda name, seed, place: Part())
    tally = campaign.run("kills", [1], 0, tmp_path)
    assert tally.counts["trials"] == 1 and handlers == [signal.default_int_handler]
    assert signal.getsignal(signal.SIGTERM) == before


@needs_fork
def test_a_share_that_fails_is_found_and_the_others_end(monkeypatch):
    """Its error came out of the pool, which ended the other processes; these took it for a wish to stop, and waited for work."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import run as campaign

    class Part:
        def trial(self, number, tally):
            if number == 0:
                raise FileNotFoundError("gone")
            time.sleep(0.2)
            tally.count("kills")

    monkeypatch.setattr(campaign, "part_of", lambda name, seed, place: Part())
    tally = campaign.campaign("kills", 4, 0, 2)
    assert [number for number, _ in tally.findings] == [0] and "FileNotFoundError: gone" in tally.findings[0][1]
    assert tally.counts["kills"] == 2
