"""Light of what glows closer to others than probes are apart."""

GLOW: dict[str, str] = {
    "light of {0} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: pictures and engines "
    "show it so, for {1} (finer cells there mend it, or lamps in place of meshes)":
        "Licht von {0} fällt auf Flächen, die näher sind als Sonden beieinander, und sie halten es über eine Zelle verwischt: "
        "Bilder und Engines zeigen es so, denn {1} (feinere Zellen dort beheben es, oder Lampen statt Meshes)",
    "light of {0} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: pictures and engines "
    "show it so, for only what shines evenly from few flat faces is drawn at each pixel (finer cells there mend it, or lamps in "
    "place of meshes)":
        "Licht von {0} fällt auf Flächen, die näher sind als Sonden beieinander, und sie halten es über eine Zelle verwischt: "
        "Bilder und Engines zeigen es so, denn nur was gleichmäßig und aus wenigen ebenen Flächen leuchtet, wird je Pixel "
        "gezeichnet (feinere Zellen dort beheben es, oder Lampen statt Meshes)",
    "light of {0} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: RTGI draws it at each "
    "pixel, but not that of {1} (only what shines evenly from few flat faces), and engines show it blurred (finer cells there mend "
    "it, or lamps in place of meshes; --fit lessens it, in engines only)":
        "Licht von {0} fällt auf Flächen, die näher sind als Sonden beieinander, und sie halten es über eine Zelle verwischt: RTGI "
        "zeichnet es je Pixel, aber nicht das von {1} (nur was gleichmäßig und aus wenigen ebenen Flächen leuchtet), und Engines "
        "zeigen es verwischt (feinere Zellen dort beheben es, oder Lampen statt Meshes; --fit verringert es, nur in Engines)",
    "light of {0} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: RTGI draws it at each "
    "pixel, engines show it blurred (finer cells there mend it, or lamps in place of meshes; --fit lessens it, in engines only)":
        "Licht von {0} fällt auf Flächen, die näher sind als Sonden beieinander, und sie halten es über eine Zelle verwischt: RTGI "
        "zeichnet es je Pixel, Engines zeigen es verwischt (feinere Zellen dort beheben es, oder Lampen statt Meshes; --fit "
        "verringert es, nur in Engines)",
    "probes are fitted": "Sonden sind angepasst",
    "the scene has media": "die Szene hat Medien",
    "light is linked to objects": "Licht ist mit Objekten verknüpft",
    "a volume does not capture all light": "ein Volumen erfasst nicht alles Licht",
    "light on surfaces is off by some {0}, and noise at the probes ({1}) is not why, they lie too far apart: fit them to surfaces "
    "(--fit, Fit to Surfaces; RTGI's pictures then no longer draw what glows close by at each pixel), or have a finer lattice "
    "planned (rtgi plan, Plan Bake)":
        "Licht auf Flächen ist um etwa {0} falsch, und Rauschen an den Sonden ({1}) ist nicht der Grund, sie liegen zu weit "
        "auseinander: sie an Flächen anpassen (--fit, An Flächen anpassen; Bilder von RTGI zeichnen dann nicht mehr je Pixel, was "
        "nahebei leuchtet) oder ein feineres Gitter planen lassen (rtgi plan, Backen planen)",
}
