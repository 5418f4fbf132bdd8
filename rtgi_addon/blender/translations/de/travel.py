"""Prepared bakes, their parts and clusters."""

TRAVEL: dict[str, str] = {
    "{0} holds {1}, which is not part of {2}": "{0} enthält {1}, das nicht zu {2} gehört",
    "a bundle": "Gebackenem",
    "a prepared bake": "einem vorbereiteten Backvorgang",
    "a part of a bake": "einem Teil eines Backvorgangs",
    "the new folder is whole; take what you need of {0}, and remove that":
        "der neue Ordner ist vollständig; das Nötige aus {0} nehmen und das entfernen",
    "{0} is damaged, it names other files than it has checksums of":
        "{0} ist beschädigt, es nennt andere Dateien als die, von denen es Prüfsummen hat",
    "{0} is damaged, it holds no scene": "{0} ist beschädigt, es enthält keine Szene",
    "{0} was made with {1} {2}, and this is {3} {4}: bytes might differ":
        "{0} wurde mit {1} {2} gemacht, und dies ist {3} {4}: Bytes könnten abweichen",
    "use {0} {1} on every machine, or prepare it again": "{0} {1} auf allen Rechnern verwenden oder neu vorbereiten",
    "Reading what was prepared": "Vorbereitetes wird gelesen",
    "part {0} failed on its workers ({1}: {2})": "Teil {0} ist auf seinen Rechnern gescheitert ({1}: {2})",
    "see the worker's log; run the same command again to go on with the parts that stand":
        "das Protokoll des Rechners ansehen; derselbe Befehl noch einmal macht mit den fertigen Teilen weiter",
    "the cluster has no workers": "der Verbund hat keine Rechner",
    "start some (dask worker ADDRESS)": "welche starten (dask worker ADRESSE)",
    "{0} of {1} parts, {2} workers": "{0} von {1} Teilen, {2} Rechner",
    "the workers cannot run rtgi ({0}: {1})": "auf den Rechnern läuft rtgi nicht ({0}: {1})",
    "worker {0} has kernels {1}, and {2} has {3}: their bytes differ by rounding":
        "Rechner {0} hat Kernel {1} und {2} hat {3}: Ihre Bytes weichen durch Rundung ab",
    "install the same kernels on every machine, or RTGI_KERNELS=off on all":
        "auf allen Rechnern dieselben Kernel installieren oder überall RTGI_KERNELS=off",
    "worker {0} does not see {1}": "Rechner {0} sieht {1} nicht",
    "put it, and --out, where all machines have the same path": "es und --out dorthin legen, wo alle Rechner denselben Pfad haben",
    "worker {0} has no Embree, its bytes would differ: {1}": "Rechner {0} hat kein Embree, seine Bytes würden abweichen: {1}",
    "Dask's distributed is not installed": "distributed von Dask ist nicht installiert",
    "there is no scheduler at {0} ({1})": "bei {0} ist kein Verteiler ({1})",
    "start one (dask scheduler), and give its address, tcp://HOST:8786":
        "einen starten (dask scheduler) und seine Adresse angeben, tcp://RECHNER:8786",
    "worker {0} has {1} {2}, and here it is {3}: bytes would differ":
        "Rechner {0} hat {1} {2}, und hier ist es {3}: Bytes würden abweichen",
    "install the same version on every machine": "auf allen Rechnern dieselbe Version installieren",
    "a bake of {0} is one piece, it has no parts": "ein Backvorgang mit {0} ist aus einem Stück, er hat keine Teile",
    "bake the file itself, or choose one of {0}": "die Datei selbst backen oder eines von {0} wählen",
    "this bake is one piece, {0}": "dieser Backvorgang ist aus einem Stück, {0}",
    "leave that out, or bake the file itself": "das weglassen oder die Datei selbst backen",
    "Reading {0}": "{0} wird gelesen",
    "there is nothing to merge": "es gibt nichts zusammenzuführen",
    "name the folders of all parts": "die Ordner aller Teile nennen",
    "of {0} parts these are missing: {1}": "von {0} Teilen fehlen diese: {1}",
    "bake what is missing, and name the folders of all parts": "backen, was fehlt, und die Ordner aller Teile nennen",
    "{0} is damaged, a bake of {1} has no parts": "{0} ist beschädigt, ein Backvorgang mit {1} hat keine Teile",
    "{0} is of another prepared bake than {1}": "{0} gehört zu einem anderen vorbereiteten Backvorgang als {1}",
    "merge parts of one bake alone": "nur Teile eines Backvorgangs zusammenführen",
    "{0} is one of {1} parts, and {2} one of {3}": "{0} ist einer von {1} Teilen und {2} einer von {3}",
    "cut the bake into as many everywhere": "den Backvorgang überall in gleich viele schneiden",
    "{0} was made with kernels {1}, and {2} with {3}: their bytes differ by rounding":
        "{0} wurde mit Kerneln {1} gemacht und {2} mit {3}: Ihre Bytes weichen durch Rundung ab",
    "make all parts with the same kernels": "alle Teile mit denselben Kerneln machen",
    "{0} is damaged, its blocks are not those of part {1}": "{0} ist beschädigt, seine Blöcke sind nicht die von Teil {1}",
    "{0} and {1} are both part {2}": "{0} und {1} sind beide Teil {2}",
    "leave one of them out": "eines von beiden weglassen",
    "{0} or a part of the same bake is damaged, its blocks have another form: {1}":
        "{0} oder ein Teil desselben Backvorgangs ist beschädigt, seine Blöcke haben eine andere Form: {1}",
    "{0} is damaged, {1} of block {2} is not in it": "{0} ist beschädigt, {1} von Block {2} ist nicht darin",
    "{0} is damaged, it is no file of arrays": "{0} ist beschädigt, es ist keine Datei mit Feldern",
    "{0} is damaged, array {1} does not lie in it": "{0} ist beschädigt, Feld {1} liegt nicht darin",
    "volume {0} cannot be baked in parts, {1}": "Volumen {0} kann nicht in Teilen gebacken werden, {1}",
    "switch Fit to Surfaces off there": "dort „An Flächen anpassen“ ausschalten",
}
