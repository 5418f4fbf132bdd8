"""From a bundle to an engine's project folder."""

from dataclasses import replace
from pathlib import Path

from ..errors import BakeError, UsageError
from ..exchange import engines
from ..exchange.bundle import read_bundle
from ..exchange.engines import ExportReport, ExportSettings
from ..progress import Progress

_GLB_MAGIC = b"glTF"
# The share of the progress that reading and checking the bundle is given.
_READ_SHARE = 0.2


def export_bundle(bundle, engine: str, out, *, model=None, conformance: bool = True, model_notes=(),
                  progress: Progress | None = None) -> ExportReport:
    """Export the bundle at path ``bundle`` to ``out`` for the engine called ``engine``, ``model`` (a .glb) in its sample scene.

    ``model_notes`` say what the model lacks, which shows unless the bundle holds the lamps' light itself.
    Raises UsageError for an unknown engine, BakeError for a bundle, model or folder that will not do, Cancelled; an earlier
    export at ``out`` then stays as it was.
    """
    progress = progress or Progress()
    target = engines.get(engine)
    settings = ExportSettings(None if model is None else str(_checked_model(model)), conformance)
    # What can fail without the bundle fails before it is read.
    target.check_target(out)
    progress.step(0.0, "Reading the bundle")
    content = read_bundle(bundle)
    report = target.export(content, out, settings, progress.span(_READ_SHARE, 1.0))
    return report if content.field.includes_direct else replace(report, notes=(*report.notes, *model_notes))


def _checked_model(model) -> Path:
    path = Path(model).expanduser().resolve()
    if path.suffix.lower() != ".glb":
        raise UsageError(f"the model {path.name} is not a .glb", "export glTF Binary from Blender")
    try:
        with open(path, "rb") as file:
            magic = file.read(len(_GLB_MAGIC))
    except OSError as error:
        raise BakeError(f"cannot read the model {path}", "correct the path of --model") from error
    if magic != _GLB_MAGIC:
        raise BakeError(f"the model {path} is not glTF Binary", "export it again from Blender as .glb")
    return path
