"""Which light a preview shows: this session's bake with the chosen technique, what needs no bake, the bundle on disk, or none."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...exchange.bundle import read_bundle
from ...jobs.fingerprint import content_hash
from ...preview.indirect import live_settings, needs_no_bake
from ...progress import Progress
from ...scene import Scene
from ...techniques import Field, get
from ...techniques.lpv import TECHNIQUE as LIGHT_PROPAGATION
from ...techniques.lpv import LpvSettings
from ...transport.context import changed_surfaces
from ..properties import scene_settings
from ..session import Baked, session

LIVE = "Live, without a bake"


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
    technique = get(technique_name or scene.rtgi.technique)
    baked = session.baked.get((scene.name, technique.name))
    if baked is not None:
        return Shown(baked.field, "", baked, live_settings(baked.field))
    settings = scene_settings(scene, technique.name)[1]
    return Shown(None, LIVE, None, settings) if needs_no_bake(settings) else _from_disk(scene, technique)


def lit_for(shown: Shown, scene: Scene, progress: Progress) -> Field | None:
    """The field of ``shown`` under the lamps and the world of ``scene``, for a picture that may not lag behind.

    A field that cannot be relit is taken as it was baked. Of techniques whose light is made of what is drawn, reflective shadow
    maps are left to the picture, and light propagation volumes are made here, whatever has moved.
    """
    baked = shown.baked
    if shown.live is not None:
        if not isinstance(shown.live, LpvSettings):
            return shown.field
        if baked is None or changed_surfaces(baked.scene, scene):
            return LIGHT_PROPAGATION.bake(scene, shown.live, np.random.default_rng(0), progress)
    if baked is None or not hasattr(baked.field, "relight") or same_light(baked.scene, scene):
        return shown.field
    return baked.relight(scene, progress)


def same_light(one: Scene, other: Scene) -> bool:
    """True if the two have the same lamps and world."""
    return content_hash((one.lights, one.world)) == content_hash((other.lights, other.world))


def bundle_folders(scene: bpy.types.Scene) -> list[Path]:
    """Where a bundle of ``scene`` may lie: where the last bake went, and where the next would go."""
    folders = [Path(scene.rtgi.last_bake.folder)] if scene.rtgi.last_bake.folder else []
    setting = scene.rtgi.output
    if setting.strip() and (bpy.data.filepath or not setting.startswith("//")):
        folders.append(Path(bpy.path.abspath(setting)).resolve())
    return list(dict.fromkeys(folders))


_read: dict[Path, tuple[int, Shown, str]] = {}


def forget() -> None:
    """Drop what was read from disks: another file is open, or the add-on goes."""
    _read.clear()


def _from_disk(scene, technique) -> Shown:
    nothing = Shown(None, f"Nothing baked with {technique.label}: direct light and world only")
    for folder in bundle_folders(scene):
        manifest = folder / "bake.json"
        try:
            written = manifest.stat().st_mtime_ns
        except OSError:
            continue
        if folder not in _read or _read[folder][0] != written:
            _read[folder] = (written, *_bundle(folder))
        _, shown, name = _read[folder]
        if name in ("", technique.name):
            return shown
        nothing = Shown(None, f"The bake on disk is of the technique {name}: direct light and world only")
    return nothing


def _bundle(folder: Path) -> tuple[Shown, str]:
    """A bundle as probes, and the technique that made it ("" where it cannot be read)."""
    try:
        bundle = read_bundle(folder)
    except BakeError as error:
        return Shown(None, f"The bake on disk cannot be shown, {error}"), ""
    return Shown(bundle.field, ""), bundle.manifest["technique"]
