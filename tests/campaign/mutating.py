"""Mutations: everything that is read back is changed, from a bit to another kind of file in its place. Held to: a change of a
bundle is refused by one clear line, whatever it is; reading writes nothing; what is not refused gives what it gave before, or keeps
to its schema where the checksums were made right; nothing hangs, fails in a way of Python's own, or takes more than it may.
"""

import hashlib
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from changes import changed_bytes, changed_image, changed_json, reseal_manifest
from common import Tally, differences, rng_of, snapshot, stamps
from company import held
from jobs import JOBS, prepare, ready, reference
from kills import run_apart
from scene_builders import closed_box

from rtgi_addon.effects.spheres.settings import SphereSettings
from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import check_target, read_bundle
from rtgi_addon.exchange.series import INDEX, read_series
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.chart import check_chart
from rtgi_addon.jobs.export import export_bundle
from rtgi_addon.jobs.series import bake_series
from rtgi_addon.scene import DensityGrid, Medium
from rtgi_addon.scene.sphere_probe import SphereProbe
from rtgi_addon.storage.workplace import workplace

# What a read may ask of memory above what the process has.
ALLOWANCE = 1 << 30
REFUSED, ACCEPTED = "refused", "accepted"


class Mutating:
    """Trials by number, in the folder ``place``."""

    def __init__(self, seed: int, place: Path):
        ready()
        self.seed, self._place = seed, place
        self._kinds = {"manifest": self._manifest, "manifest, sealed again": self._sealed_manifest, "image": self._image,
                       "image, sealed again": self._sealed_image, "another kind of file": self._another_kind,
                       "checkpoint": self._checkpoint, "export marker": self._marker, "workplace": self._workplace,
                       "report": self._report, "series": self._series}
        self._weights = np.array([5, 4, 4, 4, 1, 3, 2, 1, 1, 1], np.float64)
        self._template = place / "template"
        self._make_template()
        self._standing, self._stamps = place / "standing", None

    def _make_template(self) -> None:
        root = self._template
        root.mkdir()
        # What absorbs alone is as many files, and no walk that surfaces around the sphere would begin.
        smoke = Medium("smoke", absorption=np.ones(3), grid=DensityGrid(np.eye(4), np.ones((2, 2, 2), np.float32)))
        room = replace(closed_box(resolution=(2, 2, 2)), media=(Medium("fog", absorption=np.full(3, 0.1)), smoke),
                       spheres=(SphereProbe("ball", np.eye(4)),))
        bake_scene(room, "lpv", {"resolution": 8, "cascades": 1}, root / "bundle", threads=1,
                   spheres=SphereSettings(resolution="32", rays=1))
        JOBS["bake"].run(root, False, False)
        (root / "series").mkdir()
        bake_series(lambda frame, _: closed_box(intensity=float(frame), resolution=(2, 2, 2)), range(1, 3), "tiny", {},
                    root / "series/out", frames_per_second=lambda: 24.0, threads=1)
        (root / "export").mkdir()
        JOBS["threejs"].run(root / "export", False, False)
        JOBS["threejs"].plant(root / "export")
        (root / "chart").mkdir()
        JOBS["chart"].run(root / "chart", False, False)
        # A bake that was killed in the middle of its work, and one while it was put in place.
        for name, wanted in (("part", "*.part"), ("commit", "commit.json")):
            (root / name).mkdir()
            prepare(JOBS["bake"], root / name)
            at = 0
            while not list((root / name).glob(f"out.partial/{wanted}")):
                at += 3
                run_apart(lambda name=name: JOBS["bake"].run(root / name, True, True) and None, root / name, at=at)
                assert at < 1000
        reference(JOBS["bake"], root, True)
        self._bundle = _figures(root / "bundle")

    def trial(self, number: int, tally: Tally) -> None:
        """Change one thing and look what becomes of it."""
        rng = rng_of("mutations", self.seed, number)
        kind = str(rng.choice(list(self._kinds), p=self._weights / self._weights.sum()))
        root = self._place / f"trial-{number}"
        root.mkdir()

        def find(what: str) -> None:
            tally.findings.append((number, f"{kind}: {what}"))

        try:
            self._kinds[kind](root, rng, number, tally, find)
        finally:
            shutil.rmtree(root, ignore_errors=True)
        tally.count("mutations")
        tally.count(f"of {kind}")

    def _copy(self, root: Path, name: str) -> Path:
        shutil.copytree(self._template / name, root / name, symlinks=True)
        return root / name

    def _whole_bundle(self) -> Path:
        """A bundle as it was baked: the one of the trial before, with whatever was changed in it put right."""
        if stamps(self._standing) != self._stamps:
            whole = self._template / "bundle"
            for name, stamp in stamps(self._standing).items():
                path = self._standing / name
                if name.endswith("/") and not (whole / name).is_dir():
                    shutil.rmtree(path)
                elif not name.endswith("/") and (self._stamps is None or stamp != self._stamps.get(name)):
                    path.unlink()
            for source in sorted(whole.rglob("*")):
                path = self._standing / source.relative_to(whole)
                if source.is_dir():
                    path.mkdir(parents=True, exist_ok=True)
                elif not os.path.lexists(path):
                    path.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(source, path)
            self._stamps = stamps(self._standing)
        return self._standing

    def _look(self, act, number: int, tally: Tally, find) -> tuple[str, object]:
        """What ``act()`` comes to: REFUSED with the line, ACCEPTED with its result, or a finding."""
        what, result = "", None
        with held(ALLOWANCE) as costs:
            try:
                what, result = ACCEPTED, act()
            except BakeError as error:
                what, result = REFUSED, str(error)
            except Exception as error:
                # With it go the frames that hold what was read.
                failure = f"{type(error).__name__}: {error}"
        tally.costs(number, costs.seconds, costs.peak_bytes)
        if not what:
            find(failure)
            return what, result
        if what == REFUSED and ("\n" in result or ": " not in result):
            find(f"not one clear line: {result!r}")
        tally.count(what)
        return what, result

    def _read(self, bundle: Path, number: int, tally: Tally, find) -> tuple[str, object]:
        """Read the bundle in each way there is; it must stay as it is."""
        before = stamps(bundle)
        found = self._look(lambda: _figures(bundle), number, tally, find)
        written = differences(before, stamps(bundle))
        if written:
            find(f"reading changed {written}")
        return found

    def _manifest(self, root, rng, number, tally, find) -> None:
        path = self._whole_bundle() / "bake.json"
        data = path.read_bytes()
        mutated = (changed_json if rng.random() < 0.5 else changed_bytes)(data, rng)
        path.write_bytes(mutated)
        what, _ = self._read(self._standing, number, tally, find)
        if what == ACCEPTED and mutated.replace(b"\r\n", b"\n") != data:
            find("a changed manifest was accepted")
        if what == REFUSED:
            self._not_replaced(number, tally, find)

    def _not_replaced(self, number, tally, find) -> None:
        """A bundle that cannot be read is not baked over either."""
        what, _ = self._look(lambda: str(check_target(self._standing)), number, tally, find)
        if what == ACCEPTED:
            find("a bundle that cannot be read would be replaced")

    def _sealed_manifest(self, root, rng, number, tally, find) -> None:
        path = self._whole_bundle() / "bake.json"
        path.write_bytes(reseal_manifest(changed_json(path.read_bytes(), rng)))
        what, figures = self._read(self._standing, number, tally, find)
        if what == ACCEPTED and [part[1:] for part in figures] != [part[1:] for part in self._bundle]:
            find("another resolution, place or light was accepted")
        if what == ACCEPTED and rng.random() < 0.2:
            self._look(lambda: str(export_bundle(self._standing, "threejs", root / "export", conformance=False).out), number, tally,
                       find)

    def _image_of(self, bundle: Path, rng) -> Path:
        images = sorted(bundle.rglob("*.exr"))
        return images[int(rng.integers(len(images)))]

    def _image(self, root, rng, number, tally, find) -> None:
        path = self._image_of(self._whole_bundle(), rng)
        data = path.read_bytes()
        path.write_bytes(changed_image(data, rng))
        what, _ = self._read(self._standing, number, tally, find)
        if what == ACCEPTED and path.read_bytes() != data:
            find(f"a changed {path.name} was accepted")
        if what == REFUSED and rng.random() < 0.1:
            self._not_replaced(number, tally, find)

    def _sealed_image(self, root, rng, number, tally, find) -> None:
        bundle = self._whole_bundle()
        path = self._image_of(bundle, rng)
        path.write_bytes(changed_image(path.read_bytes(), rng))
        manifest, name = json.loads((bundle / "bake.json").read_bytes()), path.relative_to(bundle).as_posix()
        manifest["sha256"][name], manifest["bytes"][name] = hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_size
        (bundle / "bake.json").write_bytes(reseal_manifest((json.dumps(manifest, indent=1) + "\n").encode()))
        what, figures = self._read(self._standing, number, tally, find)
        if what == ACCEPTED and [part[1:3] for part in figures] != [part[1:3] for part in self._bundle]:
            find("another resolution or place was accepted")

    def _another_kind(self, root, rng, number, tally, find) -> None:
        """Something that is no file, or a huge one, in the place of a file."""
        bundle = self._whole_bundle()
        files = [bundle / "bake.json", *sorted(bundle.rglob("*.exr"))]
        path = files[int(rng.integers(len(files)))]
        path.unlink()
        kind = int(rng.integers(8))
        if kind == 0:
            os.mkfifo(path)
        elif kind == 1:
            path.mkdir()
        elif kind == 2:
            path.symlink_to(path)
        elif kind == 3:
            path.symlink_to("/dev/zero")
        elif kind == 4:
            with open(path, "wb") as file:
                file.truncate(1 << 36)
        elif kind == 5:
            (root / "elsewhere").write_bytes((self._template / "bundle" / path.relative_to(bundle)).read_bytes())
            path.symlink_to(root / "elsewhere")
        elif kind == 6:
            path.symlink_to("/dev/tty")
        what, _ = self._look(lambda: _figures(bundle), number, tally, find)
        if what == ACCEPTED and kind != 5:
            find(f"{path.name} was accepted as kind {kind}")

    def _checkpoint(self, root, rng, number, tally, find) -> None:
        """A run goes on from a changed checkpoint: it is refused, or the outcome is the one that it always is."""
        place = self._copy(root, "part")
        files = sorted([*place.glob("out.partial/*.part"), place / "out.partial/checkpoint.json"])
        path = files[int(rng.integers(len(files)))]
        data = path.read_bytes()
        as_text = path.suffix == ".json" and rng.random() < 0.6
        path.write_bytes((changed_json if as_text else changed_bytes)(data, rng))
        self._finish(place, True, number, tally, find)

    def _finish(self, place: Path, resume: bool, number, tally, find) -> None:
        job, before = JOBS["bake"], snapshot(place)
        mine = {name: what for name, what in before.items() if not name.startswith(("out/", "out.partial/"))}
        what, _ = self._look(lambda: job.run(place, True, resume), number, tally, find)
        after = snapshot(place)
        lost = differences(mine, {name: after.get(name, "gone") for name in mine})
        if lost:
            find(f"files of the user, {lost}")
        problem = job.problem(place)
        if problem and not (place / "out.partial/old").exists():
            find(problem)
        if what == ACCEPTED and job.content(place) != reference(job, place, True):
            find("another result was accepted")

    def _marker(self, root, rng, number, tally, find) -> None:
        """An export over one whose marker was changed: files of the user stay, whatever it says."""
        place = self._copy(root, "export")
        markers = sorted(place.glob("out/**/rtgi_export.json"))
        path = markers[int(rng.integers(len(markers)))]
        path.write_bytes((changed_json if rng.random() < 0.7 else changed_bytes)(path.read_bytes(), rng))
        before = snapshot(place)
        mine = {name: what for name, what in before.items() if not name.endswith("/") and name not in _ours(self._template)}
        what, _ = self._look(lambda: JOBS["threejs"].run(place, True, False), number, tally, find)
        after = snapshot(place)
        lost = differences(mine, {name: after.get(name, "gone") for name in mine})
        if lost:
            find(f"files of the user, {lost}")
        if what == REFUSED and differences(before, after):
            find(f"refused, and changed {differences(before, after)}")

    def _workplace(self, root, rng, number, tally, find) -> None:
        """What says how far an exchange is, whose a folder is and what was written there."""
        place = self._copy(root, str(rng.choice(["commit", "part"])))
        files = sorted(path for path in place.glob("out.partial/*") if path.suffix in (".json", ".txt"))
        path = files[int(rng.integers(len(files)))]
        path.write_bytes((changed_json if rng.random() < 0.5 else changed_bytes)(path.read_bytes(), rng))
        with workplace(root / "unused", "test"):
            pass
        self._finish(place, bool(rng.random() < 0.5), number, tally, find)

    def _report(self, root, rng, number, tally, find) -> None:
        place = self._copy(root, "chart")
        path = place / "out/chart.json"
        path.write_bytes((changed_json if rng.random() < 0.7 else changed_bytes)(path.read_bytes(), rng))
        before = snapshot(place)
        self._look(lambda: str(check_chart(place / "out")), number, tally, find)
        if differences(before, snapshot(place)):
            find("looking changed something")


    def _series(self, root, rng, number, tally, find) -> None:
        place = self._copy(root, "series")
        path = place / "out" / INDEX
        path.write_bytes((changed_json if rng.random() < 0.7 else changed_bytes)(path.read_bytes(), rng))
        before = snapshot(place)

        def look() -> str:
            series = read_series(place / "out")
            assert all(bundle.parent == place / "out" for bundle in series.bundles), "a bundle elsewhere"
            return str((series, [series.at(frame) for frame in (-5, 1, 9)], series.wanted[:2]))

        self._look(look, number, tally, find)
        if differences(before, snapshot(place)):
            find("looking changed something")


def _figures(bundle: Path) -> list[tuple]:
    """What a bundle holds, read in every way: by volume its name, resolution, place and light."""
    found = read_bundle(bundle)
    for grid in found.grids:
        for values in (grid.sh, grid.visibility, grid.validity, grid.offset_world):
            assert np.isfinite(values).all(), "values that are not finite"
    assert found.field.irradiance(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32)).shape == (1, 3)
    return [(grid.volume.name, grid.volume.resolution, np.asarray(grid.volume.world_from_local).tolist(),
             hashlib.sha256(grid.sh.tobytes()).hexdigest()) for grid in found.grids]


_known: dict[Path, set[str]] = {}


def _ours(template: Path) -> set[str]:
    """Names of what an export of ours wrote, and the user did not change."""
    if template not in _known:
        files = [path for path in (template / "export/out").rglob("*") if path.is_file()]
        names = {path.relative_to(template / "export").as_posix() for path in files}
        mine = {name for name in names if b"mine" in (template / "export" / name).read_bytes()[:40]}
        _known[template] = names - mine - {"out/README.md"}
    return _known[template]
