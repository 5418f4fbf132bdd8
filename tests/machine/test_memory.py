"""What a process may take: control groups of both versions, limits of the process, threads that fit."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from rtgi_addon.machine.control_groups import group_bytes_left
from rtgi_addon.machine.memory import address_bytes_left, available_bytes, peak_memory_bytes, threads_that_fit

ROOT = Path(__file__).resolve().parents[2]
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits are read from Linux's files")
MIB = 1 << 20


def system(tmp_path, groups, mounts, folders):
    """A tree with /proc/self/cgroup of ``groups``, /proc/self/mountinfo of ``mounts`` and the ``folders`` of files."""
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/self/cgroup").write_text("\n".join(groups) + "\n")
    lines = [f"{30 + number} 23 0:2{number} {top} {place} rw,relatime shared:9 - {kind} cgroup {options}"
             for number, (top, place, kind, options) in enumerate(mounts)]
    (tmp_path / "proc/self/mountinfo").write_text("\n".join(["22 1 8:1 / / rw - ext4 /dev/sda1 rw", *lines, "broken"]) + "\n")
    for folder, files in folders.items():
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (tmp_path / folder / name).write_text(f"{content}\n")
    return tmp_path


def v2(limit, used, cache=0, high="max"):
    return {"memory.max": limit, "memory.high": high, "memory.current": used,
            "memory.stat": f"anon 1\ninactive_file {cache}\nactive_file 7"}


def v1(limit, used, cache=0):
    return {"memory.limit_in_bytes": limit, "memory.usage_in_bytes": used, "memory.stat": f"cache 9\ntotal_inactive_file {cache}"}


UNIFIED = [("/", "/sys/fs/cgroup", "cgroup2", "rw")]


@pytest.mark.parametrize(("folders", "left"), [
    ({"a/b": v2("max", 5), "a": v2("max", 5), "": {}}, None),
    ({"a/b": v2(1000, 400, 50)}, 650),
    # The strictest of the group and those around it, wherever it is.
    ({"a/b": v2("max", 400), "a": v2(1000, 700)}, 300),
    ({"a/b": v2(5000, 400), "a": v2(1000, 700), "": v2(900, 800, 20)}, 120),
    ({"a/b": v2(1000, 400), "a": v2(5000, 700)}, 600),
    ({"a/b": v2(1000, 400, high=500)}, 100),
    ({"a/b": v2(1000, 1400)}, 1),
])
def test_groups_of_version_2_count_with_those_around_them(tmp_path, folders, left):
    root = system(tmp_path, ["0::/a/b"], UNIFIED, {f"sys/fs/cgroup/{name}": files for name, files in folders.items()})
    assert group_bytes_left(root) == left


@pytest.mark.parametrize(("inner", "outer", "left"), [
    (v1(2**63 - 4096, 5), v1(2**63 - 4096, 5), None), (v1(1000, 400, 50), v1(2**63 - 4096, 5), 650),
    (v1(2**63 - 4096, 5), v1(900, 800), 100), (v1(1000, 400), v1(900, 850), 50)])
def test_groups_of_version_1_too(tmp_path, inner, outer, left):
    """Beside a unified tree that counts no memory, as systemd mounts both."""
    root = system(tmp_path, ["9:name=systemd:/x", "4:memory,other:/jobs/one", "0::/x"],
                  [("/", "/sys/fs/cgroup/unified", "cgroup2", "rw"), ("/", "/sys/fs/cgroup/cpu", "cgroup", "rw,cpu"),
                   ("/", "/sys/fs/cgroup/memory", "cgroup", "rw,memory")],
                  {"sys/fs/cgroup/memory/jobs/one": inner, "sys/fs/cgroup/memory/jobs": outer, "sys/fs/cgroup/unified/x": {}})
    assert group_bytes_left(root) == left


@pytest.mark.parametrize(("path", "top"), [
    ("/", "/docker/77"), ("/docker/77", "/docker/77"), ("/../../other", "/"), ("/lost", "/docker")])
def test_a_container_sees_its_own_group_at_the_top(tmp_path, path, top):
    root = system(tmp_path, [f"0::{path}"], [(top, "/sys/fs/cgroup", "cgroup2", "rw")], {"sys/fs/cgroup": v2(1000, 400)})
    assert group_bytes_left(root) == 600


def test_a_mount_with_a_space_is_found(tmp_path):
    root = system(tmp_path, ["0::/a"], [("/", r"/my\040groups", "cgroup2", "rw")], {"my groups/a": v2(1000, 400)})
    assert group_bytes_left(root) == 600


def test_a_system_without_groups_has_no_limit(tmp_path):
    assert group_bytes_left(tmp_path) is None
    assert group_bytes_left(system(tmp_path, ["nonsense", "0::/a"], [], {})) is None


def test_this_machine_has_memory_and_this_process_took_some():
    assert 2**26 < available_bytes() < 2**50
    assert 2**20 < peak_memory_bytes() < 2**50


def limited(code, **limits):
    """What ``code`` prints in a process of its own under the ``limits`` (RLIMIT name → bytes above what it has)."""
    lines = ["import resource, sys", "from rtgi_addon.machine.memory import *", "from rtgi_addon.machine import memory",
             "taken = memory._table(memory._PROC / 'self/status')"]
    for name, room in limits.items():
        size = {"AS": "VmSize", "DATA": "VmData"}[name]
        lines.append(f"resource.setrlimit(resource.RLIMIT_{name}, (taken['{size}'] + {room},) * 2)")
    done = subprocess.run([sys.executable, "-c", "\n".join([*lines, code])], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@linux
@pytest.mark.parametrize("name", ["AS", "DATA"])
def test_limits_of_the_process_count(name):
    assert resource.getrlimit(resource.RLIMIT_AS)[0] == resource.RLIM_INFINITY, "this test needs a process without a limit"
    assert address_bytes_left() is None and threads_that_fit(64) == 64
    left, available = map(int, limited("print(address_bytes_left(), available_bytes())", **{name: 1000 * MIB}).split())
    assert 900 * MIB < left <= 1000 * MIB and available < left


@linux
def test_threads_are_as_many_as_fit():
    assert limited("print(threads_that_fit(64), threads_that_fit(1))", AS=200 * MIB) == "6 1"
    assert limited("print(threads_that_fit(64))", AS=2 * MIB) == "1"


@linux
def test_work_goes_on_with_fewer_threads_and_without_a_wait():
    """A thread that had no room for its stack kept Python waiting for ever."""
    code = ("from rtgi_addon.transport.parallel import parallel_for\n"
            "print(sum(parallel_for(lambda i: i, 1000, 64)))")
    assert limited("share_arenas()\n" + code, AS=60 * MIB) == "499500"


@linux
def test_arenas_are_shared_under_a_limit_alone():
    """Threads that allocate take a stack each, and no arena of 64 MiB beside it."""
    code = ("import threading\n"
            "def work():\n"
            "    kept.append(bytearray(5000)); barrier.wait()\n"
            "kept, barrier = [], threading.Barrier(9)\n"
            "before = memory._table(memory._PROC / 'self/status')['VmSize']\n"
            "threads = [threading.Thread(target=work) for _ in range(8)]\n"
            "for thread in threads: thread.start()\n"
            "barrier.wait()\n"
            "print((memory._table(memory._PROC / 'self/status')['VmSize'] - before) >> 20)")
    assert int(limited("share_arenas()\n" + code, AS=4000 * MIB)) < 8 * 8 + 32
