"""three.js: one .json and one .bin of probes, a loader with a hook for lit materials and a twin on the CPU, and pages for both.

`export/` holds what every export gets as it is: plain ES modules that need no bundler. The loader's look-up on the GPU and the one
on the CPU are twins of `techniques/probes/lookup.py`; `conformance.html` and `conformance.mjs` hold them to it.
"""

import json
import shutil
from pathlib import Path

from ....errors import BakeError
from ....progress import Progress
from ....techniques.probes.field import ProbeField
from ...bundle import Bundle
from .. import conformance
from ..axes import Y_UP
from ..base import Engine, ExportSettings, copy_files, write_text
from ..volumes import engine_field, export_volumes, notes_on_order
from .light_probe import light_probe_case
from .probes_file import write_probes

_FILES = Path(__file__).parent / "export"
_FOR_EVERY = ("README.md", "package.json", "index.html", "demo.js", "rtgi/RTGIProbeVolumes.js", "rtgi/RTGIProbeVolumes.d.ts",
              "rtgi/RTGIProbeLight.js", "rtgi/RTGIProbeLight.d.ts", "rtgi/lookup.js", "rtgi/shader.js")
_FOR_CONFORMANCE = ("conformance.mjs", "conformance.html", "conformance/compare.js", "conformance/draw.js",
                    "conformance/webgl.js", "conformance/webgpu.js")
_MODEL = "model.glb"
# What the smallest WebGL 2 promises of uniforms leaves room for; RTGIProbeVolumes.js says the same.
MOST_VOLUMES = 16


class ThreeJs(Engine):
    """three.js, which itself is no part of an export: npm puts it into `node_modules` there."""

    name, title, description = "threejs", "three.js", "Probe volumes for WebGL and WebGPU: loader, materials, light probe, demo"
    axes = Y_UP
    aliases = ("three", "three.js")
    leftovers = ("node_modules/*", "package-lock.json")
    parts = ("rtgi",)

    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """See ``Engine.write``."""
        if len(bundle.grids) > MOST_VOLUMES:
            raise BakeError(f"{len(bundle.grids)} volumes are more than the {MOST_VOLUMES} that a shader of WebGL has room for",
                            "bake some of them into a bundle of their own with --volume")
        field, scene = engine_field(bundle), bundle.manifest["scene"]
        progress.step(0.1, "Writing probes")
        write_probes(folder / "probes.json", field, export_volumes(field, self.axes), scene)
        progress.step(0.4, "Writing the loader and its pages")
        _copy(_FOR_EVERY, folder)
        if settings.model is not None:
            shutil.copyfile(settings.model, folder / _MODEL)
        write_text(folder / "demo.json", json.dumps({"model": None if settings.model is None else _MODEL}) + "\n")
        if settings.conformance:
            progress.step(0.5, "Writing the conformance kit")
            self._write_conformance(field, folder)
        return notes_on_order(bundle)

    def _write_conformance(self, field: ProbeField, folder: Path) -> None:
        _copy(_FOR_CONFORMANCE, folder)
        kit = conformance.kit_field()
        write_probes(folder / "conformance" / "kit.json", kit, export_volumes(kit, self.axes), "RTGI's conformance kit")
        content = conformance.to_json(field, self.axes)
        content["lightProbe"] = light_probe_case(field, self.axes)
        write_text(folder / "conformance" / "conformance.json", json.dumps(content) + "\n")


def _copy(names, folder: Path) -> None:
    for name in names:
        copy_files((_FILES / name).parent, (folder / name).parent, [Path(name).name])


ENGINE = ThreeJs()
