"""Godot 4.6: 3D textures, a shader include and its loader, LightmapGIData for dynamic objects, a sample project; media as
volumetric fog and as a march of our own."""

import json
from pathlib import Path

import numpy as np

from ....errors import BakeError
from ....progress import Progress
from ....storage.writing import copy_file
from ....techniques.lattice.field import ProbeField
from ...bundle import Bundle
from .. import conformance
from ..atlas import EngineAtlas, engine_atlas, kit_atlas, notes_on_atlas
from ..atlas import conformance_json as atlas_json
from ..atlas_transfer import EngineAtlasTransfer, engine_atlas_transfer, kit_atlas_transfer
from ..atlas_transfer import conformance_json as atlas_relight_json
from ..axes import Y_UP
from ..base import Engine, ExportSettings, copy_files, write_text
from ..glsl import shared_glsl
from ..kit import kit_field
from ..media import EngineMedia, engine_media
from ..media_conformance import kit_media
from ..media_conformance import to_json as media_json
from ..sky import write_sky
from ..spheres import EngineSpheres, conformance_json, engine_spheres, kit_spheres, notes_on_spheres
from ..transfer import EngineTransfer, engine_transfer, notes_on_transfer, tables_of
from ..transfer_conformance import kit_transfer
from ..transfer_conformance import to_json as transfer_json
from ..volumes import ExportVolume, engine_field, export_volumes, notes_on_order, notes_on_places
from ..voxels import EngineVoxels, engine_voxels, kit_voxels, notes_on_voxels
from ..voxels import conformance_json as voxels_json
from .atlas import FILES as ATLAS_FILES
from .atlas import INDEX as ATLAS
from .atlas import TEXCOORDS, atlas_include, write_atlas, write_atlas_shader
from .dynamic_objects import dynamic_case
from .light_data import light_data
from .media import FILES as MEDIA_FILES
from .media import INDEX as MEDIA
from .media import notes_on_media, write_media
from .spheres import FILES as SPHERE_FILES
from .spheres import INDEX as SPHERES
from .spheres import spheres_include, write_spheres
from .style import notes_on_style, write_style, write_style_kit
from .textures import DISTANCES, IMPORT, MAX_SIDE, NODES, PROBES, blend_import, probes_sheet, write_textures
from .transfer import FILES as TRANSFER_FILES
from .transfer import INDEX as TRANSFER
from .transfer import write_relight_shader, write_transfer
from .voxels import FILES as VOXEL_FILES
from .voxels import INDEX as VOXELS
from .voxels import write_voxels

# The folder that a project needs, the kit, and what each holds besides the volumes.
ADDON, KIT = "rtgi", "conformance"
# What the loader and the kit's script open first.
INDEX, EXPECTED = "probes.json", "conformance.json"
# The same of media, where there are any: what is expected, and the script that compares.
MEDIA_EXPECTED, _MEDIA_SCRIPT = "media.json", "media.gd"
# And of transfer.
TRANSFER_EXPECTED, _TRANSFER_SCRIPT = "relight.json", "relight.gd"
# And of sphere probes.
SPHERES_EXPECTED, _SPHERES_SCRIPT = "spheres.json", "spheres.gd"
# And of the light atlas.
ATLAS_EXPECTED, _ATLAS_SCRIPT = "atlas.json", "atlas.gd"
ATLAS_RELIT = "atlas_relight.json"
# And of lit voxels.
VOXELS_EXPECTED, _VOXELS_SCRIPT = "voxels.json", "voxels.gd"
_FILES = Path(__file__).parent / "files"
_ADDON_FILES = ("surface.gdshaderinc", "surface.gdshader", "surface_double_sided.gdshader", "volumes.gd", "turned_light.gd",
                "probes.gd", "probes.tscn")
