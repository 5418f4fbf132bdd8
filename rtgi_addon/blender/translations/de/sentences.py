"""Errors, remedies, findings, notes and steps of progress in German, by the pattern of their English: {0}, {1}, … is what the
code fills in."""

SENTENCES: dict[str, str] = {
    # Steps of progress.
    "Reading the scene": "Liest die Szene",
    "reading object {0}": "liest Objekt {0}",
    "material bake: {0}": "Materialien backen: {0}",
    "Checking the scene": "Prüft die Szene",
    "building the ray tracer": "baut die Strahlverfolgung auf",
    "light of lamps": "Licht der Lampen",
    "light between surfaces": "Licht zwischen Flächen",
    "capturing reflective shadow maps": "nimmt reflektierende Schattenkarten auf",
    "filling geometry volumes": "füllt Geometrievolumen",
    "propagating light": "breitet Licht aus",
    "resampling to probes": "tastet für die Sonden neu ab",
    "Writing {0}": "Schreibt {0}",
    "Done": "Fertig",
    "Drawing": "Zeichnet",
    "{0} % off by its noise, {1} samples a pixel": "durch Rauschen {0} % daneben, {1} Abtastwerte je Pixel",
    "{0} % off by its noise, {1} % was asked for: allow more samples, {2} samples a pixel":
        "durch Rauschen {0} % daneben, verlangt waren {1} %: mehr Abtastwerte erlauben, {2} Abtastwerte je Pixel",
    "Overlays are not drawn over pictures by rays": "Über Bilder durch Strahlen werden keine Überlagerungen gezeichnet",
    "Relighting": "Beleuchtet neu",
    "Sample {0} of {1}": "Abtastwert {0} von {1}",
    "Choosing receivers": "Wählt Empfänger",
    "Naming causes": "Benennt Ursachen",
    "looking up receivers": "schlägt Empfänger nach",
    "Tracing the reference of the error maps": "Verfolgt die Referenz der Fehlerkarten",
    "Error map of {0}": "Fehlerkarte von {0}",
    "{0}, setting {1} of {2}, seed {3}": "{0}, Einstellung {1} von {2}, Startwert {3}",
    "{0}, render {1}": "{0}, Bild {1}",
    "measuring {0}": "misst {0}",
    "measuring lattices": "misst Gitter",
    "looking at the scene": "betrachtet die Szene",
    "planned": "geplant",
    "Reading the bundle": "Liest das Gebackene",
    "Preparing the probes": "Bereitet die Sonden vor",
    "Writing probes": "Schreibt Sonden",
    "Writing textures": "Schreibt Texturen",
    "Writing the sample scene": "Schreibt die Beispielszene",
    "Writing the loader and its pages": "Schreibt den Lader und seine Seiten",
    "Writing the conformance kit": "Schreibt den Konformitätssatz",
    "Replacing the folder": "Ersetzt den Ordner",

    # What a preview shows.
    "Live, without a bake": "Live, ohne Gebackenes",
    "Nothing baked with {0}: direct light and world only": "Mit {0} ist nichts gebacken: nur direktes Licht und Welt",
    "The bake on disk is of the technique {0}: direct light and world only":
        "Das Gebackene auf der Platte ist von der Technik {0}: nur direktes Licht und Welt",
    "The bake on disk cannot be shown, {0}": "Das Gebackene auf der Platte kann nicht gezeigt werden, {0}",

    # Leaks and their causes.
    "{0} of {1} receivers leak": "{0} von {1} Empfängern bekommen falsches Licht",
    "wall thinner than the spacing": "Wand dünner als der Sondenabstand",
    "probe inside geometry": "Sonde in Geometrie",
    "two-sided material": "zweiseitiges Material",
    "no visibility in the technique": "die Technik kennt keine Sichtbarkeit",
    "light changes between samples": "Licht ändert sich zwischen den Sonden",

    # Findings about a scene.
    "{0} has no geometry": "{0} hat keine Geometrie",
    "the scene has no geometry": "die Szene hat keine Geometrie",
    "add a mesh that is visible to renders": "ein Mesh hinzufügen, das beim Rendern sichtbar ist",
    "{0} has no light ({1})": "{0} hat kein Licht ({1})",
    "add a lamp, light the world or give a material emission":
        "eine Lampe hinzufügen, die Welt leuchten lassen oder einem Material Emission geben",
    "{0} has no probe volume": "{0} hat kein Sondenvolumen",
    "the scene has no probe volume": "die Szene hat kein Sondenvolumen",
    "add one with Add > Light Probe > Volume": "eines mit Hinzufügen > Lichtsonde > Volumen hinzufügen",
    "add a Light Probe Volume": "ein Lichtsondenvolumen hinzufügen",
    "{0} has faces that name vertices it lacks": "{0} hat Flächen mit Eckpunkten, die es nicht gibt",
    "run Mesh > Clean Up or Validate on it": "Mesh > Aufräumen darauf anwenden",
    "{0} has {1} vertices at NaN or infinity": "{0} hat {1} Eckpunkte bei NaN oder unendlich",
    "delete them, or mend the modifier that makes them": "sie löschen, oder den Modifikator reparieren, der sie macht",
    "{0} has no face with an area": "{0} hat keine Fläche mit Inhalt",
    "it casts and reflects nothing: hide it or mend it": "es wirft und reflektiert nichts: ausblenden oder reparieren",
    "{0} has {1} faces without area": "{0} hat {1} Flächen ohne Inhalt",
    "they are left out; Mesh > Clean Up > Degenerate Dissolve removes them":
        "sie bleiben außen vor; Mesh > Aufräumen > Degeneriertes auflösen entfernt sie",
    "faces that lose their area are left out: give it a scale":
        "Flächen, die ihren Inhalt verlieren, bleiben außen vor: eine Skalierung geben",
    "{0} is {1} m large but lies {2} m from the origin": "{0} ist {1} m groß, liegt aber {2} m vom Ursprung",
    "32-bit coordinates lose its detail there: move it nearer to the origin":
        "32-Bit-Koordinaten verlieren dort Einzelheiten: näher an den Ursprung rücken",
    "{0} is {1} m large": "{0} ist {1} m groß",
    "check its scale and the scene's unit scale": "seine Skalierung und die Einheiten der Szene prüfen",
    "{0} has faces that name materials it lacks": "{0} hat Flächen mit Materialien, die es nicht gibt",
    "assign materials to every face": "jeder Fläche ein Material zuweisen",
    "{0} has NaN or infinity in its {1}": "{0} hat NaN oder unendlich in seinem Wert {1}",
    "mend the value, or the image it comes from": "den Wert berichtigen, oder das Bild, aus dem er kommt",
    "{0} reflects {1} of the light that meets it": "{0} reflektiert das {1}-fache des Lichts, das darauf trifft",
    "albedo is cut just below 1, or light would never die out: use 0.8 or less for white paint":
        "Albedo wird knapp unter 1 gekappt, sonst verklänge Licht nie: für weiße Farbe 0,8 oder weniger nehmen",
    "{0} has a negative base colour": "{0} hat eine negative Grundfarbe",
    "it is baked as black: give a colour from 0 to 1": "es wird schwarz gebacken: eine Farbe von 0 bis 1 geben",
    "{0} has negative emission": "{0} hat negative Emission",
    "it is baked as none: give a strength from 0": "es wird ohne gebacken: eine Stärke ab 0 geben",
    "{0} has NaN or infinity in its power or transform": "{0} hat NaN oder unendlich in Leistung oder Transformation",
    "mend its power, colour or transform": "Leistung, Farbe oder Transformation berichtigen",
    "{0} has negative power": "{0} hat negative Leistung",
    "a bake adds light only: give a power from 0": "Backen fügt nur Licht hinzu: eine Leistung ab 0 geben",
    "{0} has no size": "{0} hat keine Größe",
    "it emits nothing: give it a size or use a point light": "es strahlt nichts aus: eine Größe geben oder ein Punktlicht nehmen",
    "world has NaN or infinity in its radiance ({0})": "die Welt hat NaN oder unendlich in ihrer Strahldichte ({0})",
    "mend its image or strength": "ihr Bild oder ihre Stärke berichtigen",
    "world has negative radiance": "die Welt hat negative Strahldichte",
    "it is baked as black there: give a strength from 0": "dort wird schwarz gebacken: eine Stärke ab 0 geben",
    "{0} is scaled to nothing along an axis": "{0} ist entlang einer Achse auf nichts skaliert",
    "give it a scale on all three axes": "auf allen drei Achsen eine Skalierung geben",
    "{0} has a resolution of {1}": "{0} hat eine Auflösung von {1}",
    "give at least 1 on each axis": "auf jeder Achse mindestens 1 geben",
    "{0} lies entirely outside the scene": "{0} liegt ganz außerhalb der Szene",
    "move it to where light is to be known": "dorthin rücken, wo Licht bekannt sein soll",
    "{0} needs about {1} of memory, most of it for {2} ({3}); {4} are free":
        "{0} braucht etwa {1} Speicher, das meiste für {2} ({3}); {4} sind frei",

    # Reading a scene.
    "no output folder is set": "kein Ausgabeordner ist gesetzt",
    "choose one in the render properties, under RTGI": "in den Rendereigenschaften unter RTGI einen wählen",
    "scene {0} has no camera": "Szene {0} hat keine Kamera",
    "add one, or make one active": "eine hinzufügen oder eine aktiv machen",
    "choose a perspective or orthographic lens": "eine perspektivische oder orthografische Linse wählen",
    "Cycles cannot render {0} ({1})": "Cycles kann {0} nicht rendern ({1})",
    "let a running render finish, check that Cycles is installed, then bake again":
        "laufendes Rendern enden lassen, nachsehen, ob Cycles installiert ist, dann neu backen",
    "Blender did not evaluate scene {0} for render": "Blender hat Szene {0} nicht zum Rendern ausgewertet",
    "Blender cannot evaluate scene {0} for render ({1})": "Blender kann Szene {0} nicht zum Rendern auswerten ({1})",
    "let the running render finish, then bake again": "laufendes Rendern enden lassen, dann neu backen",
    "scene {0} has no Light Probe Volume and no visible geometry to fit one to":
        "Szene {0} hat kein Lichtsondenvolumen und keine sichtbare Geometrie, der eines angepasst werden könnte",
    "add a mesh or a Light Probe Volume, and check that it is not hidden from render":
        "ein Mesh oder Lichtsondenvolumen hinzufügen und nachsehen, ob es beim Rendern sichtbar ist",
    "unknown probe volume {0}": "unbekanntes Sondenvolumen {0}",
    "unknown volume {0}": "unbekanntes Volumen {0}",
    "the materials of '{0}' need Cycles to be read, and this Blender has no Cycles":
        "die Materialien von „{0}“ brauchen Cycles, um gelesen zu werden, und dieses Blender hat kein Cycles",
    "simplify their nodes to Principled, Image Texture and Mix, or use a Blender with Cycles":
        "ihre Nodes zu Principled, Bildtextur und Mischen vereinfachen, oder ein Blender mit Cycles nehmen",
    "Cycles could not bake the materials of '{0}' ({1})": "Cycles konnte die Materialien von „{0}“ nicht backen ({1})",
    "simplify their nodes, or apply the object's modifiers and try again":
        "ihre Nodes vereinfachen, oder die Modifikatoren des Objekts anwenden und neu versuchen",
    "the {0} that was cancelled is still ending": "der abgebrochene Vorgang ({0}) endet noch",
    "the bake that was cancelled is still ending": "das abgebrochene Backen endet noch",
    "try again in a moment": "gleich noch einmal versuchen",

    # Notes about what was read.
    "no Light Probe Volume in the scene: one of {0} × {1} × {2} m with {3} × {4} × {5} = {6} probes was fitted to it":
        "kein Lichtsondenvolumen in der Szene: eines von {0} × {1} × {2} m mit {3} × {4} × {5} = {6} Sonden wurde ihr angepasst",
    "{0} is {1}: it has no surface to bake and is left out": "{0} ist {1}: ohne Fläche zum Backen, es bleibt außen vor",
    "{0} is invisible to diffuse rays, but probes see it: they look as a camera does":
        "{0} ist für diffuse Strahlen unsichtbar, aber Sonden sehen es: sie schauen wie eine Kamera",
    "{0} has particle hair: it has no surface to bake and is left out":
        "{0} hat Partikelhaar: ohne Fläche zum Backen, es bleibt außen vor",
    "camera {0} is neither perspective nor orthographic: it is left out":
        "Kamera {0} ist weder perspektivisch noch orthografisch: sie bleibt außen vor",
    "lamp {0}: {1}": "Lampe {0}: {1}",
    "lamp {0} is invisible to diffuse rays: it is left out": "Lampe {0} ist für diffuse Strahlen unsichtbar: sie bleibt außen vor",
    "world: image {0} ({1}) is missing; Blender shows it pink, and so is the world":
        "Welt: das Bild {0} ({1}) fehlt; Blender zeigt es rosa, und so ist die Welt",
    "image '{0}' is missing ({1}): magenta, as in Cycles": "das Bild „{0}“ fehlt ({1}): magenta, wie in Cycles",
    "image '{0}' was averaged from {1}×{2} to {3}×{4} texels": "das Bild „{0}“ wurde von {1}×{2} auf {3}×{4} Texel gemittelt",
    "material '{0}' was read by a Cycles bake, because of {1}": "das Material „{0}“ wurde über Cycles gebacken, wegen {1}",
    "material '{0}': {1}": "Material „{0}“: {1}",
    "its light and dark are evened out: it reflects as much of even light as in Cycles":
        "sein Hell und Dunkel wird ausgeglichen: von gleichmäßigem Licht reflektiert es so viel wie in Cycles",
    "its answer differs with the number of reflections, and is taken as it is after the first":
        "seine Antwort hängt von der Zahl der Reflexionen ab und gilt überall so wie nach der ersten",
    "it asks for {0}": "es fragt nach {0}",
    "it asks for the length of each ray (taken as {0} m)": "es fragt nach der Länge jedes Strahls (gilt als {0} m)",
    "it asks for the Ambient Occlusion of other objects (taken as none)":
        "es fragt nach der Umgebungsverdeckung durch andere Objekte (gilt als keine)",
    "it asks for what is around it by a Raycast node (taken as nothing)":
        "es fragt durch einen Raycast-Node, was um es herum ist (gilt als nichts)",
    "the file's working colour space is {0}: all numbers of the bake are in it":
        "der Arbeitsfarbraum der Datei ist {0}: alle Zahlen der Backung stehen darin",
    "its light depends on the kind of ray, and Cycles, which also samples it as a lamp, shows only part of it":
        "sein Licht hängt von der Art des Strahls ab, und Cycles, das es auch als Lampe abtastet, zeigt nur einen Teil davon",
    "its bumps are left out": "seine Unebenheiten bleiben außen vor",
    "light passes its glass straight on (refraction and caustics are not followed), and that of lamps without a size not at all, "
    "as in Cycles":
        "Licht geht gerade durch sein Glas (Brechung und Kaustik werden nicht verfolgt), das von Lampen ohne Größe wie in Cycles "
        "gar nicht",
    "its rough diffuse reflection (Oren-Nayar) is treated as even in all directions":
        "seine raue diffuse Reflexion (Oren-Nayar) gilt als in alle Richtungen gleich",
    "there is no Embree here (the Python package embreex): rays go through Blender's BVH, which makes bakes some {0} times slower, "
    "and more on many cores; {1}":
        "hier ist kein Embree (das Python-Paket embreex): Strahlen gehen durch Blenders BVH, womit Backen etwa {0}-mal so lange "
        "dauert, auf vielen Kernen noch länger; {1}",
    "there are no compiled kernels here ({0}): numpy does their work, which makes bakes some {1} times slower; {2}":
        "hier gibt es keine übersetzten Kerne ({0}): numpy tut ihre Arbeit, womit Backen etwa {1}-mal so lange dauert; {2}",
    "they are switched off": "sie sind abgeschaltet",
    "the package rtgi_kernels is not there": "das Paket rtgi_kernels ist nicht da",
    "{0} is of version {1}, not {2}": "{0} hat Version {1}, nicht {2}",
    "{0} cannot be used ({1})": "{0} lässt sich nicht benutzen ({1})",
    "Embree's functions cannot be called ({0})": "Embrees Funktionen lassen sich nicht aufrufen ({0})",
    "Embree's structures are not those that the kernels know": "Embrees Strukturen sind nicht die, die die Kerne kennen",
    "install the extension's zip made for this system, or run `make setup`":
        "das ZIP der Erweiterung für dieses System installieren oder `make setup` ausführen",
    "the package does not exist for this system": "für dieses System gibt es das Paket nicht",
    "install the extension's zip made for this system, or that package, and restart Blender":
        "das ZIP der Erweiterung für dieses System oder dieses Paket installieren und Blender neu starten",

    # Settings.
    "unknown technique {0}": "unbekannte Technik {0}",
    "unknown engine {0}": "unbekannte Engine {0}",
    "unknown effect {0}": "unbekannter Effekt {0}",
    "unknown {0} {1}": "unbekannt: {0} {1}",
    "choose one of {0}": "eines wählen von {0}",
    "give a value from {0} to {1}": "einen Wert von {0} bis {1} geben",
    "give a value from 0.001 to 1": "einen Wert von 0,001 bis 1 geben",
    "give a value from 0 to {0}": "einen Wert von 0 bis {0} geben",
    "give true or false": "true oder false geben",
    "give numbers above 0": "Zahlen über 0 geben",
    "{0} {1} has no setting {2}": "{0} {1} hat keine Einstellung {2}",
    "technique": "Technik",
    "effect": "Effekt",
    "give {0} numbers with commas between them": "{0} Zahlen mit Kommas dazwischen geben",
    "give at least {0}": "mindestens {0} geben",
    "technique {0} does not bake on the device {1}": "Technik {0} backt nicht auf dem Gerät {1}",
    "use --device {0}": "das Gerät {0} nehmen",
    "error is {0}": "error ist {0}",
    "order is {0}": "order ist {0}",
    "center is {0}": "center ist {0}",
    "{0} knows irradiance only: choose an order from 0 to {1}":
        "{0} kennt nur Bestrahlungsstärke: eine Ordnung von 0 bis {1} wählen",
    "choose volumes, camera or an object that renders: {0}":
        "volumes, camera oder ein beim Rendern sichtbares Objekt wählen: {0}",

    # Probes.
    "every probe of the volume {0} lies inside geometry": "jede Sonde des Volumens {0} liegt in Geometrie",
    "the surface cache needs more than {0} texels": "der Flächenspeicher braucht mehr als {0} Texel",
    "raise the texel size, or place the probe volumes closer to what they light":
        "die Texelgröße erhöhen, oder die Sondenvolumen näher an das rücken, was sie beleuchten",
    "these probes were read from files, without the hits of their bake":
        "diese Sonden wurden aus Dateien gelesen, ohne die Treffer ihres Backens",
    "this bake kept no hits to relight": "dieses Backen hat keine Treffer zum Neubeleuchten behalten",
    "bake again to relight them": "zum Neubeleuchten neu backen",
    "bake again (hits are kept for up to {0} million rays, and not by a resumed bake)":
        "neu backen (Treffer werden bis {0} Millionen Strahlen behalten, und nicht beim Fortsetzen)",
    "the scene's {0} changed since the bake": "seit dem Backen hat sich geändert: {0}",
    "the scene's {0} changed since the bake at {1}": "seit dem Backen hat sich geändert: {0}, an {1}",
    "bake again; relighting follows lamps and world only": "neu backen; Neubeleuchten folgt nur Lampen und Welt",

    # Virtual lights, shadow maps and light volumes.
    "no virtual light survived: none of {0} light paths met a surface that reflects":
        "kein virtuelles Licht blieb übrig: keiner von {0} Lichtpfaden traf eine Fläche, die reflektiert",
    "check that lamps point at visible geometry, that its materials are not black, and that bounces is not 0":
        "nachsehen, ob Lampen auf sichtbare Geometrie zeigen, ihre Materialien nicht schwarz und die Reflexionen nicht 0 sind",
    "the scene has no lamp with any power to capture a reflective shadow map from":
        "die Szene hat keine Lampe mit Leistung, von der eine reflektierende Schattenkarte aufzunehmen wäre",
    "add a sun, point, spot or area lamp, or choose a technique that knows world and emissive surfaces":
        "Sonne, Punkt-, Spot- oder Flächenlampe hinzufügen, oder eine Technik wählen, die Welt und leuchtende Flächen kennt",
    "the maps of {0} lamps with {1}² texels each take {2} GiB": "die Karten von {0} Lampen mit je {1}² Texeln brauchen {2} GiB",
    "set a resolution of at most {0}": "eine Auflösung von höchstens {0} setzen",
    "no surface is lit by {0}": "keine Fläche wird beleuchtet von {0}",
    "move the lamps to where they light something, or turn them to it":
        "die Lampen dorthin rücken oder drehen, wo sie etwas beleuchten",
    "no lamp lights any surface": "keine Lampe beleuchtet eine Fläche",
    "turn a lamp towards the scene, or add light": "eine Lampe zur Szene drehen, oder Licht hinzufügen",
    "lamp {0} lights nothing inside the light propagation volumes":
        "Lampe {0} beleuchtet nichts in den Lichtausbreitungsvolumen",
    "add cascades, raise cell_size, or hide the lamp from renders":
        "Kaskaden hinzufügen, die Zellgröße erhöhen, oder die Lampe beim Rendern ausblenden",
    "no virtual light lies inside the light propagation volumes": "in den Lichtausbreitungsvolumen liegt kein virtuelles Licht",
    "raise cell_size or add cascades": "die Zellgröße erhöhen oder Kaskaden hinzufügen",
    "cascade {0} of the light propagation volumes ({1}) holds no geometry":
        "Kaskade {0} der Lichtausbreitungsvolumen ({1}) enthält keine Geometrie",
    "move its center, raise cell_size, or bake the technique 'probes' there":
        "ihre Mitte verlegen, die Zellgröße erhöhen, oder dort mit der Technik „probes“ backen",
    "cascade {0} of the light propagation volumes is not finite": "Kaskade {0} der Lichtausbreitungsvolumen ist nicht endlich",
    "a light propagation volume of {0} cells a side is larger than a texture of {1} pixels":
        "ein Lichtausbreitungsvolumen mit {0} Zellen je Seite ist größer als eine Textur von {1} Pixeln",
    "lower resolution, and add cascades to reach farther": "die Auflösung senken und für mehr Reichweite Kaskaden hinzufügen",
    "the cascades are to be centred on the camera and the scene has none":
        "die Kaskaden sollen um die Kamera liegen, und die Szene hat keine",
    "add a camera or set center to volumes": "eine Kamera hinzufügen oder die Mitte auf „volumes“ setzen",
    "these light propagation volumes were read from files, without their geometry volumes":
        "diese Lichtausbreitungsvolumen wurden aus Dateien gelesen, ohne ihre Geometrievolumen",
    "these light propagation volumes were read from files, without the scene they were made for":
        "diese Lichtausbreitungsvolumen wurden aus Dateien gelesen, ohne die Szene, für die sie gemacht sind",
    "bake again to get probes": "für Sonden neu backen",

    # Measuring.
    "no probe lies in the open": "keine Sonde liegt frei",
    "move the Light Probe Volume out of geometry": "das Lichtsondenvolumen aus der Geometrie rücken",
    "no surface can be seen from any probe": "von keiner Sonde ist eine Fläche zu sehen",
    "move the Light Probe Volume to the geometry": "das Lichtsondenvolumen zur Geometrie rücken",
    "a chart needs seeds, points, normals, probes and a noise above 0":
        "ein Vergleich braucht Startwerte, Punkte, Normalen, Sonden und ein Rauschen über 0",
    "a chart without techniques and without pictures of effects has nothing to measure":
        "ein Vergleich ohne Techniken und ohne Bilder mit Effekten hat nichts zu messen",
    "name a technique": "eine Technik nennen",
    "no object is in the light atlas": "kein Objekt ist im Lichtatlas",
    "name one (--atlas OBJECT), or put it there in its properties":
        "eines nennen (--atlas OBJEKT) oder in seinen Eigenschaften hineinnehmen",
    "no surface in the light atlas is seen from a probe": "keine Fläche im Lichtatlas ist von einer Sonde aus zu sehen",
    "put one there that is, or measure more points": "eine hineinnehmen, die es ist, oder mehr Punkte messen",
    "the effect {0} draws as nothing looks: no picture says how right it is":
        "der Effekt {0} zeichnet, wie nichts aussieht: Kein Bild sagt, wie richtig das ist",
    "choose of {0}": "unter {0} wählen",
    "{0}, picture {1} of {2}": "{0}, Bild {1} von {2}",
    "drawing by rays": "Zeichnen mit Strahlen",
    "Pictures by {0}": "Bilder von {0}",
    "Cycles' picture, render {0}": "Bild von Cycles, Durchgang {0}",
    "the camera {0} is no object of the scene of its own": "die Kamera {0} ist kein eigenes Objekt der Szene",
    "give the scene an active camera": "der Szene eine aktive Kamera geben",
    "mend the scene": "die Szene in Ordnung bringen",
    "{0} does not concern {1}": "{0} betrifft {1} nicht",
    "choose another technique or case": "eine andere Technik oder einen anderen Fall wählen",
    "this Blender's Cycles has no OSL, which the reference needs":
        "Cycles hat in diesem Blender kein OSL, das die Referenz braucht",
    "use --reference path": "die eigene Pfadverfolgung als Referenz nehmen",
    "a plan needs some probes and some memory": "ein Plan braucht einige Sonden und etwas Speicher",
    "the coarsest lattice takes more than the {0} allows": "das gröbste Gitter braucht mehr, als {0} erlaubt",
    "allow more {0}": "mehr {0} erlauben",

    "a check holds the bake to indirect light, and --direct adds the lamps'":
        "eine Prüfung hält das Gebackene gegen indirektes Licht, und --direct fügt das der Lampen hinzu",
    "light on surfaces is off by some {0}, and noise at the probes ({1}) is not why, they lie too far apart: have a finer lattice "
    "planned (rtgi plan, Plan Bake)":
        "Licht auf Flächen ist um etwa {0} falsch, und Rauschen an den Sonden ({1}) ist nicht der Grund, sie liegen zu weit "
        "auseinander: ein feineres Gitter planen lassen (rtgi plan, Backen planen)",
    "light on surfaces is off by some {0}, and noise at the probes ({1}) is not why, they lie too far apart: fit them to surfaces "
    "(--fit, Fit to Surfaces), or have a finer lattice planned (rtgi plan, Plan Bake)":
        "Licht auf Flächen ist um etwa {0} falsch, und Rauschen an den Sonden ({1}) ist nicht der Grund, sie liegen zu weit "
        "auseinander: sie an Flächen anpassen (--fit, An Flächen anpassen) oder ein feineres Gitter planen lassen (rtgi plan, "
        "Backen planen)",
    "fitting probes to surfaces": "Sonden an Flächen anpassen",
    "add --no-check": "--no-check hinzufügen",

    # Exports.
    "{0} is brighter than half floats hold ({1} W/(sr m^2))": "{0} ist heller, als halbe Gleitkommazahlen fassen ({1} W/(sr m^2))",
    "scale the scene's lights down and raise the engine's exposure by as much":
        "die Lichter der Szene abschwächen und die Belichtung der Engine um ebenso viel erhöhen",
    "the bundle has {0} volumes, and a shader in Godot has samplers for {1}":
        "gebacken sind {0} Volumen, und ein Shader in Godot hat Sampler für {1}",
    "{0} volumes are more than the {1} that a shader of WebGL has room for":
        "{0} Volumen sind mehr als die {1}, für die ein Shader in WebGL Platz hat",
    "bake some of them into a bundle of their own with --volume": "einige davon mit --volume in einen eigenen Ordner backen",
    "bake fewer volumes into this bundle (--volume)": "weniger Volumen in diesen Ordner backen (--volume)",
    "no folder is set for the export": "kein Ordner ist für den Export gesetzt",
    "choose one under Export in the sidebar": "in der Seitenleiste unter Export einen wählen",
    "the folder {0} is relative to this file, which was never saved":
        "der Ordner {0} ist relativ zu dieser Datei, die nie gespeichert wurde",
    "save the file, or choose an absolute folder under Export in the sidebar":
        "die Datei speichern, oder in der Seitenleiste unter Export einen absoluten Ordner wählen",
    "Blender's glTF exporter is switched off": "Blenders glTF-Exporter ist abgeschaltet",
    "enable glTF 2.0 format in the preferences, or export without the model":
        "„glTF 2.0 format“ in den Einstellungen einschalten, oder ohne das Modell exportieren",
    "Blender cannot write this scene as glTF ({0})": "Blender kann diese Szene nicht als glTF schreiben ({0})",
    "give a .glb of your own, or export without the model": "eine eigene .glb-Datei angeben, oder ohne das Modell exportieren",
    "the model {0} is not a .glb": "das Modell {0} ist keine .glb-Datei",
    "the model {0} is not glTF Binary": "das Modell {0} ist kein binäres glTF",
    "export glTF Binary from Blender": "binäres glTF aus Blender exportieren",
    "export it again from Blender as .glb": "es neu aus Blender als .glb exportieren",

    # The GPU.
    "Blender has a window but no GPU context on this thread": "Blender hat ein Fenster, aber auf diesem Thread keinen GPU-Kontext",
    "bake from the panel, or use --device cpu": "aus dem Panel backen oder das Gerät CPU nehmen",
    "the GPU was asked for on a thread of its own": "die GPU wurde auf einem eigenen Thread verlangt",
    "Blender's GPU works on its main thread only": "Blenders GPU arbeitet nur auf seinem Hauptthread",
    "Blender has found no GPU it can use": "Blender hat keine GPU gefunden, die es nutzen kann",
    "Blender has no GPU context": "Blender hat keinen GPU-Kontext",
    "no driver here gives an OpenGL 4.3 context without a window":
        "kein Treiber gibt hier einen OpenGL-4.3-Kontext ohne Fenster",
    "there is no libEGL.so.1, through which Blender opens a GPU without a window":
        "libEGL.so.1 fehlt, womit Blender eine GPU ohne Fenster öffnet",
    "the GPU is used through Blender, which is not here": "die GPU wird über Blender genutzt, das hier fehlt",
    "run inside Blender, or use --device cpu": "in Blender ausführen oder das Gerät CPU nehmen",
    "a volume of {0} × {1} × {2} cells needs a texture of {3} × {4}, above the limit of {5}":
        "ein Volumen von {0} × {1} × {2} Zellen braucht eine Textur von {3} × {4}, über der Grenze von {5}",
    "{0} of {1} × {2} is larger than this GPU's limit of {3}": "{0} von {1} × {2} ist größer als die Grenze dieser GPU, {3}",
    "{0} would take {1} bytes of uniforms": "{0} bräuchte {1} Bytes an Uniforms",
    "keep it below {0}": "unter {0} bleiben",
    "use a lower resolution": "eine niedrigere Auflösung nehmen",
    "use a lower resolution, or --device cpu": "eine niedrigere Auflösung oder das Gerät CPU nehmen",
    "a check holds the bake to all light as it is, and volume {0} captures other light":
        "eine Prüfung hält das Gebackene gegen alles Licht, wie es ist, und Volumen {0} nimmt anderes auf",
    "leaks are found by comparison with all light as it is, and volume {0} captures other light":
        "Lecks zeigt der Vergleich mit allem Licht, wie es ist, und Volumen {0} nimmt anderes auf",
    "set its Intensity to 1, let it capture indirect light and emission, and bake again":
        "seine Intensität auf 1 setzen, es indirektes Licht und Emission aufnehmen lassen und neu backen",
}
