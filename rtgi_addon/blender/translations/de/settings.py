"""Labels and tooltips of the techniques' settings in German, by their English."""

SETTINGS: dict[str, str] = {
    # Settings that several techniques have.
    "SH Order": "SH-Ordnung",
    "Highest band of the spherical harmonics: 2 is what engines read, 1 is smaller":
        "Höchstes Band der Kugelflächenfunktionen: 2 lesen Engines, 1 ist kleiner",
    "Highest band of the spherical harmonics of the exported probes":
        "Höchstes Band der Kugelflächenfunktionen der exportierten Sonden",
    "Highest band of the spherical harmonics of the probes": "Höchstes Band der Kugelflächenfunktionen der Sonden",
    "Highest band of the exported probes; the volumes themselves hold order 1":
        "Höchstes Band der exportierten Sonden; die Volumen selbst enthalten Ordnung 1",
    "Bounces": "Reflexionen",
    "How often light may be reflected; unset follows it until it has died away":
        "Wie oft Licht reflektiert werden darf; ohne Angabe, bis es verklungen ist",
    "Include Lamps": "Lampen einschließen",
    "Add the direct light of lamps, which engines usually add themselves":
        "Das direkte Licht der Lampen hinzufügen, was Engines sonst selbst tun",
    "Samples": "Abtastwerte",

    # Irradiance probes.
    "Target Error": "Zielfehler",
    "Relative RMSE of the coefficients at which a probe stops tracing rays":
        "Relativer RMSE der Koeffizienten, bei dem eine Sonde keine Strahlen mehr verfolgt",
    "Rays per Probe": "Strahlen je Sonde",
    "A fixed number of rays for every probe instead of a target error":
        "Eine feste Zahl von Strahlen für jede Sonde statt eines Zielfehlers",
    "Most Rays": "Höchstens Strahlen",
    "No probe traces more rays than this, however noisy its surroundings":
        "Mehr Strahlen verfolgt keine Sonde, wie verrauscht ihre Umgebung auch ist",
    "Visibility Tile": "Sichtbarkeitskachel",
    "Side of each probe's octahedral tile of distances": "Seitenlänge der oktaedrischen Kachel von Abständen jeder Sonde",
    "Virtual Offset": "Virtueller Versatz",
    "Move probes that lie just inside geometry out of it": "Sonden, die knapp in Geometrie liegen, aus ihr herausrücken",
    "Texel Size": "Texelgröße",
    "Side of the surface cache's texels; unset chooses it from scene, spacing and target error":
        "Seitenlänge der Texel des Flächenspeichers; ohne Angabe aus Szene, Abstand und Zielfehler gewählt",
    "Cache Rays": "Strahlen des Flächenspeichers",
    "Rays from each texel of the surface cache; unset chooses them by the target error":
        "Strahlen von jedem Texel des Flächenspeichers; ohne Angabe nach dem Zielfehler gewählt",

    # Virtual point lights.
    "Virtual Lights": "Virtuelle Lichter",
    "How many virtual lights stand for all bounced light; time grows in proportion":
        "Wie viele virtuelle Lichter für alles reflektierte Licht stehen; die Zeit wächst im gleichen Maß",
    "Clamp": "Begrenzung",
    "Bound of a virtual light's geometry term, against bright spots near surfaces; unset lets no light give more than the mean "
    "irradiance, or a tenth of it with compensation; 0 has no bound":
        "Schranke des Geometrieterms eines virtuellen Lichts gegen helle Flecken nahe an Flächen; ohne Angabe gibt kein Licht "
        "mehr als "
        "die mittlere Bestrahlungsstärke, mit Ausgleich ein Zehntel davon; 0 ist ohne Schranke",
    "Compensation": "Ausgleich",
    "Give back by short rays what the clamp takes away from corners":
        "Mit kurzen Strahlen zurückgeben, was die Begrenzung Ecken nimmt",
    "Compensation Rays": "Strahlen des Ausgleichs",
    "Short rays per receiver": "Kurze Strahlen je Empfänger",
    "Candidates": "Kandidaten",
    "Virtual lights tried for each that is kept: of more, those that light the volumes are found more surely":
        "Virtuelle Lichter, die für jedes behaltene versucht werden: unter mehr finden sich sicherer die, die die Volumen "
        "beleuchten",

    # Reflective shadow maps.
    "Map Resolution": "Kartenauflösung",
    "Every lamp has this number squared of texels, over all of its maps":
        "Jede Lampe hat das Quadrat dieser Zahl an Texeln, in allen ihren Karten zusammen",
    "Texels that each receiver reads of every lamp": "Texel, die jeder Empfänger von jeder Lampe liest",
    "Every Texel": "Jedes Texel",
    "Sum over all texels instead of sampling them: slow, the reference":
        "Über alle Texel summieren, statt sie abzutasten: langsam, die Referenz",
    "Test Visibility": "Sichtbarkeit prüfen",
    "Trace a shadow ray to every sampled texel; the paper's gather has none and leaks through walls":
        "Zu jedem abgetasteten Texel einen Schattenstrahl verfolgen; im Artikel gibt es keinen, und Licht geht durch Wände",
    "Disk Radius": "Scheibenradius",
    "Radius of the importance disk around the projected receiver, in sides of the map":
        "Radius der Wichtigkeitsscheibe um den projizierten Empfänger, in Seitenlängen der Karte",
    "Disk Share": "Scheibenanteil",
    "Share of the samples in the disk; the others follow the flux. 1 is the paper's pattern, which misses what lies outside the "
    "disk":
        "Anteil der Abtastwerte in der Scheibe; die anderen folgen dem Lichtstrom. 1 ist das Muster des Artikels, dem entgeht, was "
        "außerhalb der Scheibe liegt",
    "Points per Area Lamp": "Punkte je Flächenlampe",
    "From how many points an area lamp is captured": "Von wie vielen Punkten aus eine Flächenlampe aufgenommen wird",
    "Sun Focus": "Sonnenausschnitt",
    "A sun's map covers this many times the box around all volumes":
        "Die Karte einer Sonne deckt dieses Vielfache des Quaders um alle Volumen ab",

    # Light propagation volumes.
    "Cells along each side of every cascade; light spreads with every cell it passes, so finer ones are not always more exact":
        "Zellen entlang jeder Seite jeder Kaskade; Licht zerfließt mit jeder Zelle, feinere sind also nicht immer genauer",
    "Cascades": "Kaskaden",
    "Nested volumes of the same resolution, each with cells twice as large":
        "Ineinander liegende Volumen gleicher Auflösung, jedes mit doppelt so großen Zellen",
    "Cell Size": "Zellgröße",
    "Side of the finest cascade's cells; unset fits that cascade around the probe volumes and the room they stand in":
        "Seitenlänge der Zellen der feinsten Kaskade; ohne Angabe umfasst sie die Sondenvolumen und den Raum, in dem sie stehen",
    "Center": "Mitte",
    "What the cascades are centred on: 'volumes', 'camera' or the name of an object":
        "Worum die Kaskaden liegen: „volumes“, „camera“ oder der Name eines Objekts",
    "Steps": "Schritte",
    "How often light moves on by one cell; games use 8, a room needs many times its cells":
        "Wie oft Licht um eine Zelle weiterzieht; Spiele nehmen 8, ein Raum braucht ein Vielfaches seiner Zellen",
    "Further Bounces": "Weitere Reflexionen",
    "Reflect light that meets geometry while it is propagated":
        "Licht reflektieren, das bei der Ausbreitung auf Geometrie trifft",
    "Blocking": "Verdeckung",
    "Let geometry stop light between cells": "Geometrie hält Licht zwischen Zellen auf",
    "Occluders": "Verdecker",
    "Geometry that blocks: all surfaces in the volume, or only what lamps and cameras see of it":
        "Geometrie, die verdeckt: alle Flächen im Volumen, oder nur, was Lampen und Kameras davon sehen",
    "Surfaces": "Flächen",
    "Views": "Ansichten",
    "Shadow Map Size": "Größe der Schattenkarten",
    "Texels along a side of each lamp's reflective shadow maps":
        "Texel entlang einer Seite der reflektierenden Schattenkarten jeder Lampe",
    "Self-light Damping": "Dämpfung der Selbstbeleuchtung",
    "Use the intensity's derivative along the normal to keep surfaces from lighting themselves":
        "Mit der Ableitung der Intensität entlang der Normale verhindern, dass Flächen sich selbst beleuchten",
}