_SAMPLE_FILES = ("project.godot", "sample.gd")
# Where sample.gd has what the panorama's pixels are stored over.
_SKY_SCALE = "const SKY_SCALE := {!r}\n"
_DAY_FILES = ("day.gd", "day.tscn")
# What the shader's probes are read from, and how: a 3D texture, or a picture of its slices that is drawn anew as light changes.
_AS_BAKED = "sampler3D", "texelFetch(probes, texel, 0)"
_RELIT = "sampler2D", ("texelFetch(probes, ivec2(texel.z % (textureSize(probes, 0).x / size.x) * size.x + texel.x,\n"
                       "\t\t\ttexel.z / (textureSize(probes, 0).x / size.x) * size.y + texel.y), 0)")
# Each volume takes two samplers, or three where any is scattered, and desktop drivers of the Compatibility renderer have 32, of
# which Godot needs some.
MAX_VOLUMES, MAX_SCATTERED = 8, 5


class Godot(Engine):
    """The folder is a project that opens in Godot; its `rtgi` folder alone is what goes into another project."""

    name, title = "godot", "Godot 4.6"
    description = "3D textures, shader include, GDScript loader, LightmapGIData and a sample project"
    axes = Y_UP
    parts = (ADDON,)
    styles = True
    scattered = True
    indices = (f"{ADDON}/{INDEX}", f"{KIT}/kit/{INDEX}", f"{KIT}/{EXPECTED}", f"{ADDON}/{MEDIA}", f"{KIT}/kit/{MEDIA}",
               f"{KIT}/{MEDIA_EXPECTED}", f"{ADDON}/{TRANSFER}", f"{KIT}/kit/{TRANSFER}", f"{KIT}/{TRANSFER_EXPECTED}",
               f"{ADDON}/{SPHERES}", f"{KIT}/kit/{SPHERES}", f"{KIT}/{SPHERES_EXPECTED}",
               f"{ADDON}/{ATLAS}", f"{KIT}/kit/{ATLAS}", f"{KIT}/{ATLAS_EXPECTED}", f"{KIT}/{ATLAS_RELIT}",
               f"{ADDON}/{VOXELS}", f"{KIT}/kit/{VOXELS}", f"{KIT}/{VOXELS_EXPECTED}")

    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """See Engine.write."""
        field = engine_field(bundle)
        most = MAX_SCATTERED if any(grid.volume.scattered is not None for grid in bundle.grids) else MAX_VOLUMES
        if len(field.lookups) > most:
            raise BakeError(f"the bundle has {len(field.lookups)} volumes, and a shader in Godot has samplers for {most}",
                            "bake fewer volumes into this bundle (--volume)")
        progress.step(0.05, "Preparing the probes")
        volumes = export_volumes(field, self.axes)
        progress.step(0.4, "Writing textures")
        transfer, spheres = engine_transfer(bundle, self.axes), engine_spheres(bundle.spheres, self.axes)
        atlas = engine_atlas(bundle.atlas, self.axes)
        relit, told = engine_atlas_transfer(atlas, None if transfer is None else transfer.source, self.axes, MAX_SIDE)
        _write_volumes(folder / ADDON, volumes, bundle.manifest, transfer, spheres, atlas, relit is not None)
        copy_files(_FILES / ADDON, folder / ADDON, _ADDON_FILES)
        if spheres is not None:
            write_spheres(folder / ADDON, spheres)
            copy_files(_FILES / ADDON, folder / ADDON, SPHERE_FILES)
        if atlas is not None:
            write_atlas(folder / ADDON, atlas, relit)
            copy_files(_FILES / ADDON, folder / ADDON, ATLAS_FILES)
        if relit is not None:
            write_atlas_shader(folder / ADDON)
        voxels = engine_voxels(bundle.voxels, self.axes)
        if voxels is not None:
            write_voxels(folder / ADDON, voxels)
            copy_files(_FILES / ADDON, folder / ADDON, VOXEL_FILES)
        media = engine_media(bundle.media, field, self.axes)
        if media is not None:
            progress.step(0.5, "Writing the media")
            write_media(folder / ADDON, media)
            copy_files(_FILES / ADDON, folder / ADDON, MEDIA_FILES)
        if transfer is not None:
            write_relight_shader(folder / ADDON)
            copy_files(_FILES / ADDON, folder / ADDON, TRANSFER_FILES)
        if settings.style is not None:
            write_style(folder / ADDON, settings.style)
        progress.step(0.6, "Writing the sample scene")
        copy_files(_FILES, folder, _SAMPLE_FILES)
        readme, scene = ((_FILES / name).read_text(encoding="utf-8") for name in ("README.md", "sample.tscn"))
        parts = [*([_MEDIA] if media is not None else []), *([_DAY] if transfer is not None else []),
                 *([_MIRRORS] if spheres is not None else []), *([_ATLAS] if atlas is not None else []),
                 *([_VOXELS] if voxels is not None else [])]
        if transfer is not None:
            copy_files(_FILES, folder, _DAY_FILES)
        write_text(folder / "README.md", readme.rstrip() + "".join(
            text.format(number=7 + index).rstrip() for index, (text, _) in enumerate(parts)) + "\n")
        write_text(folder / "sample.tscn", _with_nodes(scene, [node for _, nodes in parts for node in nodes]))
        if settings.model is not None:
            copy_file(settings.model, folder / "model.glb")
            # Godot's panoramas begin at -Z.
            scale = write_sky(folder, settings.sky, self.axes, 0.0)
            if scale is not None:
                script = (_FILES / "sample.gd").read_text(encoding="utf-8")
                write_text(folder / "sample.gd", script.replace(_SKY_SCALE.format(1.0), _SKY_SCALE.format(scale)))
        if settings.conformance:
            progress.step(0.7, "Writing the conformance kit")
            self._write_kit(folder / KIT, field, media, transfer, spheres, atlas, relit, voxels)
            if settings.style is not None:
                write_style_kit(folder / KIT)
        return [*notes_on_order(bundle), *notes_on_places(bundle), *notes_on_media(media), *notes_on_style(settings.style),
                *notes_on_transfer(transfer),
                *notes_on_spheres(spheres, transfer), *notes_on_atlas(atlas, TEXCOORDS, "Godot"), *told,
                *notes_on_voxels(voxels)]

    def blend(self, name: str, theirs: bytes, ours: bytes) -> bytes | None:
        """See Engine.blend: the editor completes import records, and users choose other settings in them; how the slices lie in the
        picture is ours to say."""
        return blend_import(theirs, ours) if name.endswith(IMPORT) else None

    def _write_kit(self, folder: Path, field: ProbeField, media: EngineMedia | None, transfer: EngineTransfer | None,
                   spheres: EngineSpheres | None, atlas: EngineAtlas | None, relit: EngineAtlasTransfer | None,
                   voxels: EngineVoxels | None) -> None:
        kit = export_volumes(kit_field(), self.axes)
        _write_volumes(folder / "kit", kit, {}, None if transfer is None else tables_of(kit_transfer(), self.axes),
                       None if spheres is None else kit_spheres(self.axes), None if atlas is None else kit_atlas(),
                       relit is not None)
        expected = conformance.to_json(field, self.axes)
        expected["dynamic objects"] = dynamic_case(kit)
        write_text(folder / EXPECTED, json.dumps(expected) + "\n")
        copy_files(_FILES / KIT, folder, ["conformance.gd", "checks.gd", "irradiance_checks.gd", "README.md"])
        if media is not None:
            write_media(folder / "kit", kit_media(self.axes))
            write_text(folder / MEDIA_EXPECTED, json.dumps(media_json(media, self.axes)) + "\n")
            copy_files(_FILES / KIT, folder, [_MEDIA_SCRIPT])
        if transfer is not None:
            write_text(folder / TRANSFER_EXPECTED, json.dumps(transfer_json(field, transfer.source, self.axes)) + "\n")
            copy_files(_FILES / KIT, folder, [_TRANSFER_SCRIPT, "shining.gd"])
        if spheres is not None:
            write_spheres(folder / "kit", kit_spheres(self.axes))
            write_text(folder / SPHERES_EXPECTED, json.dumps(conformance_json(spheres)) + "\n")
            copy_files(_FILES / KIT, folder, [_SPHERES_SCRIPT])
        if atlas is not None:
            write_atlas(folder / "kit", kit_atlas(), None if relit is None else kit_atlas_transfer(self.axes))
            write_text(folder / ATLAS_EXPECTED, json.dumps(atlas_json(atlas)) + "\n")
            copy_files(_FILES / KIT, folder, [_ATLAS_SCRIPT, "atlas_checks.gd"])
        if relit is not None:
            write_text(folder / ATLAS_RELIT, json.dumps(atlas_relight_json(atlas, relit, transfer.source, self.axes)) + "\n")
            copy_files(_FILES / KIT, folder, ["atlas_relight.gd"])
        if voxels is not None:
            write_voxels(folder / "kit", kit_voxels(self.axes))
            write_text(folder / VOXELS_EXPECTED, json.dumps(voxels_json(voxels)) + "\n")
            copy_files(_FILES / KIT, folder, [_VOXELS_SCRIPT])


