"""What Cycles as a reference says, in German, by the pattern of its English."""

CYCLES: dict[str, str] = {
    "no point of the lattice lies in the open": "kein Punkt des Gitters liegt im Freien",
    "move the volume or make its resolution higher": "das Volumen verschieben oder feiner auflösen",
    "Cycles could not compile the camera that starts rays where they are wanted":
        "Cycles konnte die Kamera nicht übersetzen, die Strahlen dort beginnt, wo sie gebraucht werden",
    "use method='panorama', or the path reference": "method='panorama' oder die Pfadreferenz nehmen",
    "look at Blender's console for the reason": "den Grund in Blenders Konsole nachsehen",
    "Cycles wrote no picture for {0}": "Cycles hat für {0} kein Bild geschrieben",
    "Cycles is not available in this Blender": "Cycles ist in diesem Blender nicht verfügbar",
    "enable the Cycles add-on": "das Add-on Cycles einschalten",
    "Cycles at surfaces and probes": "Cycles an Flächen und Sonden",
    "view layer {0} overrides all materials, those of the verification's patches too":
        "View Layer {0} ersetzt alle Materialien, auch die der Prüfflächen",
    "clear its material override, or choose another view layer":
        "seine Materialersetzung leeren, oder einen anderen View Layer wählen",
    "Cycles could not render the patches of the verification ({0})": "Cycles konnte die Prüfflächen nicht rendern ({0})",
    "let a running render finish, then verify again": "laufendes Rendern enden lassen, dann neu prüfen",
    "every probe of the scene's volumes is within a medium, where Cycles' own bake has nothing to compare with":
        "jede Sonde der Szene liegt in einem Medium, wo Cycles' eigenes Backen nichts zum Vergleichen hat",
    "use a Blender whose Cycles has OSL, or hide the medium from renders for the comparison":
        "ein Blender nehmen, dessen Cycles OSL kann, oder das Medium zum Vergleich in Renderings ausblenden",
    "no probe of the scene's volumes is in the open": "keine Sonde der Szene liegt im Freien",
    "move the volumes, or make their resolution higher": "die Volumen verschieben oder feiner auflösen",
    "Without {0}": "Ohne {0}",
    "object {0}": "Objekt {0}",
    "material {0} makes the difference": "Material {0} macht den Unterschied",
    "world": "Welt",
    "{0} agrees with {1} within {2}": "{0} stimmt mit {1} überein bis auf {2}",
    "{0} differs from {1} by {2}": "{0} weicht von {1} ab um {2}",
    "{0} makes the difference": "{0} macht den Unterschied",
    "{0} make the difference": "{0} machen den Unterschied",
    "{0} and {1}": "{0} und {1}",
    "none of {0} suspects makes it by itself": "keiner von {0} Verdächtigen macht ihn allein",
    "the scene was read right, so it is the bake's technique, its settings, or a scene that has changed since":
        "die Szene wurde richtig gelesen; so liegt es an der Technik des Gebackenen, ihren Einstellungen oder einer seither "
        "geänderten Szene",
    "makes a difference of {0} %, measured": "macht einen Unterschied von {0} %, gemessen",
    "Cycles render {0} of {1}": "Cycles rendert Bild {0} von {1}",
    "Cycles' reference is of indirect light, and the direct light of {0} is baked":
        "Cycles dient als Maß für indirektes Licht, und das direkte Licht von {0} ist gebacken",
    "use --reference path, or let bakes hold their bounces only":
        "--reference path verwenden, oder nur ihre Reflexionen backen lassen",
}
