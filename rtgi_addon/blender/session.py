"""What this run of Blender knows about baking and no file should: the bake under way, findings, which bakes are out of date.

Everything is kept by scene name, because datablocks do not survive undo.
"""

from dataclasses import dataclass, field, replace

import bpy

from ..progress import Progress
from ..scene import Scene
from ..techniques import Field
from ..transport.media.summary import MediumFound, found_media
from .worker import Job


@dataclass(frozen=True)
class Finding:
    """A line for the panel. ``severity`` is 'error', 'warning' or 'note'; ``objects`` and ``materials`` are the names of what it is
    about, which a click on it selects."""

    severity: str
    text: str
    objects: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Baked:
    """A field that was baked in this session, and the scene it was baked from, which relights it."""

    field: Field
    scene: Scene

    def relight(self, scene: Scene, progress: Progress | None = None) -> Field:
        """The field under the lamps and the world of ``scene``, whatever else has changed there since the bake. Raises BakeError if
        it cannot be relit, Cancelled."""
        return self.field.relight(replace(self.scene, lights=scene.lights, world=scene.world), progress)


@dataclass(eq=False)
class Session(Job):
    """The bake as a job, and what is known of the scenes.

    By scene name: ``findings`` of its last reading (absent before the first); ``digests`` of the scene as it was last read;
    ``records``, what was written to ``Scene.rtgi.last_bake`` in this session; ``stale``, whether it differs from its last bake.
    ``media`` are those that its last reading found.
    ``baked`` holds, by scene name and technique, the last bake of this session: the preview shows and relights it.
    """

    findings: dict[str, list[Finding]] = field(default_factory=dict)
    digests: dict[str, str] = field(default_factory=dict)
    records: dict[str, dict] = field(default_factory=dict)
    stale: dict[str, bool] = field(default_factory=dict)
    baked: dict[tuple[str, str], Baked] = field(default_factory=dict)
    media: dict[str, tuple[MediumFound, ...]] = field(default_factory=dict)

    def note_media(self, name: str, scene: Scene) -> None:
        """Keep what a reading of the scene of that name found of media."""
        self.media[name] = found_media(scene.media)

    def forget(self) -> None:
        """Drop what was baked and found too."""
        super().forget()
        for known in (self.findings, self.digests, self.records, self.stale, self.baked, self.media):
            known.clear()


session = Session()


def redraw() -> None:
    """Draw the editors again that show a bake."""
    for manager in bpy.data.window_managers:
        for window in manager.windows:
            for area in window.screen.areas:
                if area.type in {"VIEW_3D", "PROPERTIES"}:
                    area.tag_redraw()


def redraw_progress() -> None:
    """Draw the sidebars again, and nothing else: a viewport drawn ten times a second would slow down what it waits for."""
    for manager in bpy.data.window_managers:
        for window in manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D":
                    for region in area.regions:
                        if region.type == "UI":
                            region.tag_redraw()