# What the README says of media and of transfer, and their nodes in the sample scene: name, path, and lines of properties.
_MEDIA = """
{number}. Fog and smoke: `rtgi/media.tscn` beside the probes. In Forward+ it is Godot's volumetric fog, which your lamps light, else
   (or with `how` = View) a march that is exact and knows the baked light alone. Check it: `... --script conformance/media.gd`.
""", [("Media", "rtgi/media.tscn", "")]
_DAY = """
{number}. Day and night without a new bake: `rtgi/relight.tscn` beside the probes, its `sun` a DirectionalLight3D, whose bounced
   light follows; `$Relight.factors["NAME"] = 0.5` dims a light of the bake (names are in `rtgi/transfer.json`). The sample has a
   slider for the time of day (`day.tscn`). Fog does not follow. Check it: `... --script conformance/relight.gd`.
   Deutsch: Tag und Nacht ohne neues Backen. `rtgi/relight.tscn` neben die Sonden stellen und unter `sun` ein DirectionalLight3D
   angeben; `day.tscn` im Beispiel hat Regler für Uhrzeit, Himmel und Lichtgruppen. Nebel folgt nicht.
""", [("Relight", "rtgi/relight.tscn", ""), ("Day", "day.tscn", "")]
_MIRRORS = """
{number}. Mirrors: surfaces that the probes light show what sphere probes saw; what those do not know is Godot's sky and reflection
   probes. In shaders of your own `rtgi_mirrored`. Check it: `... --script conformance/spheres.gd`.
""", []
_ATLAS = """
{number}. Light atlas: objects in it are lit at the texels of their UV map in place of the probes, found by their nodes' names. In
   shaders of your own `rtgi_atlas`, with `atlas.apply_to(material, name)`. Check it: `... --script conformance/atlas.gd`.
   With day and night it follows the light, if its bake knows how (`conformance/atlas_relight.gd`).
   Deutsch: Objekte im Lichtatlas werden statt von den Sonden von den Texeln ihrer UV-Map beleuchtet, gefunden am Namen des Knotens.
""", []
_VOXELS = """
{number}. Voxels: `rtgi/voxel_surface.gdshader` lights a surface by cones through the scene's voxels, pixel by pixel, without
   probes: `var voxels := preload("res://rtgi/voxels.gd").new(); voxels.open("res://rtgi"); voxels.apply_to(material)`. In your own
   shaders `rtgi_voxels_irradiance` and `rtgi_voxels_mirrored` of `voxels.gdshaderinc`, in scripts for a few points
   `voxels.irradiance(point, normal)`. Check it: `... --script conformance/voxels.gd`.
   Deutsch: `rtgi/voxel_surface.gdshader` beleuchtet Flächen mit Kegeln durch die Voxel der Szene, Pixel für Pixel und ohne Sonden.
""", []


