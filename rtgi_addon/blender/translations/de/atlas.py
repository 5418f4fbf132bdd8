"""The light atlas: its settings and panels, and what is wrong with UV maps."""

ATLAS_LABELS: dict[str, str] = {
    "Light Atlas": "Lichtatlas",
    "How the light atlas is baked": "Wie der Lichtatlas gebacken wird",
    "Unwrap for Light Atlas": "Für den Lichtatlas abwickeln",
    "Give the selected meshes a UV map for the light atlas, called Lightmap: no overlaps, islands apart by its texels":
        "Den ausgewählten Meshes eine UV-Map namens Lightmap für den Lichtatlas geben: ohne Überlappung, mit Abstand",
    "Fit Islands to Light": "Inseln dem Licht anpassen",
    "Give more of the texels of maps unwrapped for the light atlas to islands whose light is uneven, as two coarse bakes tell":
        "Von den Texeln der Maps, die für den Lichtatlas abgewickelt sind, mehr den Inseln mit ungleichem Licht geben, wie zwei "
        "grobe Backvorgänge es zeigen",
    "A bake or another fit is already running": "Es läuft bereits ein Backvorgang oder eine Anpassung",
    "Fitted the islands of {0} meshes to their light": "Die Inseln von {0} Meshes ihrem Licht angepasst",
    "Fit cancelled; maps are as they were": "Anpassung abgebrochen; die Maps sind wie zuvor",
    "Stop measuring light. Maps stay as they are": "Das Messen des Lichts beenden. Die Maps bleiben, wie sie sind",
    "Cancel Fit": "Anpassung abbrechen",
    "Show in Materials": "In Materialien zeigen",
    "Let EEVEE show the baked light atlas: materials of its objects get an output for EEVEE alone that reads its images":
        "EEVEE den gebackenen Lichtatlas zeigen lassen: Materialien seiner Objekte erhalten eine Ausgabe nur für EEVEE, die seine "
        "Bilder liest",
    "Remove from Materials": "Aus Materialien entfernen",
    "Take the nodes that show the light atlas out of all materials":
        "Die Nodes, die den Lichtatlas zeigen, aus allen Materialien entfernen",
    "No light atlas is baked: switch objects on for it, and bake":
        "Kein Lichtatlas ist gebacken: Objekte dafür einschalten und backen",
    "{0} materials of {1} objects show the light atlas in EEVEE": "{0} Materialien von {1} Objekten zeigen den Lichtatlas in EEVEE",
    "Removed from {0} materials": "Aus {0} Materialien entfernt",
    "Density": "Dichte",
    "Texels along a metre of the surfaces in the light atlas": "Texel entlang eines Meters der Flächen im Lichtatlas",
    "Texels along a metre of the surfaces in the light atlas (0.01 to 1,000 1/m)":
        "Texel entlang eines Meters der Flächen im Lichtatlas (0,01 bis 1.000 1/m)",
    "Rays from the surface that a texel of the light atlas covers":
        "Strahlen von der Fläche aus, die ein Texel des Lichtatlas bedeckt",
    "Rays from the surface that a texel of the light atlas covers (16 to 65,536)":
        "Strahlen von der Fläche aus, die ein Texel des Lichtatlas bedeckt (16 bis 65.536)",
    "Margin": "Rand",
    "Texels about each object's islands that are filled from them":
        "Texel um die Inseln jedes Objekts, die aus ihnen gefüllt werden",
    "Texels about each object's islands that are filled from them (1 to 64 px)":
        "Texel um die Inseln jedes Objekts, die aus ihnen gefüllt werden (1 bis 64 px)",
    "With radiance transfer: side of the square grid of directions from which the atlas follows suns; below 3 none":
        "Beim Strahlungstransfer: Seite des quadratischen Rasters der Richtungen, aus denen der Atlas Sonnen folgt; unter 3 keine",
    "With radiance transfer: side of the square grid of directions from which the atlas follows suns; below 3 none (0 to 32)":
        "Beim Strahlungstransfer: Seite des quadratischen Rasters der Richtungen, aus denen der Atlas Sonnen folgt; unter 3 keine "
        "(0 bis 32)",
    "Largest Side": "Größte Seite",
    "A light atlas with more texels along a side is refused": "Ein Lichtatlas mit mehr Texeln entlang einer Seite wird abgelehnt",
    "A light atlas with more texels along a side is refused (16 to 16,384 px)":
        "Ein Lichtatlas mit mehr Texeln entlang einer Seite wird abgelehnt (16 bis 16.384 px)",
    "Bake this object's light at the texels of a UV map as well":
        "Das Licht dieses Objekts auch an den Texeln einer UV-Map backen",
    "UV Map": "UV-Map",
    "The UV map of the light atlas, in which no two faces may overlap; without one that is called Lightmap, or else the one for "
    "renders":
        "Die UV-Map des Lichtatlas, in der sich keine zwei Flächen überlappen dürfen; ohne Angabe die namens Lightmap, sonst die "
        "für Renderings",
    "No object: switch Light Atlas on in Object > RTGI": "Kein Objekt: Lichtatlas unter Objekt > RTGI einschalten",
    "No mesh among the selected objects can be unwrapped": "Kein Mesh unter den ausgewählten Objekten lässt sich abwickeln",
    "Unwrapped {0} meshes for the light atlas": "{0} Meshes für den Lichtatlas abgewickelt",
    "{count} objects in the light atlas": "{count} Objekte im Lichtatlas",
}
ATLAS: dict[str, str] = {
    "{0} of the light atlas is not in the scene with its UV map {1}":
        "{0} aus dem Lichtatlas ist mit seiner UV-Map {1} nicht in der Szene",
    "{0} has no material that could show the light atlas": "{0} hat kein Material, das den Lichtatlas zeigen könnte",
    "{0} reads one UV map, {1} as on {2}, and not {3} of {4}": "{0} liest eine UV-Map, {1} wie auf {2}, und nicht {3} von {4}",
    "{0} has no nodes of this file that could show the light atlas":
        "{0} hat keine Nodes dieser Datei, die den Lichtatlas zeigen könnten",
    "{0} has an output for EEVEE of its own": "{0} hat eine eigene Ausgabe für EEVEE",
    "{0} has no surface that could show the light atlas": "{0} hat keine Oberfläche, die den Lichtatlas zeigen könnte",
    "{0} has no base colour that could be read, and shows grey": "{0} hat keine lesbare Grundfarbe und zeigt Grau",
    "Looking from the light atlas": "Vom Lichtatlas aus wird geschaut",
    "Lighting the light atlas": "Der Lichtatlas wird beleuchtet",
    "Joining the seams of the light atlas": "Die Nähte des Lichtatlas werden geschlossen",
    "{0} is Dynamic, and the light atlas is for what stays": "{0} ist dynamisch, und der Lichtatlas ist für das, was bleibt",
    "take it out of the atlas, or make it Static": "aus dem Atlas nehmen oder auf Statisch stellen",
    "{0} faces the inside of something in {1} % of its texels, and the light atlas is that of the fronts of faces: turn its "
    "normals (Mesh > Normals > Flip)":
        "{0} blickt bei {1} % seiner Texel in das Innere von etwas, und der Lichtatlas gilt für die Vorderseiten: die Normalen "
        "wenden (Mesh > Normalen > Umkehren)",
    "{0} reads light of other islands of its UV map {1} on {2} % of its surface: unwrap it with islands two texels apart, or raise "
    "the light atlas's Density":
        "{0} liest auf {2} % seiner Oberfläche Licht anderer Inseln seiner UV-Map {1}: mit zwei Texeln zwischen den Inseln "
        "abwickeln oder die Dichte des Lichtatlas erhöhen",
    "{0} has no UV map for the light atlas": "{0} hat keine UV-Map für den Lichtatlas",
    "unwrap it (UV > Lightmap Pack), or take it out of the atlas": "abwickeln (UV > Lightmap packen) oder aus dem Atlas nehmen",
    "{0} has no UV map {1}": "{0} hat keine UV-Map {1}",
    "the light atlas takes {0} x {1} texels, {2} x {3} of them for {4}, and {5} along a side is the most":
        "der Lichtatlas braucht {0} x {1} Texel, {2} x {3} davon für {4}, und {5} entlang einer Seite sind das Höchste",
    "lower its Density (--set atlas.density), or raise its Largest Side (--set atlas.largest)":
        "die Dichte senken (--set atlas.density) oder die größte Seite erhöhen (--set atlas.largest)",
    "UV map {0} of {1} holds values that are not finite": "die UV-Map {0} von {1} enthält Werte, die nicht endlich sind",
    "no object has a map of Unwrap for Light Atlas that could be fitted to light":
        "kein Objekt hat eine Map von „Für den Lichtatlas abwickeln“, die dem Licht angepasst werden könnte",
    "select objects and unwrap them for the light atlas": "Objekte auswählen und für den Lichtatlas abwickeln",
    "unwrap it anew": "neu abwickeln",
    "UV map {0} of {1} gives no area to {2} % of its surface": "die UV-Map {0} von {1} gibt {2} % seiner Oberfläche keine Fläche",
    "unwrap it anew (UV > Lightmap Pack)": "neu abwickeln (UV > Lightmap packen)",
    "UV map {0} of {1} overlaps itself on {2} % of what it covers":
        "die UV-Map {0} von {1} überlappt sich auf {2} % dessen, was sie bedeckt",
    "unwrap it so that no two faces share a place (UV > Lightmap Pack), or name another map":
        "so abwickeln, dass keine zwei Flächen einen Ort teilen (UV > Lightmap packen), oder eine andere Map nennen",
    "{0} is placed {1} times, and the light atlas has room for one of a name":
        "{0} ist {1}-mal platziert, und der Lichtatlas hat Platz für eines eines Namens",
    "make its instances real (Object > Apply > Make Instances Real), or take it out of the atlas":
        "die Instanzen real machen (Objekt > Anwenden > Instanzen real machen) oder aus dem Atlas nehmen",
    "the light atlas holds values that are not finite": "der Lichtatlas enthält Werte, die nicht endlich sind",
    "the light atlas of {0} is no part of a prepared bake, and not in its bundle: bake the file for it":
        "der Lichtatlas von {0} ist kein Teil eines vorbereiteten Backens und nicht im Bündel: dafür die Datei backen",
    "the light atlas has {0} x {1} texels, {2} x {3} of them for {4}, and {5} takes {6} along a side":
        "der Lichtatlas hat {0} x {1} Texel, {2} x {3} davon für {4}, und {5} nimmt {6} entlang einer Seite",
    "bake it with a lower Density (--set atlas.density)": "mit geringerer Dichte backen (--set atlas.density)",
    "{0} reads the first {1} UV maps of a mesh, and the light atlas of {2} lies in another, so the probes light it: move the "
    "map up in Object Data > UV Maps":
        "{0} liest die ersten {1} UV-Maps eines Meshs, und der Lichtatlas von {2} liegt in einer anderen, daher beleuchten es die "
        "Sonden: die Map unter Objektdaten > UV-Maps nach oben schieben",
    "the light atlas follows no suns: bake it with --set atlas.suns=8":
        "der Lichtatlas folgt keinen Sonnen: mit --set atlas.suns=8 backen",
    "the light atlas does not follow new lamps: give them a group in the file, dimmed to nothing":
        "der Lichtatlas folgt keinen neuen Lampen: ihnen in der Datei eine Gruppe geben, auf nichts gedimmt",
    "the light atlas's transfer makes an image of {0} x {1} pixels, and {2} along a side is the most":
        "der Transfer des Lichtatlas ergibt ein Bild von {0} x {1} Pixeln, und {2} entlang einer Seite sind das Höchste",
    "lower its Density (--set atlas.density), or its Sun Directions (--set atlas.suns)":
        "seine Dichte (--set atlas.density) oder seine Sonnenrichtungen (--set atlas.suns) senken",
    "the light atlas holds other light than is shown: its surfaces show the field's until the next bake":
        "der Lichtatlas enthält anderes Licht als gezeigt wird: seine Flächen zeigen bis zum nächsten Backen das des Feldes",
    "the light atlas is left out: it holds the light of the bake alone":
        "der Lichtatlas entfällt: er enthält allein das Licht des Backens",
    "the light atlas keeps the light of the bake: to follow others it would take {0} MiB in {1} layers, and {2} MiB in {3} are the "
    "most; bake it with a lower Density (--set atlas.density), or fewer Sun Directions (--set atlas.suns)":
        "der Lichtatlas behält das Licht des Backens: um anderem zu folgen, bräuchte er {0} MiB in {1} Schichten, und {2} MiB in "
        "{3} sind das Höchste; mit geringerer Dichte (--set atlas.density) oder weniger Sonnenrichtungen (--set atlas.suns) backen",
    "The light atlas is baked beside it, at its defaults {0} x {1} texels by at most {2} million rays, at most {3} MiB on disk: no "
    "figure here has it in it":
        "Der Lichtatlas wird daneben gebacken, mit seinen Vorgaben {0} x {1} Texel mit höchstens {2} Millionen Strahlen, höchstens "
        "{3} MiB auf der Platte: in keiner Zahl hier ist er enthalten",
    "relighting the light atlas takes {0} MiB of tables, {1} kB a texel":
        "den Lichtatlas neu zu beleuchten braucht {0} MiB an Tabellen, {1} kB je Texel",
}
