"""What is said about places: paths that will not do, locks, folders of ours, files that somebody changed, checkpoints."""

STORAGE: dict[str, str] = {
    # Paths.
    "{0} does not end in {1}": "{0} endet nicht auf {1}",
    "give {0} one of these ends": "{0} eine dieser Endungen geben",
    "the name is empty": "der Name ist leer",
    "correct {0}": "{0} berichtigen",
    "{0} is no path, {1}": "{0} ist kein Pfad, {1}",
    "{0} is the top of a disk": "{0} ist die oberste Ebene eines Datenträgers",
    "give {0} a folder in it": "für {0} einen Ordner darin angeben",
    "create it first, or choose another {0}": "ihn erst anlegen, oder für {0} etwas anderes wählen",
    "choose a folder as {0}": "für {0} einen Ordner wählen",
    "{0} is a folder": "{0} ist ein Ordner",
    "choose a file as {0}": "für {0} eine Datei wählen",
    "{0} is a device or a pipe": "{0} ist ein Gerät oder eine Pipe",
    "{0} is write-protected": "{0} ist schreibgeschützt",
    "choose another {0}, or change its permissions": "für {0} etwas anderes wählen, oder die Zugriffsrechte ändern",
    "{0} is what is read": "{0} ist das, was gelesen wird",
    "{0}, which is read, lies in {1}": "{0}, das gelesen wird, liegt in {1}",
    "{0} lies inside {1}, which is read": "{0} liegt in {1}, das gelesen wird",
    "{0} is a bundle or unfinished work": "{0} ist etwas Gebackenes oder Unfertiges",
    "{0} lies inside {1}, which is a bundle or unfinished work": "{0} liegt in {1}, etwas Gebackenem oder Unfertigem",
    "choose another {0}": "für {0} etwas anderes wählen",
    "{0} and {1} are both to be written and lie in each other's way":
        "{0} und {1} sollen beide geschrieben werden und sind einander im Weg",
    "the name {0} is too long for that disk": "der Name {0} ist für diesen Datenträger zu lang",
    "choose a shorter name": "einen kürzeren Namen wählen",
    "{0} is a mount point, which cannot be replaced": "{0} ist ein Einhängepunkt, der nicht ersetzt werden kann",
    "choose a folder in it as {0}": "für {0} einen Ordner darin wählen",
    "{0} has room for {1} MiB, and {2} takes at least {3} MiB": "{0} hat Platz für {1} MiB, und {2} braucht mindestens {3} MiB",
    "free some space on that disk or write somewhere else": "auf diesem Datenträger Platz schaffen oder anderswohin schreiben",
    "{0} is not a file": "{0} ist keine Datei",
    "choose another place": "einen anderen Ort wählen",

    # Who is at work.
    "process {0} on {1} is writing {2} ({3}, since {4})": "Prozess {0} auf {1} schreibt {2} ({3}, seit {4})",
    "another process is writing {0}": "ein anderer Prozess schreibt {0}",
    "wait until it is done, or choose another place": "warten, bis er fertig ist, oder einen anderen Ort wählen",
    "wait until it is done, or remove {0} if it no longer runs":
        "warten, bis er fertig ist, oder {0} entfernen, falls er nicht mehr läuft",
    "somebody removed {0} while {1} was being written": "jemand hat {0} entfernt, während {1} geschrieben wurde",
    "make sure that nobody else writes there, and try again":
        "dafür sorgen, dass sonst niemand dorthin schreibt, und es noch einmal versuchen",

    # What is not ours.
    "{0} is in the way, rtgi did not write it": "{0} ist im Weg, rtgi hat es nicht geschrieben",
    "{0} is in the way, rtgi did not make it": "{0} ist im Weg, rtgi hat es nicht angelegt",
    "move it away, or choose another place": "es wegräumen oder einen anderen Ort wählen",
    "{0} holds {1}, which rtgi did not write": "{0} enthält {1}, das rtgi nicht geschrieben hat",
    "{0} holds {1}, which was changed since it was written": "{0} enthält {1}, das geändert wurde, seit es geschrieben ist",
    "move that away: the folder goes when the work is done": "das wegräumen: der Ordner verschwindet, wenn die Arbeit getan ist",
    "choose another --out, or move that folder away": "einen anderen Ausgabeordner wählen oder diesen wegräumen",
    "{0} was replaced while somebody put {1} there": "{0} wurde ersetzt, während jemand {1} dorthin legte",
    "the new bundle is whole; take what you need of {0}, and remove that":
        "das neu Gebackene ist ganz; aus {0} nehmen, was gebraucht wird, und es entfernen",
    "{0} was changed while it was being replaced": "{0} wurde geändert, während es ersetzt wurde",
    "take what you need of {0}, remove {1} and try again":
        "aus {0} nehmen, was gebraucht wird, {1} entfernen und es noch einmal versuchen",
    "{0} is damaged": "{0} ist beschädigt",
    "look what is in that folder, and remove it": "nachsehen, was in diesem Ordner liegt, und ihn entfernen",

    # Reports and pictures.
    "the picture {0} did not get to the disk whole": "das Bild {0} kam nicht ganz auf den Datenträger",
    "{0} was written by an rtgi that kept no checksums": "{0} wurde von einem rtgi geschrieben, das keine Prüfsummen behielt",
    "{0} settings that were measured are in {1}, the chart in {2} is the earlier one; --resume goes on from there":
        "{0} gemessene Einstellungen liegen in {1}, das Diagramm in {2} ist das frühere; „Fortsetzen“ macht dort weiter",
    "{0} settings and {1} pictures that were measured are in {2}, the chart in {3} is the earlier one; --resume goes on from there":
        "{0} gemessene Einstellungen und {1} Bilder liegen in {2}, das Diagramm in {3} ist das frühere; „Fortsetzen“ macht dort "
        "weiter",
    "{0} settings and {1} pictures that were measured are in {2}; --resume goes on from there":
        "{0} gemessene Einstellungen und {1} Bilder liegen in {2}; „Fortsetzen“ macht dort weiter",
    "{0} settings that were measured are in {1}; --resume goes on from there":
        "{0} gemessene Einstellungen liegen in {1}; „Fortsetzen“ macht dort weiter",
    "what was measured is in {0}, the report in {1} is the earlier one; --resume goes on from there":
        "das Gemessene liegt in {0}, der Bericht in {1} ist der frühere; „Fortsetzen“ macht dort weiter",
    "what was measured is in {0}; --resume goes on from there": "das Gemessene liegt in {0}; „Fortsetzen“ macht dort weiter",
    "the bundle {0} is written, its picture is not": "das Gebackene liegt in {0}, das Bild davon nicht",

    # Exports.
    "{0} is a file where a folder is due": "{0} ist eine Datei, wo ein Ordner hingehört",
    "{0} is not of rtgi, and a file of that name is due": "{0} ist nicht von rtgi, und eine Datei dieses Namens gehört dorthin",
    "{0} was changed since it was written, and is due with other content":
        "{0} wurde geändert, seit es geschrieben ist, und soll einen anderen Inhalt bekommen",
    "Putting the files in place": "Dateien an ihren Platz legen",
    "unknown part {0}": "unbekannter Teil {0}",
    "an export for {0} has no part that goes into projects alone":
        "ein Export für {0} hat keinen Teil, der allein in Projekte geht",
    "export --part all": "alles exportieren",
    "choose another --out, or --part files to put the probes into a project":
        "einen anderen Ausgabeordner wählen, oder den Teil „Nur Sonden“ für ein Projekt",
    "{0} holds an export to {1}": "{0} enthält einen Export für {1}",
    "choose another --out": "einen anderen Ausgabeordner wählen",
    "a model goes into the sample scene, which is no part of what goes into a project":
        "ein Modell gehört in die Beispielszene, und die kommt nicht in ein Projekt",
    "leave out --model, or export --part all": "--model weglassen, oder mit --part all exportieren",

    # Checkpoints.
    "the checkpoint {0} belongs to another run, changed since: {1}":
        "der Zwischenstand {0} gehört zu einem anderen Lauf, seither geändert: {1}",
    "undo the change, or run it without --resume to start over":
        "die Änderung zurücknehmen, oder ohne --resume von vorn beginnen",
    "the checkpoint {0} belongs to another run": "der Zwischenstand {0} gehört zu einem anderen Lauf",
    "the checkpoint {0} is damaged, {1}": "der Zwischenstand {0} ist beschädigt, {1}",
    "run it without --resume to start over": "ohne --resume von vorn beginnen",
}
