"""Live probes and series of bundles: labels, tooltips, and what is said of them."""

LIVE_LABELS: dict[str, str] = {
    "Series": "Reihe",
    "Bake Frames": "Bilder backen",
    "Bake every frame of the scene's frame range, a bundle each, which the preview shows at its frame. Frames that an earlier run "
    "has baked and that have not changed are kept":
        "Jedes Bild des Bildbereichs der Szene backen, je ein Ergebnis, das die Vorschau bei seinem Bild zeigt. Bilder, die ein "
        "früherer Lauf gebacken hat und die sich nicht geändert haben, bleiben",
    "Frames {frames}": "Bilder {frames}",
    "Baked frames {frames} in {time}": "Bilder {frames} gebacken, {time}",
    "Nothing has changed: all frames are kept": "Nichts hat sich geändert: alle Bilder bleiben",
    "Cancelled; frames that are baked stay, and Bake Frames goes on with the others":
        "Abgebrochen; gebackene Bilder bleiben, und „Bilder backen“ macht mit den anderen weiter",
    "Live Probes": "Live-Sonden",
    "Trace probes anew all the time, so that they follow what moves, instead of showing a bake":
        "Sonden fortwährend neu verfolgen, sodass sie dem folgen, was sich bewegt, statt Gebackenes zu zeigen",
    "Rays per Frame": "Strahlen je Durchlauf",
    "How many rays all probes together trace before the light is shown again":
        "Wie viele Strahlen alle Sonden zusammen verfolgen, ehe das Licht wieder gezeigt wird",
    "Hysteresis": "Trägheit",
    "Share of a probe's light that is kept when new rays arrive while the scene changes: more is steadier and slower":
        "Anteil des Lichts einer Sonde, der bleibt, wenn neue Strahlen kommen, während sich die Szene ändert: mehr ist ruhiger und "
        "langsamer",
    "Rays per Update": "Strahlen je Auffrischung",
    "Rays that a probe traces when its turn comes; where they are more than the rays of a frame, probes take turns":
        "Strahlen, die eine Sonde verfolgt, wenn sie an der Reihe ist; sind es mehr als die eines Durchlaufs, wechseln sich Sonden "
        "ab",
    "Rest Below": "Ruhe unter",
    "Once the scene rests, probes gather light until its noise is below this share, and then trace no more rays":
        "Ruht die Szene, so sammeln Sonden Licht, bis sein Rauschen unter diesem Anteil liegt, und verfolgen dann keine Strahlen "
        "mehr",
}

LIVE: dict[str, str] = {
    "{0} holds the bake of one frame": "{0} enthält das Gebackene eines Bildes",
    "choose another folder in the render properties, or move that one away":
        "einen anderen Ordner in den Render-Eigenschaften wählen oder jenen verschieben",
    "this file was never saved, and a series needs a place that stays":
        "diese Datei wurde nie gespeichert, und eine Reihe braucht einen Platz, der bleibt",
    "save it, or choose a folder in the render properties": "sie speichern oder einen Ordner in den Render-Eigenschaften wählen",
    "scene {0} is no longer shown": "die Szene {0} wird nicht mehr gezeigt",
    "bake its frames again without going to another scene": "ihre Bilder noch einmal backen, ohne zu einer anderen Szene zu gehen",
    "live probes": "Live-Sonden",
    "Live probes do not follow what media scatter: bake for that":
        "Live-Sonden folgen nicht dem, was Medien streuen: dafür backen",
    "Live probes reflect the light of all lamps without a limit of bounces: bake for that":
        "Live-Sonden reflektieren das Licht aller Lampen ohne Grenze der Reflexionen: dafür backen",
    "Live probes reflect light never or without a limit of bounces: bake for another number":
        "Live-Sonden reflektieren Licht nie oder ohne Grenze der Reflexionen: für eine andere Zahl backen",
    "Frame {0} shows the bake of frame {1}": "Bild {0} zeigt das Gebackene von Bild {1}",
    "Frame {0}: {1}": "Bild {0}: {1}",
    "Frame {0}: reading the scene": "Bild {0}: Liest die Szene",
    "frame {0}": "Bild {0}",
    "{0} holds a bundle, and no series": "{0} enthält ein einzelnes Backergebnis und keine Reihe",
    "{0} is a series of bundles, and one is wanted": "{0} ist eine Reihe von Backergebnissen, und eines ist gefragt",
    "give the folder of one of its frames": "den Ordner eines ihrer Bilder angeben",
}
