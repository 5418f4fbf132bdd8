"""Which bundle on disk belongs to a scene: where the last bake went, where the next one would go; found again after a file was
opened, whoever baked it."""

from pathlib import Path

import bpy
import numpy as np

from ..errors import BakeError
from ..exchange.schema import MANIFEST, read_manifest
from ..exchange.series import INDEX, Series, bundle_at, read_series
from ..jobs.belonging import Box, other_scene
from .extract.volumes import is_volume
from .session import session

_series: dict[Path, tuple[int, Series]] = {}
_read: dict[Path, tuple[int, dict | BakeError]] = {}


def bundle_folders(scene: bpy.types.Scene) -> list[Path]:
    """Where a bundle of ``scene`` may lie: where the last bake went, and where the next would go; of a series, the bundle that the
    current frame shows."""
    return list(dict.fromkeys(folder for folder, _ in places_of_bundles(scene)))


def places_of_bundles(scene: bpy.types.Scene) -> list[tuple[Path, str]]:
    """The same, each with a line for the user where it is that of another frame of a series, or the series is damaged, or ""."""
    return [_of_frame(folder, scene.frame_current_final) for folder in _folders(scene)]


def _of_frame(folder: Path, frame: float) -> tuple[Path, str]:
    for place in (folder, folder.parent):
        try:
            series = _series_in(place)
        except BakeError as error:
            return folder, f"The bake on disk cannot be shown, {error}"
        if series is not None and (place is folder or folder in series.bundles):
            bundle, told = bundle_at(series, frame)
            return bundle, told[0] if told else ""
    return folder, ""


def _series_in(folder: Path) -> Series | None:
    """The series in ``folder``, None where there is none. Read once as long as nobody writes it. Raises BakeError."""
    try:
        written = (folder / INDEX).stat().st_mtime_ns
    except OSError:
        return None
    if folder not in _series or _series[folder][0] != written:
        _series[folder] = written, read_series(folder)
    return _series[folder][1]


def _folders(scene: bpy.types.Scene) -> list[Path]:
    folders = [Path(scene.rtgi.last_bake.folder)] if scene.rtgi.last_bake.folder else []
    setting = scene.rtgi.output
    if setting.strip() and (bpy.data.filepath or not setting.startswith("//")):
        folders.append(Path(bpy.path.abspath(setting)).resolve())
    return list(dict.fromkeys(folders))


def manifest_of(folder: Path) -> dict | None:
    """The manifest of the bundle ``folder``, None where there is none. Raises BakeError for one that is damaged. Read once as long
    as nobody writes it, for panels ask whenever they are drawn."""
    try:
        written = (folder / MANIFEST).stat().st_mtime_ns
    except OSError:
        return None
    if folder not in _read or _read[folder][0] != written:
        try:
            found = read_manifest(folder)
        except BakeError as error:
            found = error
        _read[folder] = written, found
    if isinstance(_read[folder][1], BakeError):
        raise _read[folder][1]
    return _read[folder][1]


def exported_bundle(scene: bpy.types.Scene) -> tuple[Path, dict]:
    """The folder of the bundle that an export of ``scene`` takes, and its manifest: the one that a preview with the chosen
    technique shows, and no other. Raises BakeError where there is none."""
    problem = BakeError("nothing is baked that could be exported", "bake first")
    for folder in bundle_folders(scene):
        manifest = manifest_of(folder)
        if manifest is None:
            continue
        if manifest["technique"] != scene.rtgi.technique:
            problem = BakeError(f"the bake in {folder} is of the technique {manifest['technique']}, and {scene.rtgi.technique} is "
                                "shown", "choose that technique to export its bake, or bake again")
            continue
        other = _other(manifest, scene)
        if not other:
            return folder, manifest
        problem = BakeError(f"the bake in {folder} is of {other}, and not of scene {scene.name!r}",
                            "bake this scene, or choose its folder under RTGI in the render properties")
    raise problem


def find_last_bakes() -> None:
    """Look on the disk for the last bake of every scene of the file whose own record of it is not there or of an older bake: the
    file was not saved after the bake, or it was baked from a shell."""
    for scene in bpy.data.scenes:
        find_last_bake(scene)


def find_last_bake(scene: bpy.types.Scene) -> bool:
    """The same for one; True if a record was written."""
    last = scene.rtgi.last_bake
    for folder in bundle_folders(scene):
        try:
            manifest = manifest_of(folder)
        except BakeError:
            continue
        recorded = last.folder == str(folder)
        if manifest is None or (not recorded and _other(manifest, scene)):
            continue
        values = record_of(folder, manifest)
        if recorded and (not values["fingerprint"] or values["fingerprint"] == last.fingerprint):
            return False
        for name, value in values.items():
            setattr(last, name, value)
        session.records[scene.name] = values
        return True
    return False


def record_of(folder: Path, manifest: dict) -> dict:
    """The values of ``Scene.rtgi.last_bake`` as far as the manifest of a bundle tells: the noise at probes it does not."""
    stats = manifest["stats"]
    probes = sum(int(np.prod(entry["resolution"])) for entry in manifest["volumes"])
    seconds, error, usable = stats.get("seconds"), stats.get("error_on_surfaces"), stats.get("usable")
    known = isinstance(error, dict) and all(isinstance(error.get(name), (int, float)) for name in ("value", "low", "high"))
    return {
        "folder": str(folder), "technique": manifest["technique"], "probes": probes,
        "usable": min(usable / max(probes, 1), 1.0) if isinstance(usable, int) else 0.0, "error": -1.0,
        "seconds": float(sum(seconds.values())) if isinstance(seconds, dict) else 0.0,
        **{name: float(error[key]) if known else -1.0
           for name, key in (("surface_error", "value"), ("surface_low", "low"), ("surface_high", "high"))},
        "fingerprint": stats.get("state", "") if isinstance(stats.get("state", ""), str) else "",
    }


def require_of_open_scene(bundle) -> None:
    """Raise BakeError if the bundle at path ``bundle`` is another scene's than the open one, or cannot be read."""
    scene = bpy.context.scene
    other = _other(read_manifest(bundle), scene)
    if other:
        raise BakeError(f"the bundle {bundle} is of {other}, and not of scene {scene.name!r}",
                        "bake this scene, or give its bundle")


def _other(manifest: dict, scene: bpy.types.Scene) -> str:
    boxes = [Box(obj.name, np.array(obj.matrix_world, np.float64)) for obj in scene.objects if is_volume(obj)]
    return other_scene(manifest, scene.name, Path(bpy.data.filepath).name, boxes)
