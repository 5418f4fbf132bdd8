"""Probes rendered by Cycles: an independent reference for bakes, and the opponent in benchmarks.

Every probe's panorama is a square tile under the equal-area octahedral map (Clarberg 2008, "Fast Equal-Area Mapping of the
(Hemi)Sphere using SIMD"), so each pixel covers the same solid angle and no sample is spent on poles. One render holds the tiles
of every probe: a camera written in OSL, which Cycles runs on the CPU from 4.5 on, starts each tile's rays at its own probe.
Against one equirectangular render per probe (``method='panorama'``, also the fallback for a Blender built without OSL) that
saves the set-up of every render and is the fastest that Cycles was found to do; benchmarks/README.md has the figures.

The picture follows docs/physics.md §1: lamps are hidden from the camera, emissive surfaces and the world are seen. Nothing that
trades bias for speed is on: no clamping, no denoising, no adaptive sampling, no light threshold, no path guiding, a box filter of
one pixel. The user's scene is put back as it was found, whatever happens.
"""

import hashlib
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...numerics import grid, sampling, sh
from ...scene.lights import NOT_AT_ALL
from ..ui.role_properties import is_left_out, lamp_role

# A camera whose picture is square tiles, one for each place, with rays from ``origins``. What stands between the two sets their
# ``direction`` by u and v in [−1, 1), across the tile.
CAMERA_BEGINS = """
shader camera(float origins[{floats}] = {{ {origins} }},{parameters}
              output point position = 0.0, output vector direction = 0.0, output color throughput = 1.0,
              output point dPdx = 0.0, output point dPdy = 0.0, output vector dDdx = 0.0, output vector dDdy = 0.0)
{{
  point raster = camera_shader_raster_position();
  float column = min(raster[0] * {columns}, {columns} - 1e-4);
  float row = min(raster[1] * {rows}, {rows} - 1e-4);
  int place = int(row) * {columns} + int(column);
  if (place >= {places}) {{
    throughput = 0.0;
  }}
  else {{
    position = point(origins[3 * place], origins[3 * place + 1], -origins[3 * place + 2]);
    float u = 2.0 * mod(column, 1.0) - 1.0, v = 2.0 * mod(row, 1.0) - 1.0;
"""
CAMERA_ENDS = """
  }}
}}
"""
_PROBE_CAMERA = CAMERA_BEGINS + """
    float inner = 1.0 - abs(u) - abs(v);
    float r = 1.0 - abs(inner);
    float phi = (r <= 0.0) ? 0.0 : ((abs(v) - abs(u)) / r + 1.0) * {quarter_pi};
    float ring = r * sqrt(max(2.0 - r * r, 0.0));
    float z = 1.0 - r * r;
    /* Cycles' camera space is Blender's with Z reversed. */
    direction = vector(u < 0.0 ? -ring * cos(phi) : ring * cos(phi), v < 0.0 ? -ring * sin(phi) : ring * sin(phi),
                       inner < 0.0 ? z : -z);
""" + CAMERA_ENDS

# Directions that a point's surroundings are looked at in, and the share of them that may meet the back of a surface: more of them
# say that the point lies inside a solid.
_LOOKS, _BACK_FACES = 192, 0.1
# Points a side of a pixel over which the basis is integrated.
_SUBPIXELS = 8
# From where to where the camera sees [m]: all there is.
_CLIP = 1e-6, 1e9


@dataclass(frozen=True)
class CyclesSettings:
    """How a reference is rendered.

    ``order`` is the SH order; ``resolution`` the side of a probe's tile [pixels] (a panorama is twice as wide as high and has
    this height): radiance is averaged within a pixel, which takes 0.25 %, 0.07 % and 0.02 % off the norm at 32, 64 and 128;
    ``samples`` per pixel and seed; ``seeds`` how many independent renders are averaged, beginning at ``first_seed``;
    ``bounces`` the longest path; ``threads`` None means every core; ``method`` is 'tiles', 'panorama' or 'auto'.
    """

    order: int = 2
    resolution: int = 64
    samples: int = 64
    seeds: int = 1
    first_seed: int = 0
    bounces: int = 64
    threads: int | None = None
    method: str = "auto"


