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
    "Fit to Surfaces": "An Flächen anpassen",
    "Change what probes store so that surfaces, and what moves, read from them what is nearest to the light there: better light "
    "from the same probes, for up to twice the time":
        "Was Sonden speichern, so ändern, dass Flächen und Bewegtes aus ihnen lesen, was dem Licht dort am nächsten ist: besseres "
        "Licht aus denselben Sonden, in bis zu doppelt so langer Zeit",
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
    "Cells along each side of every cascade; finer ones show smaller things and take more steps":
        "Zellen entlang jeder Seite jeder Kaskade; feinere zeigen kleinere Dinge und brauchen mehr Schritte",
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
    "How often light moves on by one cell; games use 8, a room needs ten times its cells":
        "Wie oft Licht um eine Zelle weiterzieht; Spiele nehmen 8, ein Raum braucht das Zehnfache seiner Zellen",
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

    # Ray-traced light.
    "Gather": "Sammeln",
    "Bake": "Gebackenes",
    "Where the indirect light of renders comes from": "Woher das indirekte Licht gerenderter Bilder kommt",
    "What was baked, as in the viewport": "Aus dem Gebackenen, wie im Ansichtsfenster",
    "Rays of every pixel, without a bake: exact, on the CPU": "Strahlen aus jedem Pixel, ohne Backen: genau, auf der CPU",
    "Picture Error": "Bildfehler",
    "How far the picture may be off by its noise: samples end where all of it is nearer, as a root mean square relative to its "
    "mean":
        "Wie weit das Bild durch Rauschen abweichen darf: die Abtastung endet darunter (quadratisches Mittel über den Mittelwert)",
    "Most Samples": "Höchstens Abtastwerte",
    "No pixel of a render by rays has more samples than this": "Mehr Abtastwerte hat kein Pixel eines Bildes durch Strahlen",
    "Diffuse Rays": "Diffuse Strahlen",
    "Rays over the hemisphere of a pixel in each sample of the picture; 0 leaves diffuse light as the bake has it":
        "Strahlen über die Halbkugel eines Pixels in jedem Sample des Bildes; 0 lässt das diffuse Licht, wie es gebacken ist",
    "Glossy Rays": "Glanzstrahlen",
    "Rays that a pixel's glossy layer reflects in each sample of the picture; 0 shows no reflections but those of lamps":
        "Strahlen, die die Glanzschicht eines Pixels in jedem Sample des Bildes spiegelt; 0 zeigt nur die Spiegelungen von Lampen",
    "Ray Budget": "Strahlenbudget",
    "Most diffuse rays in each sample of the picture, in millions: of large pictures some of the pixels have rays, in turn, and "
    "the others take from them":
        "Höchstzahl diffuser Strahlen in jedem Sample des Bildes, in Millionen: Bei großen Bildern haben reihum einige der Pixel "
        "Strahlen, und die anderen bedienen sich bei ihnen",
    "Share Between Pixels": "Zwischen Pixeln teilen",
    "Pixels take part of their diffuse light from like neighbours, less from sample to sample: much less noise for a little blur "
    "where light changes fast":
        "Pixel nehmen einen Teil ihres diffusen Lichts von ähnlichen Nachbarn, von Sample zu Sample weniger: viel weniger Rauschen "
        "für ein wenig Unschärfe, wo sich das Licht schnell ändert",
    "Reflections": "Spiegelungen",
    "From mirror to mirror so often": "So oft von Spiegel zu Spiegel",

    # Media.
    "Tile": "Kachel",
    "Pixels along the side of a column of the volume: what is finer in fog and smoke is blurred":
        "Pixel entlang der Seite einer Säule des Volumens: Was in Nebel und Rauch feiner ist, verschwimmt",
    "Slices": "Scheiben",
    "Parts that the volume's columns are cut into, finer near the eye":
        "Teile, in die die Säulen des Volumens geschnitten sind, feiner nahe am Auge",
    "Range": "Reichweite",
    "Distance from the eye to which media are seen; unset as far as there are any":
        "Abstand vom Auge, bis zu dem Medien zu sehen sind; ohne Angabe so weit, wie es welche gibt",
    "Steady": "Ruhig",
    "Go on from the light in media of the sample before while the view moves; as soon as anything is lit otherwise, nothing of it "
    "counts":
        "Während sich die Ansicht bewegt, vom Licht in Medien des vorigen Samples ausgehen; sobald etwas anders beleuchtet ist, "
        "zählt nichts davon",
    "Orders": "Ordnungen",
    "From every slice in each sample of the picture to where light that it scatters comes from: right however coarse the bake's "
    "lattice is beside the medium, and slow; 0 takes that light from the bake":
        "Aus jeder Schicht in jedem Sample des Bildes dorthin, woher das Licht kommt, das sie streut: richtig, wie grob das "
        "gebackene "
        "Gitter neben dem Medium auch ist, und langsam; 0 nimmt dieses Licht aus dem Gebackenen",
    "What media scatter: all light, by as many orders as the bake knows, or that of lamps alone, once":
        "Was Medien streuen: alles Licht, in so vielen Ordnungen, wie das Gebackene kennt, oder nur das der Lampen, einmal",
    "All": "Alle",
    "Lamps": "Lampen",

    # Mist.
    "Fade To": "Verschwinden in",
    "What things vanish into: the world behind them, or a colour":
        "Worin Dinge verschwinden: in der Welt hinter ihnen oder in einer Farbe",
    "World": "Welt",
    "Color": "Farbe",
    "Mist Color": "Nebelfarbe",
    "What things vanish into, if not the world": "Worin Dinge verschwinden, wenn nicht in der Welt",
    "Mist Strength": "Nebelstärke",
    "How much of the light mist can take": "Wie viel vom Licht der Nebel nehmen kann",
    "Mist Start": "Nebelanfang",
    "Distance from the eye at which mist begins; unset as the world's mist pass":
        "Abstand vom Auge, in dem der Nebel beginnt; ohne Angabe wie im Nebel-Pass der Welt",
    "Mist Depth": "Nebeltiefe",
    "Distance over which mist thickens; unset as the world's mist pass":
        "Strecke, über die der Nebel dichter wird; ohne Angabe wie im Nebel-Pass der Welt",
    "Mist Falloff": "Nebelverlauf",
    "How mist thickens with distance; world as the world's mist pass":
        "Wie der Nebel mit dem Abstand dichter wird; „Welt“ wie im Nebel-Pass der Welt",
    "Linear": "Linear",
    "Quadratic": "Quadratisch",
    "Inverse quadratic": "Invers quadratisch",
    "Over the World": "Über der Welt",
    "Cover the world, too: nothing is further away": "Auch die Welt verdecken: nichts ist weiter weg",

    # Screen-space reflections.
    "Screen-Space Reflections": "Spiegelungen aus dem Bild",
    "Reflections of what the picture shows, and of the bake elsewhere: fast, not exact":
        "Spiegelungen dessen, was das Bild zeigt, sonst aus dem Gebackenen: schnell, nicht exakt",
    "Mirror confidence": "Verlässlichkeit der Spiegelung",
    "Mirror distance": "Weite der Spiegelung",
    "Mirror Confidence": "Verlässlichkeit der Spiegelung",
    "Mirror Distance": "Weite der Spiegelung",
    "Deliver how far screen-space reflections are believed, 0 where the bake stands in":
        "Ausgeben, wie sehr Spiegelungen aus dem Bild gelten, 0 wo das Gebackene einspringt",
    "Deliver how far away what screen-space reflections show is (in m), 0 for nothing":
        "Ausgeben, wie weit entfernt ist, was Spiegelungen aus dem Bild zeigen (in m), 0 für nichts",
    "Rays": "Strahlen",
    "Mirrored rays of a pixel in each sample of the picture": "Gespiegelte Strahlen eines Pixels in jedem Abtastwert des Bildes",
    "Search": "Suche",
    "How rays are followed: pixel by pixel with blocks stepped over, or by even steps":
        "Wie Strahlen verfolgt werden: Pixel für Pixel, wobei Blöcke übersprungen werden, oder in gleichen Schritten",
    "Hierarchical": "Hierarchisch",
    "Pixels or blocks that a ray looks at before the fallback takes its place":
        "Pixel oder Blöcke, die ein Strahl ansieht, bevor der Ersatz an seine Stelle tritt",
    "Thickness": "Dicke",
    "How far behind a surface a ray still meets it: more smears, less leaves holes":
        "Wie weit hinter einer Fläche ein Strahl sie noch trifft: mehr verschmiert, weniger lässt Löcher",
    "Max Roughness": "Größte Rauheit",
    "Rougher surfaces show the fallback alone; reflections fade from three quarters of it on":
        "Rauere Flächen zeigen nur den Ersatz; ab drei Vierteln davon blenden Spiegelungen aus",
    "Border": "Rand",
    "Share of the picture at its edges over which reflections of it fade":
        "Anteil des Bildes an seinen Rändern, auf dem Spiegelungen davon ausblenden",
    "Distance": "Reichweite",
    "How far rays go": "Wie weit Strahlen reichen",
    # Radiance transfer.
    "Rays of every probe": "Strahlen jeder Sonde",
    "Sky Order": "Himmelsordnung",
    "Highest band of the skies that are transferred exactly; what of a sky is beyond goes by the sun's directions":
        "Höchstes Band der Himmel, die genau übertragen werden; was ein Himmel darüber hinaus hat, geht über die Sonnenrichtungen",
    "Sun Directions": "Sonnenrichtungen",
    "Side of the square grid of directions from which the sun is transferred: 24 are 576 directions":
        "Seitenlänge des quadratischen Gitters von Richtungen, aus denen die Sonne übertragen wird: 24 sind 576 Richtungen",
    "Sun from Below": "Sonne von unten",
    "Transfer suns from below the horizon as well, for twice the storage":
        "Auch Sonnen unter dem Horizont übertragen, für doppelten Speicher",
    "Sun Vectors": "Sonnenvektoren",
    "Store suns as products with so many vectors that all probes share: 64 take a fifth of 576 directions; 0 stores all":
        "Sonnen als Produkte mit so vielen Vektoren speichern, die alle Sonden teilen: 64 brauchen ein Fünftel von 576 Richtungen; "
        "0 speichert alle",
    "Lamp Sites": "Lampenorte",
    "Probes at which a lamp is transferred to all the others, for lamps that the bake does not know":
        "Sonden, bei denen eine Lampe an alle anderen übertragen wird, für Lampen, die das Gebackene nicht kennt",
    "Half Floats": "Halbe Gleitkommazahlen",
    "Store what sky, suns and lamp sites give in 16 bits":
        "Was Himmel, Sonnen und Lampenorte geben, in 16 Bit speichern",
    "Side of the surface cache's texels; unset chooses it from scene, spacing and rays":
        "Seitenlänge der Texel des Flächenspeichers; ohne Angabe aus Szene, Abstand und Strahlen gewählt",
    "Rays from each texel of the surface cache; unset chooses them by the rays of probes":
        "Strahlen aus jedem Texel des Flächenspeichers; ohne Angabe nach den Strahlen der Sonden gewählt",
}
