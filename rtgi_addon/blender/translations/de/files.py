"""What is said about files: bundles, checkpoints, exports, disks."""

FILES: dict[str, str] = {
    "the folder {0} does not exist": "den Ordner {0} gibt es nicht",
    "create it first, or choose another --out": "ihn erst anlegen, oder einen anderen Ausgabeordner wählen",
    "{0} is a file": "{0} ist eine Datei",
    "choose a folder as --out": "einen Ordner für die Ausgabe wählen",
    "{0} holds {1}, which is not part of an export for {2}": "{0} enthält {1}, das nicht zu einem Export für {2} gehört",
    "choose another --out, or move that away: the whole folder is replaced":
        "einen anderen Ausgabeordner wählen oder das wegräumen: der ganze Ordner wird ersetzt",
    "{0} would be replaced and is no bundle this version can read, {1}":
        "{0} würde ersetzt und ist nichts Gebackenes, das diese Version lesen kann, {1}",
    "choose another --out, or remove that folder": "einen anderen Ausgabeordner wählen oder diesen entfernen",
    "volume {0}: {1} is not finite at {2} probes, first at {3}":
        "Volumen {0}: {1} ist bei {2} Sonden nicht endlich, zuerst bei {3}",
    "look for infinite light strengths in the scene, and report this with the file":
        "in der Szene nach unendlichen Lichtstärken suchen, und dies mit der Datei melden",
    "{0} is damaged, {1}": "{0} ist beschädigt, {1}",
    "{0} is cut short or damaged, its checksum is not the one in {1}":
        "{0} ist abgeschnitten oder beschädigt, seine Prüfsumme ist nicht die in {1}",
    "{0} has channels {1} instead of {2}": "{0} hat die Kanäle {1} statt {2}",
    "{0} holds values that are not finite": "{0} enthält Werte, die nicht endlich sind",
    "{0} has schema {1} instead of {2}": "{0} hat das Schema {1} statt {2}",
    "{0} is not an EXR file": "{0} ist keine EXR-Datei",
    "{0} was not written by rtgi": "{0} ist nicht von rtgi geschrieben",
    "{0} was not written by rtgi ({1})": "{0} ist nicht von rtgi geschrieben ({1})",
    "{0} is not a bundle, it has no {1}": "{0} ist nichts Gebackenes, es hat kein {1}",
    "there is no bundle at {0}": "bei {0} liegt nichts Gebackenes",
    "give the folder that `bake --out` wrote": "den Ordner angeben, in den gebacken wurde",
    "bake again, or use the rtgi that wrote it": "neu backen, oder das rtgi nehmen, das es schrieb",
    "cannot {0} {1}, {2}{3}": "{1} geht nicht ({0}), {2}{3}",
    "cannot write {0} ({1})": "{0} kann nicht geschrieben werden ({1})",
    "cannot write the picture {0} ({1})": "das Bild {0} kann nicht geschrieben werden ({1})",
    "choose another place or free space": "einen anderen Ort wählen oder Platz schaffen",
    "cannot make the folder {0} ({1})": "der Ordner {0} kann nicht angelegt werden ({1})",
    "choose another place for the report": "für den Bericht einen anderen Ort wählen",
    "{0} is in the way, it is no checkpoint": "{0} ist im Weg und kein Zwischenstand",
    "move it away or choose another --out": "es wegräumen oder einen anderen Ausgabeordner wählen",
    "the checkpoint {0} is damaged": "der Zwischenstand {0} ist beschädigt",
    "bake without --resume to start over": "ohne --resume von vorn backen",
    "the checkpoint {0} belongs to another bake, changed since: {1}":
        "der Zwischenstand {0} gehört zu einem anderen Backen, seither geändert: {1}",
    "undo the change, or bake without --resume to start over": "die Änderung zurücknehmen oder ohne --resume von vorn backen",
    "a volume of {0} probes does not fit an image of {1} pixels a side":
        "ein Volumen von {0} Sonden passt nicht in ein Bild von {1} Pixeln je Seite",
    "lower its resolution or split it into several volumes": "seine Auflösung senken oder es in mehrere Volumen teilen",

    # What was read back.
    "{0} is damaged, it is not as it was written: its checksum is another":
        "{0} ist beschädigt, es ist nicht, wie es geschrieben wurde: seine Prüfsumme ist eine andere",
    "{0} is cut short or damaged ({1})": "{0} ist abgeschnitten oder beschädigt ({1})",
    "{0} is cut short or damaged, it has {1} bytes instead of {2}":
        "{0} ist abgeschnitten oder beschädigt, es hat {1} Bytes statt {2}",
    "{0} holds values that are not from {1} to {2}": "{0} enthält Werte, die nicht von {1} bis {2} reichen",
    "{0} does not belong to {1}, they differ in {2}": "{0} gehört nicht zu {1}, sie unterscheiden sich in {2}",
    "{0} needs {1} GiB of memory, and {2} GiB are free": "{0} braucht {1} GiB Speicher, und {2} GiB sind frei",
    "close other programs, or bake it with a lower resolution":
        "andere Programme schließen, oder es mit einer niedrigeren Auflösung backen",
    "the image '{0}' of {1} × {2} texels {3}": "das Bild „{0}“ von {1} × {2} Texeln {3}",
    "the bake {0}": "das Backen {0}",
    "hide what the probes do not need to see, or simplify its meshes":
        "ausblenden, was die Sonden nicht sehen müssen, oder die Netze vereinfachen",
    "lower the size of its images": "die Größe der Bilder senken",
    "lower the volume's resolution or the SH order": "die Auflösung des Volumens oder die SH-Ordnung senken",
    "allow a larger error, set a larger texel size, or place the volumes closer to what they light":
        "einen größeren Fehler zulassen, größere Texel setzen, oder die Volumen näher an das rücken, was sie beleuchten",
    "leave out --fit (Fit to Surfaces), or lower the volume's resolution":
        "--fit (An Flächen anpassen) weglassen oder die Auflösung des Volumens senken",
    "use fewer threads, a larger error or a lower resolution":
        "weniger Threads, einen größeren Fehler oder eine niedrigere Auflösung nehmen",
    "use fewer threads": "weniger Threads nehmen",
    "lower the resolution of the lamps' maps, or leave out lamps": "die Auflösung der Lampenkarten senken, oder Lampen weglassen",
    "lower the number of virtual lights, or of candidates for each":
        "die Zahl der virtuellen Lichter senken, oder die der Kandidaten für jedes",
    "lower the resolution of the volumes, or use fewer cascades":
        "die Auflösung der Volumen senken, oder weniger Kaskaden nehmen",
    "lower the resolution, raise the voxel size, or use fewer cascades":
        "die Auflösung senken, größere Voxel setzen, oder weniger Kaskaden nehmen",
    "there is not enough memory ({0})": "der Speicher reicht nicht ({0})",
    "close other programs, raise the limit if one is set, or lower resolution, order and sizes of images":
        "andere Programme schließen, eine gesetzte Grenze anheben, oder Auflösung, Ordnung und Bildgrößen senken",
    "{0} is a link that leads outside of {1}": "{0} ist eine Verknüpfung, die aus {1} hinausführt",
    "put the file itself there": "die Datei selbst dort ablegen",
    "use the rtgi that wrote it, or {0}": "das rtgi nehmen, das es schrieb, oder {0}",
    "{0} grew while it was read": "{0} wuchs, während es gelesen wurde",
    "wait until it is written, and try again": "warten, bis es geschrieben ist, und es noch einmal versuchen",
    "{0} is a folder where a file should be": "{0} ist ein Ordner, wo eine Datei sein sollte",
    "{0} {1} is read from {2}, a pipe, a device or a socket":
        "{0} {1} wird aus {2} gelesen, einer Pipe, einem Gerät oder einem Socket",
    "give it a file, or remove it": "eine Datei dafür angeben oder es entfernen",
    "{0} is a pipe, a device or a socket, not a file": "{0} ist eine Pipe, ein Gerät oder ein Socket, keine Datei",
    "correct the path, or restore the file": "den Pfad berichtigen, oder die Datei wiederherstellen",
    "{0} has {1} bytes, which is more than the {2} it may have": "{0} hat {1} Bytes, mehr als die {2}, die es haben darf",
    "bake.json has no checksum of itself, as before there was one: a change in it would not be noticed":
        "bake.json hat keine Prüfsumme seiner selbst, wie bevor es eine gab: eine Änderung darin fiele nicht auf",
    "glTF has no area lamps: the model lacks {0}": "glTF kennt keine Flächenlampen: dem Modell fehlt {0}",
}