def volume_points(scene: bpy.types.Scene) -> np.ndarray:
    """The lattice points (n, 3) [m] of every Light Probe Volume in ``scene``, z slowest, one volume after another."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = [np.zeros((0, 3))]
    for item in depsgraph.object_instances:
        data = item.object.data
        if item.object.type == "LIGHT_PROBE" and data.type == "VOLUME":
            resolution = (data.resolution_x, data.resolution_y, data.resolution_z)
            found.append(grid.lattice_points(np.array(item.matrix_world), resolution).reshape(-1, 3))
    return np.concatenate(found)


def points_in_the_open(scene: bpy.types.Scene, points_world: np.ndarray, clearance: float, count: int) -> np.ndarray:
    """Ascending indices of at most ``count`` of ``points_world`` (n, 3) that lie outside solids, at least ``clearance`` [m] from
    every surface, and far from one another (each is the farthest from those before it)."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    directions = sampling.fibonacci_sphere(_LOOKS)

    def in_the_open(point):
        behind, nearest = 0, np.inf
        for direction in directions:
            hit, place, normal, *_ = scene.ray_cast(depsgraph, point, direction)
            if hit:
                behind += normal.dot(direction) > 0
                nearest = min(nearest, float(np.linalg.norm(np.array(place) - point)))
        return behind <= _BACK_FACES * len(directions) and nearest >= clearance

    found = np.array([index for index, point in enumerate(points_world) if in_the_open(point)], np.int64)
    if len(found) == 0:
        raise BakeError("no point of the lattice lies in the open", "move the volume or make its resolution higher")
    open_points = points_world[found]
    chosen = [0]
    distance = np.linalg.norm(open_points - open_points[0], axis=1)
    while len(chosen) < min(count, len(found)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(open_points - open_points[chosen[-1]], axis=1))
    return np.sort(found[chosen])


def render_probes(points_world, settings: CyclesSettings | None = None, scene: bpy.types.Scene | None = None,
                  progress=None) -> dict:
    """Render the incident radiance at ``points_world`` (n, 3) of the open file and project it to SH.

    Returns ``sh`` (n, (L+1)², 3) float64, the mean over seeds; ``variance`` of the same shape, the variance of that mean (NaN
    for one seed); ``seconds``, wall clock from the first render call to SH; ``points``; ``method``. Raises BakeError if Cycles is
    missing or the render fails.
    """
    settings = settings or CyclesSettings()
    scene = scene or bpy.context.scene
    points = np.asarray(points_world, np.float64).reshape(-1, 3)
    method = settings.method
    if method == "auto":
        method = "tiles" if bpy.app.build_options.cycles_osl else "panorama"
    prepare, render = (_camera_tiles, _render_tiles) if method == "tiles" else (_camera_panorama, _render_panoramas)
    with rendering(scene, settings) as camera, tempfile.TemporaryDirectory() as name:
        folder, started = Path(name), time.perf_counter()
        weights = prepare(camera, scene, points, settings, folder)
        total = np.zeros((len(points), sh.coefficient_count(settings.order), 3))
        squares = np.zeros_like(total)
        for index in range(settings.seeds):
            scene.cycles.seed = settings.first_seed + index
            if progress is not None:
                progress.step(index / settings.seeds, f"Cycles render {index + 1} of {settings.seeds}")
            estimate = render(scene, camera, points, settings, weights, folder)
            total += estimate
            squares += estimate**2
        seconds = time.perf_counter() - started
    mean = total / settings.seeds
    if settings.seeds > 1:
        variance = np.maximum(squares / settings.seeds - mean**2, 0.0) / (settings.seeds - 1)
    else:
        variance = np.full_like(mean, np.nan)
    return {"sh": mean, "variance": variance, "seconds": seconds, "points": points, "method": method}


def octahedral_directions(xy: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) of the equal-area octahedral map at ``xy`` (n, 2) in [−1, 1]², z = +1 in the middle; the camera
    shader's twin (Clarberg 2008, §3)."""
    u, v = np.asarray(xy, np.float64).T
    inner = 1.0 - np.abs(u) - np.abs(v)
    r = 1.0 - np.abs(inner)
    phi = np.where(r > 0, (np.abs(v) - np.abs(u)) / np.where(r > 0, r, 1.0) + 1.0, 0.0) * (np.pi / 4)
    ring = r * np.sqrt(np.maximum(2.0 - r * r, 0.0))
    return np.stack((np.copysign(ring * np.cos(phi), u), np.copysign(ring * np.sin(phi), v),
                     np.copysign(1.0 - r * r, inner)), axis=-1)


