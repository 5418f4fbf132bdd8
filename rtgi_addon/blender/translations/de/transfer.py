"""What is said about transfer and about relighting, and the labels of what changes light."""

TRANSFER: dict[str, str] = {
    "Radiance transfer (--technique transfer) would store {0} kB a probe at its defaults, at most {1} MiB for these ({2} kB with "
    "--set sun_vectors={3}): they can then be relit without a bake":
        "Strahlungstransfer (--technique transfer) würde mit seinen Vorgaben {0} kB je Sonde speichern, höchstens {1} MiB für "
        "diese ({2} kB mit --set sun_vectors={3}): sie lassen sich dann ohne Backen neu beleuchten",
    "Following the sun by rays": "Der Sonne wird mit Strahlen gefolgt",
    "{0} holds no transfer, it was relit": "{0} enthält keinen Transfer, es wurde neu beleuchtet",
    "give the bundle that it was relit from": "das Gebackene angeben, aus dem es neu beleuchtet wurde",
    "{0} holds no transfer, it was baked with {1}": "{0} enthält keinen Transfer, es wurde mit {1} gebacken",
    "bake it with --technique transfer": "mit der Technik Strahlungstransfer backen",
    "{0} is cut short, damaged or no Radiance image": "{0} ist abgeschnitten, beschädigt oder kein Radiance-Bild",
    "restore the file": "die Datei wiederherstellen",
    "{0} is no image of a sky that can be read without Blender": "{0} ist kein Bild eines Himmels, das ohne Blender lesbar ist",
    "give one that ends in {0}, or R,G,B": "eines angeben, das auf {0} endet, oder R,G,B",
    "{0} holds radiance that is negative or not finite": "{0} enthält Strahldichte, die negativ oder nicht endlich ist",
    "clean the image": "das Bild bereinigen",
    "{0} has {1} × {2} pixels": "{0} hat {1} × {2} Pixel",
    "give an equirectangular image, twice as wide as high": "ein rektangulär projiziertes Bild angeben, doppelt so breit wie hoch",
    "{0} has no channels R, G and B": "{0} hat keine Kanäle R, G und B",
    "save it as one layer of colours": "als eine Ebene von Farben speichern",
    "{0} is turned or mirrored ({1})": "{0} ist gedreht oder gespiegelt ({1})",
    "save it with rows from top to bottom": "mit Zeilen von oben nach unten speichern",
    "{0} is an EXR of a kind that is not read here ({1})": "{0} ist ein EXR einer Art, die hier nicht gelesen wird ({1})",
    "save it as one part with ZIP compression, or as .hdr": "als einen Teil mit ZIP-Kompression speichern, oder als .hdr",
    "{0} does not belong to the bundle, its volumes are others": "{0} gehört nicht zum Gebackenen, seine Volumen sind andere",
    "{0} is damaged, its numbers of columns are not those of its images":
        "{0} ist beschädigt, seine Spaltenzahlen sind nicht die seiner Bilder",
    "volume {0}: its transfer of {1} is not finite": "Volumen {0}: sein Transfer von {1} ist nicht endlich",
    "Relighting {0}": "Beleuchtet {0} neu",
    "give numbers separated by commas": "Zahlen angeben, durch Kommas getrennt",
    "light is not negative": "Licht ist nicht negativ",
    "bake again; transfer follows sun, sky and groups of lights only":
        "neu backen; Transfer folgt nur Sonne, Himmel und Gruppen von Lichtern",
    "the bundle has no lamp sites": "das Gebackene hat keine Lampenorte",
    "bake again with --set sites=32": "neu backen, mit 32 Lampenorten",
    "{0} changed more than its strength since the bake": "{0} hat seit dem Backen mehr als seine Stärke geändert",
    "{0} came after the bake": "{0} kam nach dem Backen",
    "bake again; of new lamps transfer follows those that are points":
        "neu backen; von neuen Lampen folgt Transfer denen, die Punkte sind",
    "{0} shines in colours that it had not when it was baked": "{0} leuchtet in Farben, die es beim Backen nicht hatte",
    "bake it white, and colour its group": "es weiß backen und seine Gruppe färben",
    "{0} changed otherwise than the rest {1}": "{0} hat sich anders geändert als der Rest {1}",
    "give it a light group of its own, and bake again": "ihm eine eigene Lichtgruppe geben und neu backen",
    "The bake on disk does not follow the light, {0}": "Das Gebackene auf der Platte folgt dem Licht nicht, {0}",
    "there is no light group {0}": "es gibt keine Lichtgruppe {0}",
    "transfer leaves medium {0} out: it takes {1} % of the light that crosses all of it":
        "Transfer lässt Medium {0} aus: es nimmt {1} % des Lichts, das es ganz durchquert",
    "transfer leaves medium {0} out: it takes {1} % of the light that crosses all of it, and gives light of its own":
        "Transfer lässt Medium {0} aus: es nimmt {1} % des Lichts, das es ganz durchquert, und gibt eigenes Licht",
    "relighting takes {0} MiB of tables, {1} kB a probe": "neu zu beleuchten braucht {0} MiB Tabellen, {1} kB je Sonde",
    "suns are by {0} vectors in the bundle, and by direction in the export":
        "Sonnen stehen im Gebackenen in {0} Vektoren, im Export nach Richtungen",
    "lamps that the bake does not know are not followed in engines: the responses at {0} lamp sites are left out":
        "Engines folgen keinen Lampen, die das Gebackene nicht kennt: die Antworten an {0} Lampenorten fehlen",
}

