"""What leads a newcomer, in German: where volumes lie, what an export took along, which bake is shown, what came out of a
measurement and what to do."""

LABELS: dict[str, str] = {
    # Volumes.
    "Add Fitted Volume": "Angepasstes Volumen hinzufügen",
    "Add a Light Probe Volume that fits the scene, with evenly spaced probes":
        "Ein Lichtsondenvolumen hinzufügen, das zur Szene passt, mit gleichmäßig verteilten Sonden",
    "Added {volume} with {x} × {y} × {z} = {probes:,} probes": "{volume} mit {x} × {y} × {z} = {probes:,} Sonden hinzugefügt",
    "Fit to Scene": "An Szene anpassen",
    "Move and resize this Light Probe Volume so that it fits the scene, with evenly spaced probes":
        "Rückt und skaliert dieses Lichtsondenvolumen so, dass es die Szene mit gleichmäßig verteilten Sonden umfasst",
    "{volume} now has {x} × {y} × {z} = {probes:,} probes": "{volume} hat nun {x} × {y} × {z} = {probes:,} Sonden",
    "{x:.3g} × {y:.3g} × {z:.3g} m per probe": "{x:.3g} × {y:.3g} × {z:.3g} m je Sonde",
    "Nested Volumes": "Volumen in Volumen",
    "Look for finer volumes within coarser ones that do as well with fewer probes, even where that takes longer than it saves":
        "Nach feineren Volumen in gröberen suchen, die mit weniger Sonden ebenso gut sind, auch wo das länger dauert, als es spart",
    "Plan probes that are fitted to how surfaces and moving things read them, as few as that allows":
        "Sonden planen, die daran angepasst sind, wie Flächen und Bewegtes sie lesen, so wenige, wie das erlaubt",
    "Only Near Surfaces": "Nur nahe Flächen",
    "Trace no rays from probes that no surface reads. Things that move far from surfaces are then lit by what those near them have":
        "Von Sonden, die keine Fläche liest, keine Strahlen verfolgen. Was sich fern von Flächen bewegt, wird dann von dem "
        "beleuchtet, was die nahe ihnen haben",
    "Clearance": "Abstand",
    "How far off a surface things may stand and still be lit by probes of their own":
        "Wie weit vor einer Fläche Dinge stehen dürfen und noch von eigenen Sonden beleuchtet werden",
    "Outside": "Außerhalb",
    "Surfaces up to so far outside the volume count as well": "So weit außerhalb des Volumens zählen Flächen mit",
    "Keep Outermost": "Äußerste behalten",
    "Keep the outermost layer of probes, for surfaces anywhere outside the volume":
        "Die äußerste Schicht der Sonden behalten, für Flächen irgendwo außerhalb des Volumens",
    # Panels.
    "Volumes": "Volumen", "Camera": "Kamera", "Object": "Objekt", "Probe": "Sonde", "Advanced": "Fortgeschritten",
    "Capture": "Aufnehmen", "Light Probes of RTGI": "Lichtsonden von RTGI",
    # What was measured.
    "Open Report": "Bericht öffnen",
    "Show the report of the last stability test in a text editor":
        "Zeigt den Bericht des letzten Stabilitätstests in einem Texteditor",
    "The report is the text {text!r}": "Der Bericht ist der Text {text!r}",
    "What Else There Is": "Was es sonst gibt", "Why": "Warum",
    "Red is too bright, blue too dark, clear is right; full colour is an error of {share}% and more":
        "Rot ist zu hell, Blau zu dunkel, Klares richtig; volle Farbe ist ein Fehler von {share} % und mehr",
    "{figure:.2g} of {allowed:.2g}": "{figure:.2g} von {allowed:.2g}",
    # Which bake is exported.
    "{probes:,} probes": "{probes:,} Sonden",
    "Out of date: the scene or its settings have changed since":
        "Veraltet: die Szene oder ihre Einstellungen haben sich seither geändert",
    "What was exported is out of date: bake again": "Was exportiert wurde, ist veraltet: neu backen",
    "{count} files in {folder}": "{count} Dateien in {folder}",
    "{name} stays as somebody changed it": "{name} bleibt, wie jemand es geändert hat",
}

