"""three.js: one .json and one .bin of probes, a loader with a hook for lit materials and a twin on the CPU, and pages for both.

`export/` holds what every export gets as it is: plain ES modules that need no bundler; `rtgi/weights.js` is written here, of the
functions that all our shaders share. The loader's look-ups (WebGL, nodes, CPU) are twins of `techniques/lattice/lookup.py`;
`conformance.html` and `conformance.mjs` hold them to it.
"""

import json
from pathlib import Path

from ....errors import BakeError
from ....progress import Progress
from ....storage.writing import copy_file
from ....techniques.lattice.field import ProbeField
from ...bundle import Bundle
from .. import conformance
from ..atlas import EngineAtlas, engine_atlas, kit_atlas, notes_on_atlas
from ..atlas import conformance_json as atlas_json
from ..atlas_transfer import conformance_json as atlas_relight_json
from ..atlas_transfer import engine_atlas_transfer, kit_atlas_transfer
from ..axes import Y_UP
from ..base import Engine, ExportSettings, copy_files, write_text
from ..glsl import shared_glsl
from ..kit import kit_field
from ..media import EngineMedia, engine_media
from ..media_conformance import kit_media
from ..media_conformance import to_json as media_json
from ..sky import SKY, write_sky
from ..spheres import EngineSpheres, conformance_json, engine_spheres, kit_spheres, notes_on_spheres
from ..transfer import EngineTransfer, engine_transfer, notes_on_transfer, tables_of
from ..transfer_conformance import kit_transfer
from ..transfer_conformance import to_json as transfer_json
from ..volumes import engine_field, export_volumes, notes_on_order, notes_on_places
from ..voxels import EngineVoxels, engine_voxels, kit_voxels, notes_on_voxels
from ..voxels import conformance_json as voxels_json
from .atlas_file import TEXCOORDS, write_atlas_files
from .light_probe import light_probe_case
from .media_file import write_media_files
from .probes_file import write_probes
from .spheres_file import write_sphere_files
from .style_file import notes_on_style, write_style_files, write_style_kit
from .transfer_file import relight_module, write_transfer_files
from .voxels_file import write_voxel_files

_FILES = Path(__file__).parent / "export"
_FOR_EVERY = ("package.json", "index.html", "demo.js", "rtgi/RTGIProbeVolumes.js", "rtgi/RTGIProbeVolumes.d.ts",
              "rtgi/RTGIProbeLight.js", "rtgi/RTGIProbeLight.d.ts", "rtgi/lookup.js", "rtgi/shader.js",
              "rtgi/hook.js")
_FOR_CONFORMANCE = ("conformance.mjs", "conformance.html", "conformance/compare.js", "conformance/draw.js",
                    "conformance/webgl_renderer.js", "conformance/webgl.js", "conformance/webgpu.js")
