"""Why a plan is what it is, and what a technique says of a bake, in German, by the pattern of their English."""

PLANS: dict[str, str] = {
    "The scene is enclosed: no sky is seen, and no ray is spent on it.":
        "Die Szene ist geschlossen: kein Himmel ist zu sehen, und kein Strahl gilt ihm.",
    "The scene is open ({0} of the directions), but the world is black: no ray is spent on it.":
        "Die Szene ist offen ({0} der Richtungen), aber die Welt ist schwarz: kein Strahl gilt ihr.",
    "The sky is seen in {0} of the directions and lights the scene.":
        "Der Himmel ist in {0} der Richtungen zu sehen und beleuchtet die Szene.",
    "There is neither a lamp nor an emissive surface, and none is sampled.":
        "Es gibt weder eine Lampe noch eine leuchtende Fläche, und keine wird abgetastet.",
    "Behind {0} of what is seen the wall is thinner than the {1} m between the file's probes ({2}); the distances that every probe "
    "keeps hold light back there.":
        "Hinter {0} dessen, was zu sehen ist, ist die Wand dünner als die {1} m zwischen den Sonden der Datei ({2}); dort "
        "halten die "
        "Abstände, die jede Sonde sich merkt, Licht zurück.",
    "{0} of the surface that probes see lies outside the volumes, where the outermost probes are all there is.":
        "{0} der Fläche, die Sonden sehen, liegt außerhalb der Volumen, wo es nur die äußersten Sonden gibt.",
    "{0}: the bake holds the light of this frame. Probes are relit from what their rays hit, without new ones, and so follow a "
    "lamp "
    "in the preview.":
        "{0}: gebacken wird das Licht dieses Bildes. Sonden werden aus dem, was ihre Strahlen trafen, ohne neue Strahlen neu "
        "beleuchtet "
        "und folgen so in der Vorschau einer Lampe.",
    "{0}: probes in mid-air are kept to light what moves; the light that it reflects stays where it is in this frame.":
        "{0}: Sonden mitten in der Luft bleiben, um Bewegtes zu beleuchten; das Licht, das es reflektiert, bleibt, wo es in "
        "diesem Bild "
        "ist.",
    "At this error {0} is cheaper than exact probes.": "Bei diesem Fehler ist {0} billiger als genaue Sonden.",
    "Rays stop once a probe's own light is known to {0}, which costs less than a finer lattice would. Light is followed until "
    "it has "
    "died away, since further bounces take no rays.":
        "Strahlen enden, sobald das Licht einer Sonde auf {0} genau bekannt ist, was weniger kostet als ein feineres Gitter. "
        "Licht wird "
        "verfolgt, bis es verklungen ist, denn weitere Reflexionen kosten keine Strahlen.",
    "{0} of {1} probes get no rays, since no surface reads them: in the bundle their validity is 0 and they hold their neighbours' "
    "light.":
        "{0} von {1} Sonden bekommen keine Strahlen, weil keine Fläche sie liest: im Gebackenen ist ihre Gültigkeit 0, und sie "
        "haben "
        "das Licht ihrer Nachbarn.",
    "{0} keeps its {1} probes.": "{0} behält seine {1} Sonden.",
    "{0} goes from {1} to {2} probes: {3}.": "{0} geht von {1} auf {2} Sonden: {3}.",
    "finer where light changes, coarser along the axes where it is smooth":
        "feiner, wo Licht sich ändert, gröber entlang der Achsen, an denen es gleichmäßig ist",
    "coarser, since light is smooth there": "gröber, denn dort ist Licht gleichmäßig",
    "{0} at surfaces is met by {1}: {2} is predicted, and less than {3} with {4} % confidence.":
        "{0} auf Flächen erreicht {1}: vorhergesagt sind {2}, und mit {4} % Sicherheit weniger als {3}.",
    "{0} at surfaces cannot be met: {1}. What is planned is the cheapest that comes near the best there is, {2}.":
        "{0} auf Flächen sind unerreichbar: {1}. Geplant ist das Billigste, das dem Besten nahekommt, {2}.",
    "finer lattices hardly improve it: light changes over less than any sane spacing, or leaks past geometry":
        "feinere Gitter bessern es kaum: Licht ändert sich auf kürzerer Strecke als jeder vernünftige Abstand, oder es leckt an "
        "Geometrie "
        "vorbei",
    "no ray setting brings it down": "mit keiner Zahl von Strahlen sinkt es",
    "The lattice alone is off by {0}.": "Allein das Gitter liegt daneben um {0}.",
    "The lattice alone is off by {0}: the error falls like the spacing to the power {1}.":
        "Allein das Gitter liegt daneben um {0}: der Fehler fällt wie der Abstand hoch {1}.",
    "SH of order {0}, as asked.": "SH der Ordnung {0}, wie verlangt.",
    "SH of order {0}: {1}, which would have to be finer.": "SH der Ordnung {0}: {1}, womit es feiner sein müsste.",
    "SH of order {0}, {1} numbers a channel: {2}, {3}.": "SH der Ordnung {0}, {1} Zahlen je Kanal: {2}, {3}.",
    "which adds less than can be told from noise": "das sind weniger mehr, als sich vom Rauschen unterscheiden lässt",
    "which is more than is asked for": "das ist mehr als verlangt",

    "rsm holds the first bounce of lamps only": "rsm kennt nur die erste Reflexion der Lampen",
    "rsm holds the first bounce of lamps only, without shadows on the bounced light":
        "rsm kennt nur die erste Reflexion der Lampen, ohne Schatten auf dem reflektierten Licht",
    "rsm leaves out the light of {0}": "rsm lässt dieses Licht aus: {0}",
    "rsm lets {0} cast shadows: a map holds the nearest surface only":
        "rsm lässt {0} Schatten werfen: eine Karte enthält nur die nächste Fläche",
    "the world": "die Welt",
    "emissive surfaces": "leuchtende Flächen",
}