def _camera_tiles(camera, scene, points, settings, folder) -> np.ndarray:
    """Give ``camera`` the shader for ``points`` and ``scene`` the picture's size; returns the pixels' projection weights
    (resolution², k): the integral of each basis function over each pixel of a tile, rows from the bottom."""
    count, resolution = len(points), settings.resolution
    columns = int(np.ceil(np.sqrt(count)))
    rows = -(-count // columns)
    scene.render.resolution_x, scene.render.resolution_y = columns * resolution, rows * resolution
    source = _PROBE_CAMERA.format(
        floats=3 * count, parameters="", places=count, columns=columns, rows=rows, quarter_pi=repr(np.pi / 4),
        origins=listed(points))
    set_camera(camera, compile_camera(source, folder))
    return _pixel_weights(resolution, settings.order)


def listed(values: np.ndarray) -> str:
    """``values`` as OSL initialises an array of floats with them."""
    return ", ".join(repr(float(value)) for value in np.asarray(values, np.float32).ravel())


def compile_camera(source: str, folder: Path) -> str:
    """The bytecode of the OSL camera ``source``, by way of files in ``folder``. Raises BakeError."""
    (folder / "camera.osl").write_text(source)
    # Blender's own way from a text to a camera needs a module (oslquery) that bpy from PyPI lacks; the compiler is there.
    import _cycles
    if not _cycles.osl_compile(str(folder / "camera.osl"), str(folder / "camera.oso")):
        raise BakeError("Cycles could not compile the camera that starts rays where they are wanted",
                        "use method='panorama', or the path reference")
    return (folder / "camera.oso").read_text()


def set_camera(camera: bpy.types.Object, bytecode: str) -> None:
    """Let ``camera`` start its rays as the compiled OSL says."""
    camera.data.type, camera.data.custom_mode = "CUSTOM", "INTERNAL"
    camera.data.custom_bytecode = bytecode
    camera.data.custom_bytecode_hash = hashlib.md5(bytecode.encode(), usedforsecurity=False).hexdigest()


def _pixel_weights(resolution: int, order: int, sub: int = _SUBPIXELS) -> np.ndarray:
    """∫ Y dω over each pixel of an equal-area tile, by ``sub``² points a pixel: (resolution², k)."""
    centre = (np.arange(resolution * sub) + 0.5) / (resolution * sub) * 2.0 - 1.0
    v, u = np.meshgrid(centre, centre, indexing="ij")
    basis = sh.evaluate(octahedral_directions(np.stack((u.ravel(), v.ravel()), axis=1)), order).astype(np.float64)
    basis = basis.reshape(resolution, sub, resolution, sub, -1).mean(axis=(1, 3))
    return basis.reshape(resolution**2, -1) * (4.0 * np.pi / resolution**2)


def _render_tiles(scene, camera, points, settings, weights, folder) -> np.ndarray:
    """One render of every probe's tile, projected: (n, k, 3)."""
    resolution = settings.resolution
    picture = render_picture(scene, folder)
    rows, columns = picture.shape[0] // resolution, picture.shape[1] // resolution
    tiles = picture.reshape(rows, resolution, columns, resolution, 3).transpose(0, 2, 1, 3, 4)
    tiles = tiles.reshape(rows * columns, resolution**2, 3)[:len(points)]
    return np.einsum("npc,pk->nkc", tiles, weights, optimize=True)


def _camera_panorama(camera, scene, points, settings, folder) -> np.ndarray:
    """Make ``camera`` equirectangular, its middle looking along +Y with +Z up; returns the projection weights
    (2·resolution², k), rows from the bottom."""
    resolution = settings.resolution
    scene.render.resolution_x, scene.render.resolution_y = 2 * resolution, resolution
    camera.data.type = "PANO"
    camera.data.panorama_type = "EQUIRECTANGULAR"
    camera.rotation_euler = (np.pi / 2, 0.0, 0.0)
    sub = _SUBPIXELS
    elevation = np.linspace(-np.pi / 2, np.pi / 2, resolution + 1)
    azimuth = np.linspace(np.pi, -np.pi, 2 * resolution + 1)

    def midpoints(edges, fractions):
        return (edges[:-1, None] + np.diff(edges)[:, None] * fractions).ravel()

    fractions = (np.arange(sub) + 0.5) / sub
    theta, phi = np.meshgrid(midpoints(elevation, fractions), midpoints(azimuth, fractions), indexing="ij")
    directions = np.stack((-np.sin(phi) * np.cos(theta), np.cos(phi) * np.cos(theta), np.sin(theta)), axis=-1)
    basis = sh.evaluate(directions.reshape(-1, 3), settings.order).astype(np.float64).reshape(*theta.shape, -1)
    basis = (basis * np.cos(theta)[..., None]).reshape(resolution, sub, 2 * resolution, sub, -1).mean(axis=(1, 3))
    # A row's pixels share its exact solid angle; the sub-points only spread it over the basis.
    row_cosine = np.cos(theta[:, 0]).reshape(resolution, sub).mean(axis=1)
    solid_angle = np.diff(np.sin(elevation)) * (np.pi / resolution)
    return (basis / row_cosine[:, None, None] * solid_angle[:, None, None]).reshape(2 * resolution**2, -1)


def _render_panoramas(scene, camera, points, settings, weights, folder) -> np.ndarray:
    """One equirectangular render a probe, projected: (n, k, 3)."""
    result = np.empty((len(points), weights.shape[1], 3))
    for index, point in enumerate(points):
        camera.location = point
        result[index] = weights.T @ render_picture(scene, folder).reshape(-1, 3)
    return result


def render_picture(scene, folder: Path) -> np.ndarray:
    """Render ``scene``; returns linear radiance (height, width, 3) float64, row 0 at the bottom.

    Python cannot read a Render Result's pixels in the background, so the picture goes through a float EXR.
    """
    path = folder / "render.exr"
    path.unlink(missing_ok=True)
    scene.render.filepath = str(path)
    bpy.ops.render.render(scene=scene.name, write_still=True)
    if not path.exists():
        raise BakeError(f"Cycles wrote no picture for {scene.name!r}", "look at Blender's console for the reason")
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        pixels = np.empty(height * width * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, -1)[..., :3].astype(np.float64)
    finally:
        bpy.data.images.remove(image)


def _has_links() -> bool:
    """Whether any light is linked: then Cycles' light tree counts light twice. Three lamps, one of them linked, give a third more
    together than they do one by one (Blender 5.2); without the tree they do not."""
    linkings = (getattr(obj, "light_linking", None) for obj in bpy.data.objects)
    return any(linking is not None and (linking.receiver_collection or linking.blocker_collection) for linking in linkings)


def _takes_part(obj) -> bool:
    """Whether a bake knows ``obj``: what it does not know, a reference does not render."""
    if is_left_out(obj) or obj.hide_probe_volume:
        return False
    return obj.type != "LIGHT" or lamp_role(obj.data) != NOT_AT_ALL


@contextmanager
def rendering(scene: bpy.types.Scene, settings: CyclesSettings):
    """Set ``scene`` up for unbiased renders through a camera of our own (yielded); put everything back at the end."""
    import addon_utils
    if not hasattr(scene, "cycles"):
        addon_utils.enable("cycles")
    if not hasattr(scene, "cycles"):
        raise BakeError("Cycles is not available in this Blender", "enable the Cycles add-on")
    changed = []

    def set_to(owner, **values):
        for name, value in values.items():
            if hasattr(owner, name):
                changed.append((owner, name, getattr(owner, name)))
                setattr(owner, name, value)

    data = bpy.data.cameras.new("RTGI probe camera")
    data.clip_start, data.clip_end = _CLIP
    camera = bpy.data.objects.new("RTGI probe camera", data)
    scene.collection.objects.link(camera)
    try:
        image = scene.render.image_settings
        # A change of format resets the depth and the rest, so these are noted before and put back after the format.
        changed.extend((image, name, getattr(image, name)) for name in ("color_depth", "color_mode", "exr_codec"))
        set_to(image, **({"media_type": "IMAGE"} if hasattr(image, "media_type") else {}))
        set_to(image, file_format="OPEN_EXR", color_mode="RGB", color_depth="32", exr_codec="NONE")
        set_to(scene, camera=camera)
        set_to(scene.render, engine="CYCLES", resolution_x=scene.render.resolution_x, resolution_y=scene.render.resolution_y,
               resolution_percentage=100, pixel_aspect_x=1.0, pixel_aspect_y=1.0, use_border=False, use_multiview=False,
               use_motion_blur=False, use_compositing=False, use_sequencer=False, use_single_layer=True, use_stamp=False,
               film_transparent=False, use_persistent_data=True, filepath=scene.render.filepath, use_file_extension=True,
               threads_mode="FIXED" if settings.threads else "AUTO", threads=settings.threads or scene.render.threads)
        set_to(scene.cycles, device="CPU", samples=settings.samples, seed=scene.cycles.seed, use_animated_seed=False,
               sample_offset=0, use_sample_subset=False, time_limit=0.0, use_adaptive_sampling=False, use_denoising=False,
               use_guiding=False, sampling_pattern="BLUE_NOISE", sample_clamp_direct=0.0, sample_clamp_indirect=0.0,
               light_sampling_threshold=0.0, blur_glossy=0.0, use_fast_gi=False, use_auto_tile=False, pixel_filter_type="BOX",
               filter_width=scene.cycles.filter_width,
               film_exposure=1.0, use_light_tree=not _has_links(), max_bounces=settings.bounces, diffuse_bounces=settings.bounces,
               glossy_bounces=settings.bounces, transmission_bounces=settings.bounces, volume_bounces=settings.bounces,
               volume_biased=False,
               transparent_max_bounces=max(settings.bounces, scene.cycles.transparent_max_bounces), min_light_bounces=0,
               min_transparent_bounces=0)
        for obj in bpy.data.objects:  # not scene.objects: a lamp may be there only through a collection instance
            if obj.type == "LIGHT":
                set_to(obj, visible_camera=False)
            if not _takes_part(obj):
                set_to(obj, hide_render=True)
        yield camera
    finally:
        for owner, name, value in reversed(changed):
            setattr(owner, name, value)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)