# Where there are media besides.
_FOR_MEDIA, _FOR_MEDIA_CONFORMANCE = ("rtgi/RTGIMedia.js", "rtgi/RTGIMedia.d.ts"), ("media.mjs",)
_FOR_STYLE, _FOR_STYLE_CONFORMANCE = ("rtgi/RTGIStyle.js", "rtgi/RTGIStyle.d.ts"), ("style.html", "conformance/style.js")
_FOR_SPHERES, _FOR_SPHERES_CONFORMANCE = ("rtgi/RTGISpheres.js", "rtgi/RTGISpheres.d.ts"), ("spheres.mjs",)
_FOR_ATLAS, _FOR_ATLAS_CONFORMANCE = ("rtgi/RTGIAtlas.js", "rtgi/RTGIAtlas.d.ts"), ("atlas.mjs", "conformance/webgl_atlas.js")
_FOR_ATLAS_RELIGHT_CONFORMANCE = ("atlas_relight.mjs", "conformance/atlas_relight.js")
_FOR_VOXELS = ("rtgi/RTGIVoxels.js", "rtgi/RTGIVoxels.d.ts", "rtgi/voxel_lookup.js")
_FOR_VOXELS_CONFORMANCE = ("conformance/webgl_voxels.js", "voxels.mjs")
_SPHERES_README = """
{number}. Mirrors: `probes.addMirrors(await loadSpheres('rtgi/spheres.json'))` of `rtgi/RTGISpheres.js`, before
   `probes.apply(model)`: materials of WebGLRenderer then show what sphere probes saw. `node spheres.mjs` holds them to RTGI's
   numbers.
"""
_ATLAS_README = """
{number}. Light atlas: `probes.addAtlas(await loadAtlas('rtgi/atlas.json'))` of `rtgi/RTGIAtlas.js`, before `probes.apply(model)`:
   materials of WebGLRenderer then light the objects in it at the texels of their UV map. `node atlas.mjs` holds it to RTGI's
   numbers. With day and night it follows the light, if its bake knows how (`node atlas_relight.mjs`).
   Deutsch: Objekte im Lichtatlas werden statt von den Sonden von den Texeln ihrer UV-Map beleuchtet: `probes.addAtlas(…)` vor
   `probes.apply(model)` aufrufen.
"""
_VOXELS_README = """
{number}. Voxels: `(await loadVoxels('rtgi/voxels.json')).apply(model)` of `rtgi/RTGIVoxels.js` lights materials of WebGLRenderer by
   cones through the scene's voxels, pixel by pixel, in place of the probes. `conformance.html?voxels` holds them to RTGI's
   numbers, and `node voxels.mjs` their look-up on the CPU.
   Deutsch: `apply(model)` beleuchtet Materialien statt mit den Sonden mit Kegeln durch die Voxel der Szene, Pixel für Pixel.
"""
_FOR_TRANSFER = ("day.js", "rtgi/RTGIRelight.js", "rtgi/RTGIRelight.d.ts")
_FOR_TRANSFER_CONFORMANCE = ("relight.mjs", "conformance/relight.js", "conformance/webgl_relight.js",
                              "conformance/webgpu_relight.js")
_MEDIA_README = """
{number}. Fog and smoke: `const view = new RTGIMediaView(await loadMedia('rtgi/media.json'))` of `rtgi/RTGIMedia.js`, and
   `view.render(renderer, scene, camera)` instead of the renderer's own. `node media.mjs` holds them to RTGI's numbers.
"""
_STYLE_README = """
{number}. Style: `const style = await loadStyle('rtgi/style.json')` of `rtgi/RTGIStyle.js`; `style.apply(model)` after the probes'
   and `new RTGIStyleView(style).render(renderer, scene, camera)` instead of the renderer's own. `style.html` compares its lines.
"""
_TRANSFER_README = """
{number}. Day and night: `const relight = await loadRelight('rtgi/transfer.json', probes)` of `rtgi/RTGIRelight.js`, then
   `relight.setSun(azimuth, elevation, color)`, `relight.factors.NAME = 0.5`, and `relight.update(renderer)` every frame: an eighth
   of the probes follows each time. Add a DirectionalLight for what the sun lights directly. `index.html` has a slider for the time
   of day; `node relight.mjs` and `conformance.html?relight` hold it to `rtgi relight`. With WebGPURenderer call `relight.update()`.
   Deutsch: Tag und Nacht ohne neues Backen. `index.html` hat Regler für Uhrzeit, Himmel und Lichtgruppen; im eigenen Spiel
   `relight.setSun(Azimut, Höhe, Farbe)` setzen und `relight.update(renderer)` in jedem Bild aufrufen.
"""
_MODEL = "model.glb"
# What the loader and the pages of the kit open first.
PROBES, KIT, EXPECTED = "rtgi/probes.json", "conformance/kit.json", "conformance/conformance.json"
MEDIA, MEDIA_KIT, MEDIA_EXPECTED = "rtgi/media.json", "conformance/kit_media.json", "conformance/media.json"
STYLE = "rtgi/style.json"
SPHERES, SPHERES_KIT, SPHERES_EXPECTED = "rtgi/spheres.json", "conformance/kit_spheres.json", "conformance/spheres.json"
ATLAS, ATLAS_KIT, ATLAS_EXPECTED = "rtgi/atlas.json", "conformance/kit_atlas.json", "conformance/atlas.json"
ATLAS_RELIT = "conformance/atlas_relight.json"
# Layers of a texture that drivers of WebGL 2 commonly have.
_MOST_LAYERS = 2048
VOXELS, VOXELS_KIT, VOXELS_EXPECTED = "rtgi/voxels.json", "conformance/kit_voxels.json", "conformance/voxels.json"
TRANSFER, TRANSFER_KIT, TRANSFER_EXPECTED = "rtgi/transfer.json", "conformance/kit_transfer.json", "conformance/relight.json"
# What the smallest WebGL 2 promises of uniforms leaves room for; RTGIProbeVolumes.js says the same.
MOST_VOLUMES = 16


