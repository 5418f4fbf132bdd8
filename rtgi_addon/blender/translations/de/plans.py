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
    "coarser, but for finer volumes within": "gröber, bis auf feinere Volumen darin",
    "Finer volumes within coarser ones were tried, and save too few probes: the error is spread over the surfaces.":
        "Feinere Volumen in gröberen wurden versucht und sparen zu wenige Sonden: der Fehler ist über die Flächen verteilt.",
    "{0}, {1} probes within {2}, lies where most of the error was.":
        "{0}, {1} Sonden in {2}, liegt, wo der größte Teil des Fehlers war.",
    "Nested so, {0} probes do what takes {1} without.": "So ineinander leisten {0} Sonden, wozu es ohne das {1} braucht.",
    "Fitted to surfaces, {0} probes do what takes {1} as they are measured: a bake of them was held to points that its fit did not "
    "see.":
        "An Flächen angepasst leisten {0} Sonden, wozu es gemessen {1} braucht: was damit gebacken wurde, ist an Punkten geprüft, "
        "die die Anpassung nicht sah.",
    "Fitted to surfaces, no coarser lattice that was tried does: a bake of each was held to points that its fit did not see.":
        "An Flächen angepasst reicht kein gröberes Gitter, das versucht wurde: jedes wurde gebacken und an Punkten geprüft, die "
        "seine Anpassung nicht sah.",
    "the volume {0} is no longer there": "das Volumen {0} ist nicht mehr da",
    "plan again": "neu planen",
    "coarser, since light is smooth there": "gröber, denn dort ist Licht gleichmäßig",
    "{0} at surfaces is met by {1}: {2} is predicted, and less than {3} with {4} % confidence.":
        "{0} auf Flächen erreicht {1}: vorhergesagt sind {2}, und mit {4} % Sicherheit weniger als {3}.",
    "{0} at surfaces cannot be met: {1}. What is planned is what is worth its rays: {2}, and {3} without the worst {4} of the "
    "points.":
        "{0} auf Flächen sind unerreichbar: {1}. Geplant ist, was seine Strahlen wert ist: {2}, und {3} ohne die schlechtesten {4} "
        "der Punkte.",
    "{0} at surfaces cannot be met: {1}. What is planned is what is worth its rays: {2}, and {3} without the worst {4} of the "
    "points. The finest that was tried, {5}, is off by {6} and has {7} times the probes.":
        "{0} auf Flächen sind unerreichbar: {1}. Geplant ist, was seine Strahlen wert ist: {2}, und {3} ohne die schlechtesten {4} "
        "der Punkte. Das feinste, das versucht wurde, {5}, liegt um {6} daneben und hat {7}-mal so viele Sonden.",
    "finer lattices hardly improve it: light changes over less than any sane spacing, or leaks past geometry":
        "feinere Gitter bessern es kaum: Licht ändert sich auf kürzerer Strecke als jeder vernünftige Abstand, oder es leckt an "
        "Geometrie "
        "vorbei",
    "finer lattices improve it too slowly for what they take": "feinere Gitter bessern es zu langsam für das, was sie kosten",
    "no ray setting brings it down": "mit keiner Zahl von Strahlen sinkt es",
    "The lattice alone is off by {0}.": "Allein das Gitter liegt daneben um {0}.",
    "The lattice alone is off by {0}: the error falls like the spacing to the power {1}.":
        "Allein das Gitter liegt daneben um {0}: der Fehler fällt wie der Abstand hoch {1}.",
    "SH of order {0}, as asked.": "SH der Ordnung {0}, wie verlangt.",
    "SH of order {0}: {1}, which would have to be finer.": "SH der Ordnung {0}: {1}, womit es feiner sein müsste.",
    "SH of order {0}, {1} numbers a channel: {2}, {3}.": "SH der Ordnung {0}, {1} Zahlen je Kanal: {2}, {3}.",
    "which adds less than can be told from noise": "das sind weniger mehr, als sich vom Rauschen unterscheiden lässt",
    "which is more than is asked for": "das ist mehr als verlangt",
    "All light is that of media ({0}).": "Alles Licht ist das von Medien ({0}).",
    "Media ({0}) change light at surfaces by {1} % (+- {2}), and take {3} % along what probes see: the bake follows them.":
        "Medien ({0}) ändern das Licht auf Flächen um {1} % (+- {2}) und nehmen {3} % entlang dessen, was Sonden sehen: Gebackenes "
        "folgt ihnen.",
    "Media ({0}) hardly matter for light at surfaces, {1} % (+- {2}): hidden from renders they save the bake up to two thirds "
    "of its "
    "rays, and leave the picture as well.":
        "Medien ({0}) machen für das Licht auf Flächen kaum etwas aus, {1} % (+- {2}): Vor dem Rendern verborgen ersparen sie "
        "dem Backen "
        "bis zu zwei Drittel seiner Strahlen, fehlen aber auch im Bild.",
    "Light scattered within {0} changes over its mean free path, {1} m where it is densest, and probes are up to {2} m apart: "
    "in the "
    "air {3} would follow it, and in pictures rays (--set media.rays=1) do without. The plan is for surfaces alone.":
        "Licht, das in {0} gestreut wird, ändert sich auf der mittleren freien Weglänge, {1} m an der dichtesten Stelle, und "
        "Sonden "
        "stehen bis zu {2} m auseinander: In der Luft folgten ihm {3}, und in Bildern kommen Strahlen (--set media.rays=1) "
        "ohne aus. "
        "Der Plan gilt Flächen allein.",
    "In the camera's picture media are followed by columns of {0} pixels in {1} slices: --set media.tile={2} --set "
    "media.slices={3}.":
        "Im Bild der Kamera folgen Medien Säulen von {0} Pixeln in {1} Schichten: --set media.tile={2} --set media.slices={3}.",
    "In the camera's picture media are followed by columns of {0} pixel in {1} slices: --set media.tile={2} --set "
    "media.slices={3}.":
        "Im Bild der Kamera folgen Medien Säulen von {0} Pixel in {1} Schichten: --set media.tile={2} --set media.slices={3}.",
    "By true rays (the effect ray_traced) the picture through {0}, {1} x {2}, is within {3} after about {4} samples, in some "
    "{5} and "
    "without a bake: faster than the bake, and exact but for noise.":
        "Mit echten Strahlen (Effekt ray_traced) ist das Bild durch {0}, {1} x {2}, nach etwa {4} Samples auf {3} genau, in "
        "ungefähr {5} "
        "und ohne Backen: schneller als das Backen, und bis auf Rauschen genau.",
    "By true rays (the effect ray_traced) the picture through {0}, {1} x {2}, is within {3} after about {4} samples, in some "
    "{5} and "
    "without a bake: slower than the bake, but exact where that stays off by {6}.":
        "Mit echten Strahlen (Effekt ray_traced) ist das Bild durch {0}, {1} x {2}, nach etwa {4} Samples auf {3} genau, in "
        "ungefähr {5} "
        "und ohne Backen: langsamer als das Backen, aber genau, wo dieses um {6} danebenliegt.",
    "By true rays (the effect ray_traced) the picture through {0}, {1} x {2}, is within {3} after about {4} samples, in some "
    "{5} and "
    "without a bake: slower than the bake of {6}, which serves every picture.":
        "Mit echten Strahlen (Effekt ray_traced) ist das Bild durch {0}, {1} x {2}, nach etwa {4} Samples auf {3} genau, in "
        "ungefähr {5} "
        "und ohne Backen: langsamer als das Backen von {6}, das jedem Bild dient.",

    "rsm holds the first bounce of lamps only": "rsm kennt nur die erste Reflexion der Lampen",
    "rsm holds the first bounce of lamps only, without shadows on the bounced light":
        "rsm kennt nur die erste Reflexion der Lampen, ohne Schatten auf dem reflektierten Licht",
    "rsm lets {0} cast shadows: a map holds the nearest surface only":
        "rsm lässt {0} Schatten werfen: eine Karte enthält nur die nächste Fläche",
    "rsm leaves out the light of the world": "rsm lässt das Licht der Welt aus",
    "rsm leaves out the light that {0} gives off": "rsm lässt das Licht aus, das {0} abgibt",
    "{0} sends no light on through {1}, which pass it diffusely":
        "{0} schickt kein Licht durch {1} weiter, die es gestreut durchlassen",
    "{0} leaves {1} unlit: a map holds the nearest surface that casts a shadow":
        "{0} lässt {1} unbeleuchtet: eine Karte enthält die nächste Fläche, die einen Schatten wirft",
    "lpv reflects the light of {0} on, beyond the bounces that it is limited to":
        "lpv reflektiert das Licht von {0} weiter, über die Reflexionen hinaus, auf die es begrenzt ist",
    "lpv lets {0} light everything, whatever is linked": "lpv lässt {0} alles beleuchten, was auch verknüpft ist",
}
