"""Media: what is wrong with them, in bundles, in exports and in plans."""

MEDIA: dict[str, str] = {
    "{0} is a volume whose file cannot be read (the values of {1} are damaged); it is left out":
        "{0} ist ein Volumen, dessen Datei nicht gelesen werden kann (die Werte von {1} sind beschädigt); es bleibt außen vor",
    "the blackbody of {0} is redder than colours of the scene can be: what Cycles takes of blue or green for it is left out":
        "der Schwarzkörper von {0} ist röter, als Farben der Szene sein können: Was Cycles dafür an Blau oder Grün abzieht, "
        "entfällt",
    "{0} gives light everywhere and takes none of it: along a ray into the sky it never ends":
        "{0} gibt überall Licht und nimmt keines davon: Entlang eines Strahls in den Himmel endet es nie",
    "give its volume a density that scatters or absorbs, or put the glow into a mesh":
        "dem Volumen eine Dichte geben, die streut oder absorbiert, oder das Leuchten in ein Mesh legen",
    "{0} names {1}, which has no checksum": "{0} nennt {1}, wozu es keine Prüfsumme gibt",
    "{0} holds values that are negative or not finite": "{0} enthält Werte, die negativ oder nicht endlich sind",
    "medium {0}: its {1} is negative or not finite": "Medium {0}: {1} ist negativ oder nicht endlich",
    "correct the volume's grid or its material": "das Gitter des Volumens oder sein Material berichtigen",

    # Exports.
    "Writing the media": "Medien werden geschrieben",
    "medium {0}: ambient light is scattered by the first moments of {1}, that of an engine's own lamps as by Henyey-Greenstein of "
    "g = {2}":
        "Medium {0}: Umgebungslicht wird mit den ersten Momenten von {1} gestreut, das der Lampen einer Engine wie von "
        "Henyey-Greenstein mit g = {2}",
    "the ambient light in media is held on {0} cells a side at most, coarser than the probes":
        "das Umgebungslicht in Medien liegt auf höchstens {0} Zellen je Seite, gröber als die Sonden",
    "{0} makes a 3D texture of {1} x {2} x {3}, and {4} is the most that every driver has":
        "{0} ergibt eine 3D-Textur von {1} x {2} x {3}, und {4} ist das Meiste, was jeder Treiber hat",
    "Godot's fog has one g for the lamps' light, {0}: that of {1} is lost":
        "Godots Nebel hat ein einziges g für das Licht der Lampen, {0}: das von {1} geht verloren",
    "Godot's fog dims all colours alike, in {0} by {1} a metre instead of {2}":
        "Godots Nebel schwächt alle Farben gleich, in {0} um {1} je Meter statt {2}",
    "medium {0}: Godot's fog volumes scatter {1} a metre and give {2} W/(sr m^3) at most, and this one does {3} and {4}; "
    "media_view.gdshader holds it":
        "Medium {0}: Godots Nebelvolumen streuen höchstens {1} je Meter und geben höchstens {2} W/(sr m^3), dieses {3} und {4}; "
        "media_view.gdshader fasst es",
    "Godot's fog gives light only where it is dense: the world's is given a density of 0.0001 a metre":
        "Godots Nebel gibt nur Licht, wo er dicht ist: Der der Welt bekommt eine Dichte von 0,0001 je Meter",
}