class ThreeJs(Engine):
    """three.js, which itself is no part of an export: npm puts it into `node_modules` there."""

    name, title, description = "threejs", "three.js", "Probe volumes for WebGL and WebGPU: loader, materials, light probe, demo"
    axes = Y_UP
    aliases = ("three", "three.js")
    parts = ("rtgi",)
    styles = True
    scattered = True
    indices = (PROBES, KIT, EXPECTED, MEDIA, MEDIA_KIT, MEDIA_EXPECTED, STYLE, TRANSFER, TRANSFER_KIT,
               TRANSFER_EXPECTED, SPHERES, SPHERES_KIT, SPHERES_EXPECTED, ATLAS, ATLAS_KIT, ATLAS_EXPECTED, ATLAS_RELIT,
               VOXELS, VOXELS_KIT, VOXELS_EXPECTED)

    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """See ``Engine.write``."""
        if len(bundle.grids) > MOST_VOLUMES:
            raise BakeError(f"{len(bundle.grids)} volumes are more than the {MOST_VOLUMES} that a shader of WebGL has room for",
                            "bake some of them into a bundle of their own with --volume")
        field, scene = engine_field(bundle), bundle.manifest["scene"]
        progress.step(0.1, "Writing probes")
        write_probes(folder / PROBES, export_volumes(field, self.axes), scene, bundle.manifest)
        progress.step(0.4, "Writing the loader and its pages")
        _copy(_FOR_EVERY, folder)
        write_text(folder / "rtgi" / "weights.js", _module(shared_glsl()))
        if settings.model is not None:
            copy_file(settings.model, folder / _MODEL)
        demo = {"model": None if settings.model is None else _MODEL}
        # The panoramas of three.js have +X in their middle.
        sky_scale = None if settings.model is None else write_sky(folder, settings.sky, self.axes, -0.25)
        if sky_scale is not None:
            demo |= {"sky": SKY, "skyScale": sky_scale}
        media = engine_media(bundle.media, field, self.axes)
        readme = (_FILES / "README.md").read_text(encoding="utf-8").rstrip()
        transfer, sections = engine_transfer(bundle, self.axes), []
        if media is not None:
            _copy(_FOR_MEDIA, folder)
            write_media_files(folder / MEDIA, media)
            sections.append(_MEDIA_README)
            demo["media"] = MEDIA
        if settings.style is not None:
            _copy(_FOR_STYLE, folder)
            write_style_files(folder / STYLE, settings.style)
            sections.append(_STYLE_README)
            demo["style"] = STYLE
        if transfer is not None:
            _copy(_FOR_TRANSFER, folder)
            write_transfer_files(folder / TRANSFER, transfer)
            write_text(folder / "rtgi" / "relit.js", relight_module())
            sections.append(_TRANSFER_README)
            demo["relight"] = TRANSFER
        spheres = engine_spheres(bundle.spheres, self.axes)
        if spheres is not None:
            _copy(_FOR_SPHERES, folder)
            write_sphere_files(folder / SPHERES, spheres)
            sections.append(_SPHERES_README)
            demo["spheres"] = SPHERES
        atlas = engine_atlas(bundle.atlas, self.axes)
        relit, told = engine_atlas_transfer(atlas, None if transfer is None else transfer.source, self.axes, _MOST_LAYERS)
        if atlas is not None:
            _copy(_FOR_ATLAS, folder)
            write_atlas_files(folder / ATLAS, atlas, relit)
            sections.append(_ATLAS_README)
            demo["atlas"] = ATLAS
        voxels = engine_voxels(bundle.voxels, self.axes)
        if voxels is not None:
            _copy(_FOR_VOXELS, folder)
            write_voxel_files(folder / VOXELS, voxels)
            sections.append(_VOXELS_README)
        readme += "".join(text.format(number=9 + index).rstrip() for index, text in enumerate(sections))
        write_text(folder / "README.md", readme + "\n")
        write_text(folder / "demo.json", json.dumps(demo) + "\n")
        if settings.conformance:
            progress.step(0.5, "Writing the conformance kit")
            self._write_conformance(field, media, spheres, atlas, relit is not None, folder)
            if transfer is not None:
                self._write_relight_conformance(field, transfer, folder)
            if relit is not None:
                _copy(_FOR_ATLAS_RELIGHT_CONFORMANCE, folder)
                write_atlas_files(folder / ATLAS_KIT, kit_atlas(), kit_atlas_transfer(self.axes))
                write_text(folder / ATLAS_RELIT, json.dumps(atlas_relight_json(atlas, relit, transfer.source, self.axes)) + "\n")
            if voxels is not None:
                self._write_voxels_conformance(voxels, folder)
            if settings.style is not None:
                _copy(_FOR_STYLE_CONFORMANCE, folder)
                write_style_kit(folder / "conformance")
        return [*notes_on_order(bundle), *notes_on_places(bundle), *notes_on_media(media), *notes_on_style(settings.style),
                *notes_on_transfer(transfer),
                *notes_on_spheres(spheres, transfer), *notes_on_atlas(atlas, TEXCOORDS, "three.js"), *told,
                *notes_on_voxels(voxels)]

    def _write_conformance(self, field: ProbeField, media: EngineMedia | None, spheres: EngineSpheres | None,
                           atlas: EngineAtlas | None, relit_atlas: bool, folder: Path) -> None:
        _copy(_FOR_CONFORMANCE, folder)
        write_probes(folder / KIT, export_volumes(kit_field(), self.axes), "RTGI's conformance kit", {})
        content = conformance.to_json(field, self.axes)
        content |= {"lightProbe": light_probe_case(field, self.axes), "spheres": spheres is not None, "atlas": atlas is not None,
                    "relitAtlas": relit_atlas}
        write_text(folder / EXPECTED, json.dumps(content) + "\n")
        if media is not None:
            _copy(_FOR_MEDIA_CONFORMANCE, folder)
            write_media_files(folder / MEDIA_KIT, kit_media(self.axes))
            write_text(folder / MEDIA_EXPECTED, json.dumps(media_json(media, self.axes)) + "\n")
        if spheres is not None:
            _copy(_FOR_SPHERES_CONFORMANCE, folder)
            write_sphere_files(folder / SPHERES_KIT, kit_spheres(self.axes))
            write_text(folder / SPHERES_EXPECTED, json.dumps(conformance_json(spheres)) + "\n")
        if atlas is not None:
            _copy(_FOR_ATLAS_CONFORMANCE, folder)
            write_atlas_files(folder / ATLAS_KIT, kit_atlas())
            write_text(folder / ATLAS_EXPECTED, json.dumps(atlas_json(atlas)) + "\n")

    def _write_voxels_conformance(self, voxels: EngineVoxels, folder: Path) -> None:
        _copy(_FOR_VOXELS_CONFORMANCE, folder)
        write_voxel_files(folder / VOXELS_KIT, kit_voxels(self.axes))
        write_text(folder / VOXELS_EXPECTED, json.dumps(voxels_json(voxels)) + "\n")

    def _write_relight_conformance(self, field: ProbeField, transfer: EngineTransfer, folder: Path) -> None:
        _copy(_FOR_TRANSFER_CONFORMANCE, folder)
        write_transfer_files(folder / TRANSFER_KIT, tables_of(kit_transfer(), self.axes))
        write_text(folder / TRANSFER_EXPECTED, json.dumps(transfer_json(field, transfer.source, self.axes)) + "\n")


def notes_on_media(media: EngineMedia | None) -> list[str]:
    """What a person should know of ``media`` in three.js."""
    if media is None:
        return []
    return [*media.notes, "media scatter the ambient light of the bake; lamps of three.js light them through a shader of your own"]


def _module(glsl: str) -> str:
    """An ES module whose `weights` is the text ``glsl``."""
    return f"// Written by the export.\nexport const weights = {json.dumps(glsl)};\n"


def _copy(names, folder: Path) -> None:
    for name in names:
        copy_files((_FILES / name).parent, (folder / name).parent, [Path(name).name])


ENGINE = ThreeJs()
