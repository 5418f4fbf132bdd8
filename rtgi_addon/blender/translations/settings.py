"""Labels and tooltips that are made from settings: in German the tooltip of a number is its description's translation and
"(1 bis 6)", without an entry of its own."""

from collections.abc import Callable, Iterator
from dataclasses import fields

from ...effects import registry as effects
from ...preview.settings import OverlaySettings, PreviewSettings
from ...techniques import registry
from ...techniques.probes.live import LiveSettings
from ..ui.properties import override_texts, tooltip, use_text


def made_from_settings(translate: Callable[[str], str]) -> Iterator[tuple[str, str]]:
    """(English, translated) of every text that `properties` puts together, by ``translate`` for what it is put together from."""
    owners = *registry().values(), *effects().values()
    for settings in (*(owner.Settings for owner in owners), PreviewSettings, OverlaySettings, LiveSettings):
        for item in fields(settings):
            if not item.metadata:
                continue
            label = item.metadata["label"]
            yield tooltip(item), tooltip(item, translate)
            yield use_text(label), use_text(label, translate)
            yield from zip(override_texts(label), override_texts(label, translate), strict=True)
