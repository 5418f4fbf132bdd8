"""What is said of a file as it was read, in German, by the pattern of its English."""

READING: dict[str, str] = {
    "Estimating what was left out": "Schätzt, was außen vor blieb",
    "{0} ({1})": "{0} ({1})",
    "concerns {0} % of the light at the probes, {1}": "betrifft {0} % des Lichts an den Sonden, {1}",
    "concerns less than {0} % of the light at the probes, {1}": "betrifft weniger als {0} % des Lichts an den Sonden, {1}",
    "how much light that concerns is not known": "wie viel Licht das betrifft, ist nicht bekannt",
    "estimated": "geschätzt",
    "measured": "gemessen",

    "this file was never saved, and its bake is gone when Blender quits: save it, and the bake moves beside it":
        "diese Datei wurde nie gespeichert, und das Gebackene ist fort, wenn Blender endet: speichern, dann rückt es neben sie",

    # What is not followed.
    "pictures show the light that passes diffusely through {0} as reflected":
        "Bilder zeigen das Licht, das {0} gestreut durchlässt, als reflektiert",
    "its {0} has no formula here: the diffuse colour that Cycles bakes of it is taken, which may be black":
        "für {0} gibt es hier keine Formel: es gilt die Farbe, die Cycles als diffuse davon backt, und die kann schwarz sein",
    "the light that goes some {0} m beneath its surface leaves it where it entered":
        "das Licht, das etwa {0} m unter die Oberfläche geht, verlässt sie, wo es eintrat",
    "its anisotropic reflection is taken as that of even roughness":
        "seine anisotrope Spiegelung gilt als die gleichmäßiger Rauheit",
    "the colours of its thin film are left out": "die Farben seines dünnen Films bleiben weg",
    "lamp {0} lights linked objects alone, and probes give its direct light to all":
        "Lampe {0} beleuchtet nur verknüpfte Objekte, und Sonden geben ihr direktes Licht allen",
    "transfer bakes all volumes with the same settings: those of volume {0} are not followed":
        "transfer berechnet alle Volumen mit denselben Einstellungen: die von Volumen {0} gelten nicht",
    "{0} gives volume {1} all light as it is, whatever its Capture and Intensity say":
        "{0} gibt dem Volumen {1} alles Licht, wie es ist, was auch immer seine Aufnahme und Intensität sagen",
    "lamp '{0}': its nodes mix direction, place and distance, and are followed as a product, up to {1} of its light off":
        "Lampe „{0}“: ihre Nodes mischen Richtung, Ort und Abstand, und ihnen wird als Produkt gefolgt, um bis zu {1} ihres Lichts "
        "daneben",
    "the volume of world '{0}' differs from place to place and cannot be read: {1}; it is left out":
        "das Volumen der Welt „{0}“ ist von Ort zu Ort anders und kann nicht gelesen werden: {1}; es bleibt außen vor",
    "the volume of world '{0}' differs from place to place, and there is nothing to sample it around":
        "das Volumen der Welt „{0}“ ist nicht überall gleich, und es gibt nichts, um das herum es abzutasten wäre",
    "{0} has the volume of material '{1}' within a surface that is not closed, or whose faces point both ways; the volume is left "
    "out":
        "{0} hat das Volumen des Materials „{1}“ in einer Fläche, die nicht geschlossen ist oder deren Seiten gemischt zeigen; das "
        "Volumen bleibt außen vor",
    "{0} is a volume whose file cannot be read ({1}); it is left out":
        "{0} ist ein Volumen, dessen Datei nicht gelesen werden kann ({1}); es bleibt außen vor",
    "{0} is a volume without grids of numbers; it is left out": "{0} ist ein Volumen ohne Gitter von Zahlen; es bleibt außen vor",
    "{0} is a volume with nothing in it; it is left out": "{0} ist ein Volumen, in dem nichts ist; es bleibt außen vor",
    "{0} holds a volume{1} that cannot be read: {2}; it is left out":
        "{0} enthält ein Volumen{1}, das nicht gelesen werden kann: {2}; es bleibt außen vor",
    "the grids of {0} are read on {1} cells, {2} times coarser than they are":
        "die Gitter von {0} werden auf {1} Zellen gelesen, {2}-mal gröber als sie sind",
    "the grid '{0}' of {1} has values at NaN or infinity, which count as 0":
        "das Gitter „{0}“ von {1} hat Werte bei NaN oder unendlich, die als 0 zählen",
    "the grid 'density' of {0} is negative in places, which count as 0":
        "das Gitter „density“ von {0} ist stellenweise negativ, was als 0 zählt",
    "world '{0}': {1}": "Welt „{0}“: {1}",
    "the volume of material '{0}': {1}": "das Volumen des Materials „{0}“: {1}",
    "{0} is no volume shader, and is left out": "{0} ist kein Volumen-Shader und bleibt außen vor",
    "{0} of {1} is negative, which counts as 0": "{0} von {1} ist negativ, was als 0 zählt",
    "{0} of {1} varies, and is taken as its mean": "{0} von {1} ist nicht überall gleich, genommen wird der Mittelwert",
    "{0} is hidden from volume scatter rays: bakes and rays from media follow that, and what pictures take from probes for their "
    "media does not":
        "{0} ist für Volumenstreuung unsichtbar: Berechnungen und Strahlen aus Medien folgen dem; was Bilder für ihre Medien aus "
        "Sonden nehmen, nicht",
    "{0} is visible to volume scatter rays alone and is left out: what media scatter passes it":
        "{0} ist nur für Volumenstreuung sichtbar und bleibt außen vor: was Medien streuen, geht hindurch",
    "lamp {0}: its influence on volumes, {1}, is followed, which Cycles does not do":
        "Lampe {0}: ihrem Einfluss auf Volumen, {1}, wird gefolgt, was Cycles nicht tut",
    "the volume of world '{0}': {1}": "das Volumen der Welt „{0}“: {1}",
    "differs from place to place, and is sampled on {0} cells of {1} m around the scene; beyond ({2}) to ({3}) there is none of it":
        "ist nicht überall gleich und wird um die Szene herum auf {0} Zellen von {1} m abgetastet; jenseits von ({2}) bis ({3}) "
        "gibt es nichts davon",
    "differs from place to place, and is sampled on {0} cells": "ist nicht überall gleich und wird auf {0} Zellen abgetastet",
    "bake again": "erneut backen",
    "reflections are shown by each of {0}: switch all but one off":
        "Spiegelungen zeigt jeder dieser Effekte: {0}; alle bis auf einen abschalten",
    "what media scatter cannot be relit": "was Medien streuen, lässt sich nicht neu beleuchten",

    "the world {0}": "die Welt {0}",
    "the nodes of lamp {0}": "die Nodes der Lampe {0}",
    "glTF has no lamps with a profile: the model has {0} as bright as on average everywhere":
        "glTF kennt keine Lampen mit Profil: im Modell ist {0} überall so hell wie im Mittel",

    # What is wrong with a medium.
    "{0} follow media in part only, and not what they scatter or give: bake with probes for that":
        "{0} folgen Medien nur zum Teil, und nicht dem, was sie streuen oder abgeben: dafür mit Sonden backen",
    "{0} has a medium on a grid without cells": "{0} hat ein Medium auf einem Gitter ohne Zellen",
    "give its grid cells, or hide it": "dem Gitter Zellen geben, oder es ausblenden",
    "{0} has NaN or infinity in its medium's {1}": "{0} hat NaN oder unendlich in seinem Medium: {1}",
    "{0} has negative values in its medium's {1}": "{0} hat negative Werte in seinem Medium: {1}",
    "mend its nodes or its file": "seine Nodes oder seine Datei in Ordnung bringen",
    "give values from 0": "Werte ab 0 geben",
    "{0} scatters with an anisotropy of {1}": "{0} streut mit einer Anisotropie von {1}",
    "give one between -1 and 1": "eine zwischen -1 und 1 geben",

    # What could not be brought.
    "library {0} {1}, and {2} is not there": "Bibliothek {0} {1}, und {2} ist nicht da",
    "is missing": "fehlt",
    "has changed": "hat sich geändert",
    "restore it, or choose File > External Data > Find Missing Files; or remove what needs it":
        "wiederherstellen, oder Datei > Externe Daten > Fehlende Dateien suchen; oder entfernen, was es braucht",
    "file {0} is missing, and with it {1}": "die Datei {0} fehlt, und mit ihr {1}",
    "image {0} is read whole, and Cycles makes it no larger than {1} pixels (Simplify > Texture Limit)":
        "Bild {0} wird ganz gelesen, und Cycles macht es nicht größer als {1} Pixel (Vereinfachen > Texturgrenze)",
    "{0} is driven by Python that was not run: {1}": "{0} hängt von Python ab, das nicht ausgeführt wurde: {1}",
    "allow the file's scripts if you trust it (--enable-scripts, or Allow Execution), or delete the driver":
        "die Skripte der Datei erlauben, wenn man ihr traut (--enable-scripts, oder Ausführung erlauben), oder den Treiber löschen",
    "text {0} is to run when the file is opened, and was not run":
        "Text {0} soll beim Öffnen der Datei laufen und wurde nicht ausgeführt",
}
