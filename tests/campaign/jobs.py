"""The jobs that the campaign kills: each makes an old result and a new one in a folder where a user has files, too, and knows what
may be there after a kill and what must be there in the end.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from offset_technique import OffsetTechnique
from scene_builders import closed_box, cube_furnace
from tiny_technique import TinyTechnique

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError
from rtgi_addon.evaluate import error_map, stability
from rtgi_addon.evaluate.chart_picture import can_draw
from rtgi_addon.evaluate.references import Truth
from rtgi_addon.evaluate.stability import limits, suite
from rtgi_addon.evaluate.stability.case import Case, Sample
from rtgi_addon.evaluate.stability.limits import Limit
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.bundle import Bundle, read_bundle
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.conformance import kit_field
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.chart import chart_scene
from rtgi_addon.jobs.stability import run_stability
from rtgi_addon.storage.png import require_whole_png, write_png

# Names that a user may have beside a result, some of which earlier versions took for their own.
BESIDE = ("out.rtgi-old/keep", "out.rtgi-new/keep", "out.old/keep", "out.new/keep", "out2/keep", "other.partial/keep", "new/keep",
          "old", "commit.json", "rtgi-lock.json", "out.tmp", "out.partial.tmp/keep", ".out/keep")


def ready() -> None:
    """Make the stand-ins for techniques and cases known."""
    registry = techniques.registry()
    registry["tiny"], registry["offset"] = TinyTechnique(), OffsetTechnique()
    limits.LIMITS["made-up"] = {"probes": Limit(9.0), "rsm": Limit(9.0), "lpv": Limit(9.0)}
    suite.CASES["made-up"] = Case("made-up", "nothing fails", "no scene", "a number", "two steps", 0.2, lambda bench: [
        Sample("first", 0.0), Sample("second", {"probes": 0.1, "rsm": 0.5, "lpv": float("nan")}[bench.technique])])
    assert stability.CASES is suite.CASES
    error_map.PathReference = lambda *_: Furnace()
    # What draws takes seconds to be imported, in every process that was not forked after it.
    can_draw()


class Furnace:
    """The reference in the cube furnace of the chart below, by its closed form: a path tracer is most of what a chart takes."""

    kind = "furnace"

    def __init__(self, radiance: float = 1.0):
        self._radiance = radiance

    def irradiance(self, receivers, progress=None, knows=None) -> Truth:
        """See Reference."""
        return self._truth(np.full((len(receivers.points), 3), np.pi * self._radiance))

    def probes(self, points, order, progress=None) -> Truth:
        """See Reference."""
        mean = np.zeros((len(points), (order + 1) ** 2, 3))
        mean[:, 0] = self._radiance * np.sqrt(4.0 * np.pi)
        return self._truth(mean)

    @staticmethod
    def _truth(mean) -> Truth:
        # Nothing measured is without any noise.
        return Truth(mean, np.full_like(mean, 1e-8))


class Job:
    """One kind of result, `ROOT/out` unless said otherwise. ``run(root, new, resume)`` makes the old or the ``new`` one;
    ``problem(root)`` says what is wrong with what lies there after a kill, or ""; ``content(root)`` is what decides whether two
    results are the same."""

    resumes = False

    def plant(self, root: Path) -> None:
        """The user's files, after the old result is there."""
        for name in BESIDE:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(f"mine: {name}")

    def run(self, root: Path, new: bool, resume: bool) -> None:
        """Make a result."""
        raise NotImplementedError

    def problem(self, root: Path) -> str:
        """What is wrong after a kill."""
        raise NotImplementedError

    def content(self, root: Path):
        """The result."""
        raise NotImplementedError


class Bake(Job):
    """A bake with checkpoints: with the technique of numbers, or with real probes."""

    resumes = True

    def __init__(self, technique: str):
        self._technique = technique
        self._settings = {"probes": {"rays": 64, "order": 1}, "tiny": {"order": 1}}[technique]

    def run(self, root, new, resume):
        """See Job."""
        scene = closed_box(resolution=(2, 2, 3) if new else (2, 2, 2))
        bake_scene(scene, self._technique, self._settings, root / "out", seed=int(new), resume=resume, checkpoint_seconds=0.0,
                   threads=1)

    def problem(self, root):
        """See Job."""
        try:
            content = self.content(root)
        except BakeError as error:
            return f"no whole bundle: {error}"
        return "" if content in (reference(self, root, False), reference(self, root, True)) else "neither the old nor the new one"

    def content(self, root):
        """See Job."""
        bundle = read_bundle(root / "out")
        light = [(grid.volume.name, grid.volume.resolution, grid.sh.tobytes(), grid.visibility.tobytes()) for grid in bundle.grids]
        return light, bundle.manifest["sha256"]


