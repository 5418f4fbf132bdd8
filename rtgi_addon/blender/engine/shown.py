"""Which light a preview shows: this session's bake with the chosen technique, what needs no bake, the bundle on disk, or none."""

from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ...effects.atlas.relight import with_atlas
from ...effects.spheres.bake import light_of
from ...errors import BakeError
from ...exchange.bundle import read_bundle
from ...jobs.fingerprint import content_hash
from ...preview.indirect import needs_no_bake
from ...progress import Progress
from ...scene import Scene
from ...techniques import Field, get
from ...techniques.cone_tracing import ConeSettings
from ...techniques.lpv import LpvSettings
from ...techniques.probes import TECHNIQUE as PROBES
from ...techniques.probes.live import LiveSettings
from ...techniques.voxel_march import MarchSettings
from ...transport.context import changed_surfaces
from ..bundles import places_of_bundles
from ..session import Baked, session
from ..ui.preview_settings import live_settings
from ..ui.properties import scene_settings

LIVE = "Live, without a bake"
# Light that is made of what is drawn, and lags behind it in a viewport: by whom, for a picture that may not.
_MADE_HERE = {LpvSettings: "lpv", ConeSettings: "cone_tracing", MarchSettings: "voxel_march"}


@dataclass(frozen=True, eq=False)
class Shown:
    """``field`` is None where nothing fits; ``note`` says for the user what is shown instead, or is empty. ``baked`` is what it can
    be relit from, for a bake of this session. ``live`` are the settings of the technique if its light is made of what is drawn: it
    needs no bake, and is never out of date."""

    field: Field | None
    note: str = ""
    baked: Baked | None = None
    live: object = None


def shown_for(scene: bpy.types.Scene, technique_name: str | None = None) -> Shown:
    """What a preview of ``scene`` shows with the technique it has chosen, or with the one of that name."""
    shown = _shown(scene, technique_name)
    if shown.field is not None and shown.field.transfer is not None:
        shown.field.exact_suns = scene.rtgi_light.exact_sun
    return shown


def _shown(scene: bpy.types.Scene, technique_name: str | None) -> Shown:
    technique = get(technique_name or scene.rtgi.technique)
    if technique is PROBES and scene.rtgi_preview.live_probes:
        return Shown(None, LIVE, None, live_settings(scene))
    baked = session.baked.get((scene.name, technique.name))
    if baked is not None:
        return Shown(baked.field, "", baked, baked.field.live_settings)
    settings = scene_settings(scene, technique.name)[1]
    return Shown(None, LIVE, None, settings) if needs_no_bake(settings) else _from_disk(scene, technique)


def lit_for(shown: Shown, scene: Scene, progress: Progress) -> Field | None:
    """The field of ``shown`` under the lamps and the world of ``scene``, for a picture that may not lag behind.

    A field that cannot be relit is taken as it was baked. Of techniques whose light is made of what is drawn, reflective shadow
    maps are left to the picture, light propagation volumes and voxels are made here, whatever has moved, and in the place of live
    probes, which lag behind, stands a bake. What sphere probes saw stays with it where the light is that of their bake, and the
    light atlas where it follows the light.
    """
    field, baked = _lit(shown, scene, progress), shown.field
    if field is None or baked is None or field is baked:
        return field
    if baked.spheres is not None and baked.spheres.light == light_of(scene):
        field.spheres = baked.spheres
    return with_atlas(field, baked, scene)


def _lit(shown: Shown, scene: Scene, progress: Progress) -> Field | None:
    baked = shown.baked
    if isinstance(shown.live, LiveSettings):
        return PROBES.bake(scene, shown.live.probes, np.random.default_rng(0), progress)
    if shown.live is not None:
        technique = _MADE_HERE.get(type(shown.live))
        if technique is None:
            return shown.field
        if baked is None or changed_surfaces(baked.scene, scene):
            return get(technique).bake(scene, shown.live, np.random.default_rng(0), progress)
    if shown.field is not None and shown.field.transfer is not None:
        relight = shown.field.relight_exactly if shown.field.exact_suns else shown.field.relight
        return relight(scene, progress)
    if baked is None or not hasattr(baked.field, "relight") or same_light(baked.scene, scene):
        return shown.field
    return baked.relight(scene, progress)


def same_light(one: Scene, other: Scene) -> bool:
    """True if the two have the same lamps and world."""
    return content_hash((one.lights, one.world)) == content_hash((other.lights, other.world))


# Bundles that are kept: an animation goes through all of a series.
_MOST_READ = 8
_read: dict[Path, tuple[int, Shown, str]] = {}


def forget() -> None:
    """Drop what was read from disks: another file is open, or the add-on goes."""
    _read.clear()


def _from_disk(scene, technique) -> Shown:
    nothing = Shown(None, f"Nothing baked with {technique.label}: direct light and world only")
    for folder, told in places_of_bundles(scene):
        manifest = folder / "bake.json"
        try:
            written = manifest.stat().st_mtime_ns
        except OSError:
            nothing = Shown(None, told) if told else nothing
            continue
        if folder not in _read or _read[folder][0] != written:
            _read[folder] = (written, *_bundle(folder))
            while len(_read) > _MOST_READ:
                _read.pop(next(iter(_read)))
        _, shown, name = _read[folder]
        if name in ("", technique.name):
            return replace(shown, note=told) if told and not shown.note else shown
        nothing = Shown(None, f"The bake on disk is of the technique {name}: direct light and world only")
    return nothing


def _bundle(folder: Path) -> tuple[Shown, str]:
    """A bundle as probes, and the technique that made it ("" where it cannot be read)."""
    try:
        bundle = read_bundle(folder)
    except BakeError as error:
        return Shown(None, f"The bake on disk cannot be shown, {error}"), ""
    if "transfer" in bundle.manifest:
        try:
            return Shown(bundle.transfer_field, ""), bundle.manifest["technique"]
        except BakeError as error:
            return Shown(bundle.field, f"The bake on disk does not follow the light, {error}"), bundle.manifest["technique"]
    return Shown(bundle.field, ""), bundle.manifest["technique"]
