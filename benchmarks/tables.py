"""The tables of benchmarks/measured in one go, on one commit: runs one script after the other and keeps what each prints.

    python benchmarks/tables.py [--only NAME…] [--skip NAME…] [--minutes 30] [--list] [--tiny]

Made for two idle cores, where it takes some 27 minutes: it stops beginning new tables when --minutes are over, says which are
missing, and goes on with those the next time unless --again is given or the commit has changed. Tables of hours (`make charts`), of
files that are not in this repository (real_scenes.py) and of a window or GPU (preview.py, preview_vs_cycles.py, rsm_capture.py,
gpu_kernels.py) are not among them. Results lie in benchmarks/results/tables, one file a table that says how busy the machine was
before it, and together in all.txt, ready to be pasted. With --tiny the same scripts measure as little as they can, in a few
minutes: whether every table comes to its end is then known before the long run. Those results lie in the folder tiny there.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks/results/tables"
# What Blender's module says of files, and numpy of forks, between a script's own lines.
_NOISE = re.compile(r"^\d\d:\d\d\.\d+ |^Error: Not freed|DeprecationWarning|^  child = ")
# Above so many busy cores before it begins, a table says so. The load will not do: it still counts the table before.
_IDLE = 0.3


class Table(NamedTuple):
    """One table: the ``section`` of benchmarks/measured that it is for, the script with its arguments, the minutes that it takes,
    and the arguments of a ``tiny`` run."""

    section: str
    command: str
    minutes: float
    tiny: str


# Those that goals are held to come first.
TABLES = {
    "rates": Table("Rays per second", "ray_rate.py --runs 1", 2.5, "cornell_box --probes 8 --runs 1"),
    "panoramas": Table("Bake against Cycles panoramas", "bake_vs_cycles.py cornell_box sky_courtyard sun_window "
                       "--method panorama --quick --reference-seconds 20", 7.0,
                       "cornell_box --probes 8 --method panorama --quick --reference-seconds 1"),
    "atrium": Table("Bake against Cycles panoramas", "bake_vs_cycles.py atrium --probes 2048 "
                    "--method panorama --quick --reference-seconds 20", 3.0,
                    "two_rooms --probes 8 --method panorama --quick --reference-seconds 1"),
    "relight": Table("Relighting", "relight.py --repeats 1", 1.5, "cornell_box --probes 8 --repeats 1"),
    "scale": Table("Large bakes", "scale.py --probes 2500 10000", 0.7, "--triangles 2000 --probes 16 --rays 64"),
    "vpl": Table("Instant radiosity", "vpl.py rate --runs 3", 2.0, "rate --runs 1 --samples cornell_box"),
    "lpv": Table("Light propagation volumes", "lpv.py", 0.3, "--resolution 8 --repeats 1"),
    "accuracy": Table("Accuracy at default settings", "accuracy.py --seeds 2", 2.5, "furnace --seeds 1"),
    # Bakes through media to 1 % take a quarter of an hour.
    "memory": Table("Memory", "memory.py adversarial atrium cornell_box corridor_door_ajar furnace integrating_sphere many_lights "
                    "outdoor_hdri sky_courtyard sun_window two_rooms", 2.0, "furnace --techniques probes"),
    "techniques": Table("Techniques against the path reference", "technique_errors.py --techniques probes vpl rsm lpv", 1.5,
                        "--techniques probes vpl rsm lpv --samples cornell_box --points 20 --noise 0.2"),
    "transfer": Table("From transfer", "transfer.py", 0.5, "cornell_box --probes 8 --rays 64"),
    "without": Table("Without Embree", "without_embree.py cornell_box two_rooms", 0.6, "cornell_box --rays 16 --runs 1"),
    "linear": Table("Cost by size", "linear_cost.py --runs 3", 0.7, "--runs 1"),
    "live": Table("Live probes", "live_probes.py sample_blends/cornell_box.blend sample_blends/atrium.blend", 0.7,
                  "sample_blends/cornell_box.blend --rays 1024"),
    "voxels": Table("Voxels", "voxels.py", 1.5, "--only errors --samples cornell_box --points 20 --noise 0.2"),
}


def commit() -> str:
    """The commit of the tree, with a mark where files differ from it."""
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()
    return (git("rev-parse", "--short=12", "HEAD") or "unknown") + (" and changes" if git("status", "--porcelain", "-uno") else "")


def busy_cores(seconds: float = 1.0) -> float:
    """How many cores are at work now, by what Linux counts within ``seconds``; 0 where the system does not tell."""
    counts = Path("/proc/stat")
    if not counts.exists():
        return 0.0

    def spent() -> tuple[int, int]:
        ticks = [int(word) for word in counts.read_text().split("\n", 1)[0].split()[1:9]]
        return sum(ticks) - ticks[3] - ticks[4], sum(ticks)

    before = spent()
    time.sleep(seconds)
    busy, whole = (after - earlier for after, earlier in zip(spent(), before, strict=True))
    return busy / max(whole, 1) * (os.cpu_count() or 1)


def measure(name: str, table: Table, head: str, results: Path) -> bool:
    """Run one script, show what it prints and keep it among the ``results``. Whether it came to its end."""
    before, started = busy_cores(), time.perf_counter()
    print(f"\n## {table.section} ({name})\n\n`python benchmarks/{table.command}`\n", flush=True)
    words = [sys.executable, str(ROOT / "benchmarks" / table.command.split()[0]), *table.command.split()[1:]]
    lines = []
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as running:
        for line in running.stdout:
            if not _NOISE.search(line):
                lines.append(line.rstrip())
                print(lines[-1], flush=True)
    minutes = (time.perf_counter() - started) / 60
    busy = "" if before <= _IDLE else ", **others were at work**"
    note = f"{minutes:.1f} min, {before:.1f} cores at work before it{busy}"
    print(f"\n({note})", flush=True)
    done = running.returncode == 0
    if done:
        first = [head, note, f"## {table.section}", "", f"`python benchmarks/{table.command}`", ""]
        (results / f"{name}.txt").write_text("\n".join([*first, *lines, ""]))
    return done


def known(name: str, head: str, results: Path) -> bool:
    """Whether the table among the ``results`` was measured on this very commit."""
    path = results / f"{name}.txt"
    return path.exists() and path.read_text().splitlines()[0] == head and "changes" not in head


def main() -> int:
    """Measure what is missing while there is time; the number of tables that failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(TABLES), default=list(TABLES))
    parser.add_argument("--skip", nargs="+", choices=list(TABLES), default=[])
    parser.add_argument("--minutes", type=float, default=30.0, help="begin no table that would not end by then (default 30)")
    parser.add_argument("--again", action="store_true", help="also those that are known of this commit")
    parser.add_argument("--tiny", action="store_true", help="the least that every script can measure, to see that all of them run")
    parser.add_argument("--list", action="store_true", help="say what there is, and how long it takes")
    arguments = parser.parse_args()
    if arguments.list:
        for name, table in TABLES.items():
            print(f"{name:12s} {table.minutes:4.1f} min  {table.command}")
        return 0
    results, tables = RESULTS, TABLES
    if arguments.tiny:
        results = RESULTS / "tiny"
        tables = {name: table._replace(command=f"{table.command.split()[0]} {table.tiny}") for name, table in TABLES.items()}
    results.mkdir(parents=True, exist_ok=True)
    head, started, failed, left = commit(), time.perf_counter(), [], []
    print(f"commit {head}, {os.cpu_count()} cores, {busy_cores():.1f} at work", flush=True)
    wanted = [name for name in arguments.only if name not in arguments.skip]
    for name in wanted:
        if not arguments.again and known(name, head, results):
            continue
        if not arguments.tiny and (time.perf_counter() - started) / 60 + tables[name].minutes > arguments.minutes:
            left.append(name)
        elif not measure(name, tables[name], head, results):
            failed.append(name)
    parts = [path.read_text() for name in tables if (path := results / f"{name}.txt").exists()]
    (results / "all.txt").write_text("\n".join(parts))
    print(f"\nAll that is known is in {results / 'all.txt'}.")
    for what, names in (("failed", failed), ("no time was left for", left)):
        if names:
            print(f"{what}: {', '.join(names)}")
    return len(failed)


if __name__ == "__main__":
    raise SystemExit(main())
