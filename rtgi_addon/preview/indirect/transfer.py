"""Transfer in the preview: probes that follow sun, sky and groups of lights, from a bundle on disk as well."""

from collections.abc import Callable

from ...effects.atlas.relight import with_atlas
from ...progress import Progress
from ...scene import Scene
from ...techniques.base import Field
from ...techniques.transfer.field import TransferField
from .probes import probe_tables
from .relighting import RelitLight


class TransferLight(RelitLight):
    """The light of ``field``, in that of ``scene`` as soon as a worker has it: it may be another than when it was baked."""

    follows_surfaces = True

    def __init__(self, field: TransferField, scene: Scene):
        def lit(relight: Callable[[Scene, Progress], Field]) -> Callable[[Scene, Progress], Field]:
            return lambda scene, progress: with_atlas(relight(scene, progress), field, scene)

        super().__init__(field, probe_tables, lit(field.relight),
                         refine=lambda scene, progress: lit(field.relight_exactly)(scene, progress) if field.exact_suns else None)
        self.follow(scene)
