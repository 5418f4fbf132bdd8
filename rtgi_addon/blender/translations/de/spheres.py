"""Sphere probes: their settings and panels, and what is wrong with them."""

SPHERE_LABELS: dict[str, str] = {
    "Sphere Probes": "Kugelsonden",
    "How sphere probes are baked": "Wie Kugelsonden gebacken werden",
    "Bake what arrives at Light Probe Spheres, for reflections": "Backen, was bei Lichtsonden-Kugeln ankommt, für Spiegelungen",
    "Texels along a side of the map of all directions around a sphere probe":
        "Texel entlang einer Seite der Karte aller Richtungen um eine Kugelsonde",
    "32": "32", "64": "64", "128": "128", "256": "256",
    "Rays per Texel": "Strahlen je Texel",
    "Rays from a sphere probe into each texel of its map": "Strahlen von einer Kugelsonde in jedes Texel ihrer Karte",
    "Rays from a sphere probe into each texel of its map (1 to 1,024)":
        "Strahlen von einer Kugelsonde in jedes Texel ihrer Karte (1 bis 1.024)",
    "What a sphere probe sees in mirrors, from mirror to mirror so often":
        "Was eine Kugelsonde in Spiegeln sieht, so oft von Spiegel zu Spiegel",
    "What a sphere probe sees in mirrors, from mirror to mirror so often (0 to 16)":
        "Was eine Kugelsonde in Spiegeln sieht, so oft von Spiegel zu Spiegel (0 bis 16)",
    "Size": "Größe", "Radius": "Radius", "End": "Ende",
    "No Light Probe Sphere: add one with Add > Light Probe > Sphere":
        "Keine Lichtsonden-Kugel: mit Hinzufügen > Lichtsonde > Kugel eine anlegen",
    "{count} Light Probe Spheres in the scene": "{count} Lichtsonden-Kugeln in der Szene",
}
SPHERES: dict[str, str] = {
    "Sphere probes are baked beside it ({0}), at their defaults by {1} million paths: no figure here has them in it":
        "Kugelsonden werden daneben gebacken ({0}), mit ihren Vorgaben auf {1} Millionen Pfaden: keine Zahl hier enthält sie",
    "Looking from sphere probes": "Von Kugelsonden aus wird geschaut",
    "Lighting sphere probes": "Kugelsonden werden beleuchtet",
    "Blurring sphere probes": "Kugelsonden werden geglättet",
    "sphere probes {0} see more than {1} W/(sr m²) in places, which is cut to that":
        "die Kugelsonden {0} sehen stellenweise mehr als {1} W/(sr m²), was darauf gekürzt wird",
    "sphere probe {0} lies inside {1} and is left out: move it into the open":
        "die Kugelsonde {0} liegt in {1} und entfällt: ins Freie schieben",
    "camera {0} lies inside {1}, which no light gets into: move it into the open":
        "die Kamera {0} liegt in {1}, wohin kein Licht kommt: ins Freie schieben",
    "sphere probe {0} does not see {1} in {2} % of all directions, nearer than its Clip Start of {3} m: lower that, or what is "
    "behind shows in their place":
        "die Kugelsonde {0} sieht {1} in {2} % aller Richtungen nicht, näher als ihr Beschneidungsbeginn von {3} m: senken, sonst "
        "erscheint dort, was dahinter liegt",
    "sphere probe {0} does not see {1} in {2} % of all directions, beyond its Clip End of {3} m: raise that, or the world shows in "
    "their place":
        "die Kugelsonde {0} sieht {1} in {2} % aller Richtungen nicht, weiter weg als ihr Beschneidungsende von {3} m: erhöhen, "
        "sonst erscheint dort die Welt",
    "{0} holds values that are negative, not finite or no half floats":
        "{0} enthält Werte, die negativ, nicht endlich oder keine halben Gleitkommazahlen sind",
    "sphere probe {0}: its radiance is negative or not finite": "Kugelsonde {0}: ihre Strahldichte ist negativ oder nicht endlich",
    "{0} has a transform or distance that makes no volume of it":
        "{0} hat eine Transformation oder Entfernung, die kein Volumen ergibt",
    "give it a scale on all three axes, and distances above 0": "auf allen drei Achsen skalieren, Entfernungen über 0 geben",
    "{0} has a Clip Start of {1} m and a Clip End of {2} m":
        "{0} hat einen Beschneidungsbeginn von {1} m und ein Beschneidungsende von {2} m",
    "give an end beyond the start": "ein Ende hinter dem Beginn geben",
    "{0} has {1} sphere probes, and {2} is the most that reflections are read from":
        "{0} hat {1} Kugelsonden, und Spiegelungen werden aus höchstens {2} gelesen",
    "sphere probes keep the light of the bake: mirrors do not follow a sun or sky that changes":
        "Kugelsonden behalten das Licht des Backens: Spiegel folgen einer Sonne oder einem Himmel nicht, die sich ändern",
    "hide some of them from renders": "einige davon im Rendering verbergen",
    "sphere probes saw other lamps or another world: mirrors show the field's light until the next bake":
        "Kugelsonden sahen andere Lampen oder eine andere Welt: Spiegel zeigen bis zum nächsten Backen das Licht des Feldes",
    "sphere probes are left out: they hold the light of the bake alone":
        "die Kugelsonden werden weggelassen: sie enthalten allein das Licht des Backens",
}