def _with_nodes(scene: str, nodes: list[tuple[str, str, str]]) -> str:
    """The sample scene with more ``nodes``."""
    last = '[ext_resource type="PackedScene" path="rtgi/probes.tscn" id="2"]\n'
    resources, added = last, ""
    for number, (name, path, properties) in enumerate(nodes, 3):
        resources += f'[ext_resource type="PackedScene" path="{path}" id="{number}"]\n'
        added += f'\n[node name="{name}" parent="." instance=ExtResource("{number}")]\n{properties}'
    return scene.replace(last, resources).rstrip() + "\n" + added


def shader_include(count: int, relit: bool = False, spheres: EngineSpheres | None = None, atlas: bool = False,
                   relit_atlas: bool = False, scattered: bool = False) -> str:
    """irradiance.gdshaderinc for ``count`` volumes, whose light may be ``relit`` at run time, for ``spheres`` and an ``atlas``,
    whose light may be, too; some of the volumes may be ``scattered``."""
    def repeated(name: str) -> str:
        text = (_FILES / ADDON / f"{name}.in").read_text(encoding="utf-8")
        return "".join(text.replace("@N@", str(number)) for number in range(count))

    text = (_FILES / ADDON / "irradiance.gdshaderinc.in").read_text(encoding="utf-8")
    for mark, name in (("@UNIFORMS@", "volume_uniforms"), ("@SHARES@", "volume_share"), ("@SUMS@", "volume_sum")):
        text = text.replace(mark, repeated(name))
    for mark, value in zip(("@PROBES@", "@FETCH@"), _RELIT if relit else _AS_BAKED, strict=True):
        text = text.replace(mark, value)
    # Lines that begin with a mark are for scattered volumes, or for lattices alone.
    text = "".join(line.removeprefix("@+@").removeprefix("@-@") for line in text.splitlines(keepends=True)
                   if not line.startswith("@-@" if scattered else "@+@"))
    text = text.replace("@SHARED@", shared_glsl()).replace("@COUNT@", str(count))
    more = ([] if spheres is None else [spheres_include(spheres)]) + ([atlas_include(relit_atlas)] if atlas else [])
    return "".join([text.rstrip() + "\n", *more]) if more else text