TRANSFER_LABELS: dict[str, str] = {
    "Exact Sun": "Sonne exakt",
    "Follow suns by rays instead of by radiance transfer's table of directions: renders wait for it, viewports show it once the "
    "light stands still":
        "Sonnen mit Strahlen statt mit der Richtungstabelle des Strahlungstransfers folgen: Renderings warten darauf, Ansichten "
        "zeigen es, sobald das Licht stillsteht",
    # Light by sliders.
    "Strength": "Stärke",
    "Light Groups": "Lichtgruppen",
    "Groups of lamps and emissive objects, and how strong they are":
        "Gruppen von Lampen und leuchtenden Objekten, und wie stark sie sind",
    "Sky Turn": "Himmelsdrehung",
    "Turn the world about the vertical, counterclockwise from above":
        "Die Welt um die Senkrechte drehen, von oben gesehen gegen den Uhrzeigersinn",
    "Sun by Hour": "Sonne nach Stunde",
    "Let suns that are in no light group stand where the sun does, with +Y north":
        "Sonnen, die in keiner Lichtgruppe sind, stehen lassen, wo die Sonne steht, mit +Y im Norden",
    "Hour": "Stunde",
    "Solar time of the day": "Sonnenzeit des Tages",
    "Day of Year": "Tag des Jahres",
    "Day of the year, which decides how high the sun climbs": "Tag des Jahres, der entscheidet, wie hoch die Sonne steigt",
    "Latitude": "Breitengrad",
    "Where on Earth the scene is": "Wo auf der Erde die Szene liegt",
    "What the light of this group is multiplied by": "Womit das Licht dieser Gruppe multipliziert wird",
    "What colour the light of this group is multiplied by": "Mit welcher Farbe das Licht dieser Gruppe multipliziert wird",
    "Find Light Groups": "Lichtgruppen finden",
    "List the light groups of the scene's lamps and objects (custom property rtgi_light_group, or Blender's own light groups)":
        "Die Lichtgruppen der Lampen und Objekte der Szene auflisten (eigene Eigenschaft rtgi_light_group, oder Blenders "
        "Lichtgruppen)",
    "RTGI Light": "RTGI-Licht",
    "What viewports and renders make of the file's light": "Was Ansichten und Bilder aus dem Licht der Datei machen",
    "Radiance Transfer": "Strahlungstransfer",
    "Irradiance probes that follow sun, sky and groups of lights without a new bake":
        "Bestrahlungsstärke-Sonden, die Sonne, Himmel und Gruppen von Lichtern ohne neues Backen folgen",
}