MESSAGES: dict[str, str] = {
    # A plan's answer.
    "{0} with {1} on {2}: {3} probes": "{0} mit {1} auf {2}: {3} Sonden",
    "light on surfaces off by {0}, below {1} with {2} % confidence":
        "Licht auf Flächen um {0} daneben, unter {1} mit {2} % Sicherheit",
    "within the {0} asked for": "innerhalb der verlangten {0}",
    "the best there is, {0} is out of reach": "das Beste, was es gibt, {0} ist unerreichbar",
    "{0} on this machine and {1} for the fit, {2} MiB of memory, at most {3} MiB on disk":
        "{0} auf dieser Maschine und {1} für die Anpassung, {2} MiB Speicher, höchstens {3} MiB auf der Platte",
    "{0} on this machine, {1} MiB of memory, at most {2} MiB on disk":
        "{0} auf dieser Maschine, {1} MiB Speicher, höchstens {2} MiB auf der Platte",

    # Places and results.
    "{0} is no folder, and {1} cannot be made in it": "{0} ist kein Ordner, und {1} kann darin nicht angelegt werden",
    "worse than the stored bounds: {0}": "schlechter als die hinterlegten Schranken: {0}",
    "see it alone with: {0}": "allein anzusehen mit: {0}",

    # Which bake is exported.
    "nothing is baked that could be exported": "es ist nichts gebacken, das exportiert werden könnte",
    "bake first": "erst backen",
    "the bake in {0} is of the technique {1}, and {2} is shown":
        "das Gebackene in {0} ist von der Technik {1}, und gezeigt wird {2}",
    "choose that technique to export its bake, or bake again":
        "jene Technik wählen, um ihr Gebackenes zu exportieren, oder neu backen",
    "the bake in {0} is of {1}, and not of scene {2}": "das Gebackene in {0} ist von {1} und nicht von Szene {2}",
    "bake this scene, or choose its folder under RTGI in the render properties":
        "diese Szene backen oder ihren Ordner in den Render-Eigenschaften unter RTGI wählen",
    "the bundle {0} is of {1}, and not of scene {2}": "das Gebackene {0} ist von {1} und nicht von Szene {2}",
    "bake this scene, or give its bundle": "diese Szene backen oder ihr Gebackenes angeben",
    "another file, {0}": "einer anderen Datei, {0}",

    # What the exported model lacks.
    "{0} is {1}, which glTF has not: the model lacks it": "{0} ist {1}, was glTF nicht kennt: dem Modell fehlt es",
    "a volume": "ein Volumen", "hair": "Haar", "a point cloud": "eine Punktwolke", "glass": "Glas", "transparency": "Durchsicht",
    "translucency": "Durchschein", "gloss": "Glanz", "a mix of shaders": "eine Mischung von Shadern",
    "a sum of shaders": "eine Summe von Shadern", "refraction": "Brechung",
    "the model stands still as at frame {0}: {1} would move": "das Modell steht still wie in Bild {0}: {1} würde sich bewegen",
    "material {0}: glTF does not hold {1}, the model shows white in its place":
        "Material {0}: glTF kennt {1} nicht, das Modell zeigt an seiner Stelle Weiß",
    "material {0}: glTF does not hold the nodes behind {1}, the model shows the value of the input":
        "Material {0}: glTF kennt die Nodes hinter {1} nicht, das Modell zeigt den Wert des Eingangs",
    "glTF has no area lamps, the model lacks {0}: bake with direct light (--direct, Include Lamps) to have theirs in the probes":
        "glTF kennt keine Flächenlampen, dem Modell fehlt {0}: mit direktem Licht backen (--direct, Lampen einschließen), um ihres "
        "in den Sonden zu haben",

    # Volumes.
    "Looking where probes lie": "Schaut, wo Sonden liegen",
    "move or resize it so that it covers open space, or fit it to the scene":
        "so rücken oder skalieren, dass es freien Raum umfasst, oder an die Szene anpassen",
    "{0} has {1} % of its probes inside geometry": "{0} hat {1} % seiner Sonden in Geometrie",
    "they take their light from the others: move or resize it so that it covers open space":
        "sie nehmen ihr Licht von den anderen: so rücken oder skalieren, dass es freien Raum umfasst",
    "one of {0} × {1} × {2} m with {3} × {4} × {5} = {6} probes was baked in its place; fit the volume to the scene to keep that":
        "an seiner Stelle wurde eines von {0} × {1} × {2} m mit {3} × {4} × {5} = {6} Sonden gebacken; das Volumen an die Szene "
        "anpassen, um das zu behalten",
    "{0} has {1} % of its surfaces outside every probe volume": "{0} hat {1} % ihrer Flächen außerhalb aller Sondenvolumen",
    "they are lit by the nearest probes, or by none: resize the volumes, or fit one to the scene":
        "sie werden von den nächsten Sonden beleuchtet oder von keinen: die Volumen skalieren oder eines an die Szene anpassen",
}