def _write_volumes(folder: Path, volumes: tuple[ExportVolume, ...], manifest: dict, transfer: EngineTransfer | None,
                   spheres: EngineSpheres | None, atlas: EngineAtlas | None, relit_atlas: bool) -> None:
    """Everything that depends on the probes of the bake with this ``manifest``: textures, their index, the include for so many
    volumes, the light data, and the tables of ``transfer``."""
    for volume in volumes:
        write_textures(folder, volume)
    index = {"includes_direct": bool(manifest.get("includes_direct")), "lamps": manifest.get("lamps", {}),
             "objects": manifest.get("objects", {}), "volumes": [_entry(volume, transfer is not None) for volume in volumes]}
    write_text(folder / INDEX, json.dumps(index, indent=1) + "\n")
    write_text(folder / "irradiance.gdshaderinc", shader_include(
        len(volumes), transfer is not None, spheres, atlas is not None, relit_atlas,
        any(volume.words is not None for volume in volumes)))
    write_text(folder / "light_data.tres", light_data(volumes).to_text())
    if transfer is not None:
        write_transfer(folder, transfer, volumes)


def _entry(volume: ExportVolume, relit: bool) -> dict:
    def rows(matrix: np.ndarray) -> list[list[float]]:
        return matrix[:3].tolist()

    return {
        "name": volume.name, "resolution": list(volume.resolution), "tile": volume.tile, "centre": volume.centre.tolist(),
        "bias": volume.bias, "lattice_from_offset": rows(volume.lattice_from_offset),
        "offset_from_lattice": rows(volume.offset_from_lattice), "world_from_local": rows(volume.world_from_local),
        "probes": f"{volume.folder}/{PROBES}", "distances": f"{volume.folder}/{DISTANCES}",
        **({} if volume.words is None else {"nodes": list(volume.nodes), "words": f"{volume.folder}/{NODES}"}),
        **({"sheet": list(probes_sheet(volume))} if relit else {}),
    }


ENGINE = Godot()
