"""What objects and lamps are to bakes, in German, by its English."""

ROLES: dict[str, str] = {
    "In Bakes": "Beim Backen",
    "What this object is to bakes of RTGI": "Was dieses Objekt beim Backen von RTGI ist",
    "Static": "Statisch",
    "Reflects light, throws shadows and receives light": "Reflektiert Licht, wirft Schatten und empfängt Licht",
    "Dynamic": "Dynamisch",
    "Receives light, and the bake does not know it: for what moves in the game. The same as switching off Visibility, Light "
    "Probes, Volume":
        "Empfängt Licht, und das Gebackene kennt es nicht: für alles, was sich im Spiel bewegt. Dasselbe wie Sichtbarkeit, "
        "Lichtsonden, Volumen auszuschalten",
    "Left Out": "Ausgelassen",
    "Whether the object is left out of bakes": "Ob das Objekt beim Backen ausgelassen wird",
    "As if the file did not have it: neither in bakes nor in RTGI's pictures and exports":
        "Als hätte die Datei es nicht: weder im Gebackenen noch in Bildern und Exporten von RTGI",
    "What of this lamp's light is in bakes of RTGI": "Was vom Licht dieser Lampe beim Backen von RTGI dabei ist",
    "All": "Alles",
    "Its direct light and all that surfaces reflect of it, for a lamp that the engine need not have":
        "Ihr direktes Licht und alles, was Flächen davon reflektieren: für eine Lampe, die die Engine nicht zu haben braucht",
    "What surfaces reflect of it; the engine adds its direct light":
        "Was Flächen davon reflektieren; die Engine fügt ihr direktes Licht hinzu",
    "Nothing: for a lamp that is switched or moves in the game":
        "Nichts: für eine Lampe, die im Spiel geschaltet wird oder sich bewegt",
    "Select an object or a lamp": "Ein Objekt oder eine Lampe auswählen",
    "Dynamic: {0}": "Dynamisch: {0}",
    "Left out: {0}": "Ausgelassen: {0}",
    "Lamps in bakes as a whole: {0}": "Ganz gebackene Lampen: {0}",
    "Lamps that no bake knows: {0}": "Lampen, die kein Backen kennt: {0}",
}
