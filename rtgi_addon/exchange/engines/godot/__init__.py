"""Godot 4.6: 3D textures, a shader include and its loader, LightmapGIData for dynamic objects, a sample project."""

import json
import shutil
from pathlib import Path

import numpy as np

from ....errors import BakeError
from ....progress import Progress
from ....techniques.probes.field import ProbeField
from ...bundle import Bundle
from .. import conformance
from ..axes import Y_UP
from ..base import Engine, ExportSettings, copy_files, write_text
from ..volumes import ExportVolume, engine_field, export_volumes, notes_on_order
from .dynamic_objects import dynamic_case
from .light_data import light_data
from .textures import DISTANCES, PROBES, write_textures

# The folder that a project needs, the kit, and what each holds besides the volumes.
ADDON, KIT = "rtgi", "conformance"
_FILES = Path(__file__).parent / "files"
_ADDON_FILES = ("surface.gdshaderinc", "surface.gdshader", "surface_double_sided.gdshader", "volumes.gd", "turned_light.gd",
                "probes.gd", "probes.tscn")
_SAMPLE_FILES = ("README.md", "project.godot", "sample.gd", "sample.tscn")
# Each volume takes two samplers, and desktop drivers of the Compatibility renderer have 32, of which Godot needs some.
MAX_VOLUMES = 8


class Godot(Engine):
    """The folder is a project that opens in Godot; its `rtgi` folder alone is what goes into another project."""

    name, title = "godot", "Godot 4.6"
    description = "3D textures, shader include, GDScript loader, LightmapGIData and a sample project"
    axes = Y_UP
    # What the editor writes into a project: its cache, identities of files, and import records that it completes.
    leftovers = (".godot/*", "*.uid", "*.import", ".editorconfig", ".gitattributes", ".gitignore", "model_*")
    parts = (ADDON,)

    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """See Engine.write."""
        field = engine_field(bundle)
        if len(field.lookups) > MAX_VOLUMES:
            raise BakeError(f"the bundle has {len(field.lookups)} volumes, and a shader in Godot has samplers for {MAX_VOLUMES}",
                            "bake fewer volumes into this bundle (--volume)")
        progress.step(0.05, "Preparing the probes")
        volumes = export_volumes(field, self.axes)
        progress.step(0.4, "Writing textures")
        _write_volumes(folder / ADDON, volumes, field.includes_direct)
        copy_files(_FILES / ADDON, folder / ADDON, _ADDON_FILES)
        progress.step(0.6, "Writing the sample scene")
        copy_files(_FILES, folder, _SAMPLE_FILES)
        if settings.model is not None:
            shutil.copyfile(settings.model, folder / "model.glb")
        if settings.conformance:
            progress.step(0.7, "Writing the conformance kit")
            self._write_kit(folder / KIT, field)
        return notes_on_order(bundle)

    def _write_kit(self, folder: Path, field: ProbeField) -> None:
        kit = export_volumes(conformance.kit_field(), self.axes)
        _write_volumes(folder / "kit", kit, False)
        expected = conformance.to_json(field, self.axes)
        expected["dynamic objects"] = dynamic_case(kit)
        write_text(folder / "conformance.json", json.dumps(expected) + "\n")
        copy_files(_FILES / KIT, folder, ["conformance.gd", "README.md"])


def shader_include(count: int) -> str:
    """irradiance.gdshaderinc for ``count`` volumes."""
    def repeated(name: str) -> str:
        text = (_FILES / ADDON / f"{name}.in").read_text(encoding="utf-8")
        return "".join(text.replace("@N@", str(number)) for number in range(count))

    text = (_FILES / ADDON / "irradiance.gdshaderinc.in").read_text(encoding="utf-8")
    for mark, name in (("@UNIFORMS@", "volume_uniforms"), ("@SHARES@", "volume_share"), ("@SUMS@", "volume_sum")):
        text = text.replace(mark, repeated(name))
    return text.replace("@COUNT@", str(count))


def _write_volumes(folder: Path, volumes: tuple[ExportVolume, ...], includes_direct: bool) -> None:
    """Everything that depends on the probes: textures, their index, the include for so many volumes, the light data."""
    for volume in volumes:
        write_textures(folder, volume)
    index = {"includes_direct": includes_direct, "volumes": [_entry(volume) for volume in volumes]}
    write_text(folder / "probes.json", json.dumps(index, indent=1) + "\n")
    write_text(folder / "irradiance.gdshaderinc", shader_include(len(volumes)))
    write_text(folder / "light_data.tres", light_data(volumes).to_text())


def _entry(volume: ExportVolume) -> dict:
    def rows(matrix: np.ndarray) -> list[list[float]]:
        return matrix[:3].tolist()

    return {
        "name": volume.name, "resolution": list(volume.resolution), "tile": volume.tile, "centre": volume.centre.tolist(),
        "bias": volume.bias, "lattice_from_offset": rows(volume.lattice_from_offset),
        "offset_from_lattice": rows(volume.offset_from_lattice), "world_from_local": rows(volume.world_from_local),
        "probes": f"{volume.folder}/{PROBES}", "distances": f"{volume.folder}/{DISTANCES}",
    }


ENGINE = Godot()