class Export(Job):
    """An export into a folder where a user works, whole or only its part for projects."""

    def __init__(self, engine: str, part: str):
        self._engine, self._part = engines.get(engine), part

    def plant(self, root):
        """See Job."""
        super().plant(root)
        for name in ("out/mine.txt", "out/rtgi/mine.uid", "out/.godot/cache", "out/rtgi/Known/notes"):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(f"mine: {name}")
        edited = root / ("out/README.md" if self._part == "all" else "out/rtgi/LICENSE.txt")
        edited.write_text(edited.read_text() + "my own words")

    def run(self, root, new, resume):
        """See Job."""
        grids = kit_field().grids()
        if new:
            grids = tuple(replace(grid, sh=grid.sh * np.float32(2.0)) for grid in grids[:-1])
        bundle = Bundle(Path("kit"), {"scene": "Kit", "includes_direct": False}, grids)
        self._engine.export(bundle, root / "out", ExportSettings(conformance=False, part=self._part))

    def problem(self, root):
        """See Job: where an index leads to the other files, they are of one export."""
        found = self.content(root)
        if not any(f"out/{name}" in found for name in self._engine.indices):
            return ""
        halves = [{name for name, data in found.items() if name.startswith("out/rtgi/") and data != whole.get(name)}
                  for whole in (reference(self, root, False), reference(self, root, True))]
        return "" if not all(halves) else f"an old and a new half: {sorted(halves[0] & halves[1]) or halves}"

    def content(self, root):
        """See Job."""
        return {path.relative_to(root).as_posix(): path.read_bytes() for path in (root / "out").rglob("*") if path.is_file()}


class Chart(Job):
    """A chart of a technique that is wrong by a known amount."""

    resumes = True

    def plant(self, root):
        """See Job."""
        super().plant(root)
        (root / "out/notes.txt").write_text("mine")

    def run(self, root, new, resume):
        """See Job."""
        emission = 1.0 if new else 0.5
        scene = cube_furnace(albedo=0.5, emission=emission, resolution=(2, 2, 2))
        chart_scene(scene, root / "out", ["offset"], seeds=1, points=4, normals_per_point=1, probes=2, noise=0.2, threads=1,
                    maps=new, reference=Furnace(2.0 * emission), resume=resume)

    def problem(self, root):
        """See Job."""
        return ""

    def content(self, root):
        """See Job."""
        chart = json.loads((root / "out/chart.json").read_text())
        runs = [[{place: run["errors"][place] for place in run["errors"]} for run in point["runs"]] for point in chart["points"]]
        # What holds times is another every time.
        timed = {"chart.json", "chart.md", "chart.png", "chart.svg"}
        files = {path.name: path.read_bytes() if path.name not in timed else b"" for path in (root / "out").iterdir()}
        return runs, chart["complete"], chart["reference"], files, set(chart["sha256"])


class Stability(Job):
    """A report on a case that measures nothing."""

    resumes = True

    def plant(self, root):
        """See Job."""
        super().plant(root)
        (root / "out/notes.txt").write_text("mine")

    def run(self, root, new, resume):
        """See Job."""
        run_stability(root / "out", cases=["made-up"], techniques=None if new else ["probes"], seed=int(new), resume=resume)

    def problem(self, root):
        """See Job."""
        return ""

    def content(self, root):
        """See Job."""
        report = json.loads((root / "out/stability.json").read_text())
        return [(case["technique"], case["figure"], case["samples"]) for case in report["cases"]], report["complete"], \
            sorted(path.name for path in (root / "out").iterdir())


class Picture(Job):
    """A picture."""

    def run(self, root, new, resume):
        """See Job."""
        write_png(root / "out", np.full((20, 30, 3), 200 if new else 50, np.uint8))

    def problem(self, root):
        """See Job."""
        try:
            require_whole_png(root / "out", (20, 30))
        except BakeError as error:
            return str(error)
        return "" if self.content(root) in (reference(self, root, False), reference(self, root, True)) else "another picture"

    def content(self, root):
        """See Job."""
        return (root / "out").read_bytes()


JOBS: dict[str, Job] = {
    "bake": Bake("tiny"), "probes": Bake("probes"), "godot": Export("godot", "all"), "godot part": Export("godot", "files"),
    "threejs": Export("threejs", "all"), "chart": Chart(), "stability": Stability(), "picture": Picture()}

_references: dict[tuple[int, bool], object] = {}


def prepare(job: Job, root: Path) -> None:
    """The old result and the user's files in the empty folder ``root``."""
    job.run(root, False, False)
    job.plant(root)


def reference(job: Job, root: Path, new: bool):
    """The result in a folder like ``root`` that nobody disturbed."""
    key = id(job), new
    if key not in _references:
        place = root.parent / f"reference-{id(job)}-{new}"
        place.mkdir()
        prepare(job, place)
        if new:
            job.run(place, True, False)
        _references[key] = job.content(place)
        shutil.rmtree(place)
    return _references[key]
