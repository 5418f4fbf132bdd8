"""From a bundle to an engine's project folder."""

import os
from dataclasses import replace
from pathlib import Path

from ..effects.stylized.settings import StylizedSettings
from ..errors import BakeError, UsageError
from ..exchange import engines
from ..exchange.bundle import read_bundle
from ..exchange.engines import ExportReport, ExportSettings
from ..progress import Progress
from ..scene import World
from ..storage.paths import resolved
from ..storage.reading import open_file

_GLB_MAGIC = b"glTF"
# The share of the progress that reading and checking the bundle is given.
_READ_SHARE = 0.2


def export_bundle(bundle, engine: str, out, *, model=None, conformance: bool = True, part: str = "all", missing_lamps=(),
                  even_lamps=(), lost=(), sky: World | None = None, style: StylizedSettings | None = None,
                  progress: Progress | None = None) -> ExportReport:
    """Export the bundle at path ``bundle`` to ``out`` for the engine called ``engine``, ``model`` (a .glb) in its sample scene.
    With the ``part`` 'files' only what goes into a project is written, into the one at ``out``.

    ``missing_lamps`` are the names of lamps that the model lacks, ``even_lamps`` of those that it has without their profile: notes
    say so of those whose direct light the bundle lacks too; ``lost`` are lines about what else the model does not hold, ``sky``
    what is seen behind it, ``style`` what pictures are drawn in, for engines that take one.
    Raises UsageError for an unknown engine, BakeError for a bundle, model or folder that will not do, Cancelled; an earlier
    export at ``out`` then stays as it was.
    """
    progress = progress or Progress()
    target = engines.get(engine)
    if part != "all" and model is not None:
        raise UsageError("a model goes into the sample scene, which is no part of what goes into a project",
                         "leave out --model, or export --part all")
    if style is not None and not target.styles:
        raise UsageError(f"{target.title} takes no style", f"export to {', '.join(engines.taking_styles())}, or leave it out")
    settings = ExportSettings(None if model is None else str(_checked_model(model)), conformance, part, sky, style)
    # What can fail without the bundle fails before it is read. Of the export's size the model's is known.
    out = target.check_target(out, part, inputs=[bundle, *([] if model is None else [model])],
                              size=0 if model is None else os.stat(settings.model).st_size)
    progress.step(0.0, "Reading the bundle")
    content = read_bundle(bundle, progress)
    report = target.export(content, out, settings, progress.span(_READ_SHARE, 1.0))
    held = content.field.direct_lamps
    dark, even = ([] if held is None else [name for name in names if name not in held] for names in (missing_lamps, even_lamps))
    more = list(lost)
    if dark:
        more.append(f"glTF has no area lamps, the model lacks {', '.join(dark)}: bake with direct light (--direct, Include Lamps) "
                    "to have theirs in the probes")
    if even:
        more.append(f"glTF has no lamps with a profile: the model has {', '.join(even)} as bright as on average everywhere")
    return replace(report, notes=(*content.unchecked, *report.notes, *more))


def _checked_model(model) -> Path:
    path = resolved(model, "--model")
    if path.suffix.lower() != ".glb":
        raise UsageError(f"the model {path.name} is not a .glb", "export glTF Binary from Blender")
    with open_file(path) as (file, _):
        magic = file.read(len(_GLB_MAGIC))
    if magic != _GLB_MAGIC:
        raise BakeError(f"the model {path} is not glTF Binary", "export it again from Blender as .glb")
    return path
