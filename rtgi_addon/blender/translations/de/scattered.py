"""Scattered probes: their settings, their panel, and what stands in their way."""

SCATTERED_LABELS: dict[str, str] = {
    "Placement": "Platzierung",
    "Where probes stand": "Wo Sonden stehen",
    "Where probes stand: on the lattice of each volume, or scattered above its floors, no denser than that lattice, where "
    "light needs them":
        "Wo Sonden stehen: auf dem Gitter jedes Volumens oder verstreut über seinen Böden, nicht dichter als dieses Gitter, wo "
        "das Licht sie braucht",
    "Lattice": "Gitter",
    "Scattered": "Verstreut",
    "Thinning": "Ausdünnung",
    "Scattered probes are left out whose light their neighbours predict within this relative error":
        "Verstreute Sonden, deren Licht ihre Nachbarn bis auf diesen relativen Fehler vorhersagen, werden weggelassen",
    "Scattered probes are left out whose light their neighbours predict within this relative error (0.001 to 1)":
        "Verstreute Sonden, deren Licht ihre Nachbarn bis auf diesen relativen Fehler vorhersagen, werden weggelassen (0,001 "
        "bis 1)",
    "Probe Points": "Sondenpunkte",
    "Collection whose Empties are probes in any case, beside those that are placed":
        "Sammlung, deren Empties auf jeden Fall Sonden sind, neben denen, die platziert werden",
    "Add Where Needed": "Ergänzen, wo nötig",
    "Place probes where light needs them beside those of Probe Points; without, those are all there are":
        "Neben denen der Sondenpunkte Sonden platzieren, wo das Licht sie braucht; sonst gibt es nur diese",
    "Rays to Look": "Strahlen zum Umsehen",
    "Rays of each place that is looked at before probes are scattered":
        "Strahlen jeder Stelle, die angesehen wird, bevor Sonden verstreut werden",
    "Rays of each place that is looked at before probes are scattered (64 to 16,384)":
        "Strahlen jeder Stelle, die angesehen wird, bevor Sonden verstreut werden (64 bis 16.384)",
    "Show Scattered Probes": "Verstreute Sonden zeigen",
    "Show where scattered probes will stand, as Empties of the collection Scattered Probes, which can be moved and then "
    "baked":
        "Zeigen, wo verstreute Sonden stehen werden, als Empties der Sammlung Scattered Probes, die verschoben und gebacken "
        "werden können",
    "Cancel Placement": "Platzierung abbrechen",
    "Stop placing probes. What was shown before is kept": "Das Platzieren beenden. Was vorher gezeigt wurde, bleibt",
    "A bake or a placement is already running": "Es wird schon gebacken oder platziert",
    "{probes:,} scattered probes are shown": "{probes:,} verstreute Sonden werden gezeigt",
    "Placement cancelled; what was shown before is kept": "Platzierung abgebrochen; was vorher gezeigt wurde, bleibt",
}

SCATTERED: dict[str, str] = {
    "scattered probes are not fitted to surfaces": "verstreute Sonden werden nicht an Flächen angepasst",
    "leave out --fit (Fit to Surfaces), or --placement scattered":
        "--fit (An Flächen anpassen) oder --placement scattered weglassen",
    "volume {0} has more than {1} places for scattered probes": "das Volumen {0} hat mehr als {1} Stellen für verstreute Sonden",
    "lower its resolution, which says how dense they may stand, or split it into several volumes":
        "die Auflösung verringern, die sagt, wie dicht sie stehen dürfen, oder in mehrere Volumen teilen",
    "volume {0} takes {1} scattered probes, and words name {2}":
        "das Volumen {0} braucht {1} verstreute Sonden, und Wörter nennen {2}",
    "lower its resolution or raise the thinning (--set scatter.error=0.1)":
        "die Auflösung verringern oder stärker ausdünnen (--set scatter.error=0.1)",
    "volume {0} has no place for scattered probes: no floor lies below it, or all of it is inside geometry":
        "das Volumen {0} hat keine Stelle für verstreute Sonden: kein Boden liegt darunter, oder es liegt ganz im Inneren von "
        "Geometrie",
    "bake it on a lattice (--placement lattice), or put Empties of a collection of probes into it":
        "auf einem Gitter backen (--placement lattice) oder Empties einer Sammlung von Sonden hineinsetzen",
    "collection {0} has no Empties for probes": "die Sammlung {0} hat keine Empties für Sonden",
    "{0} scattered probes are too many to be shown as Empties ({1})":
        "{0} verstreute Sonden sind zu viele, um als Empties gezeigt zu werden ({1})",
    "bake them as they are, or lower the resolution of volumes":
        "sie backen, wie sie sind, oder die Auflösung von Volumen verringern",
    "the probes of {0} are scattered, which an export for {1} does not read":
        "die Sonden von {0} sind verstreut, was ein Export für {1} nicht liest",
    "bake them on a lattice (--placement lattice)": "sie auf einem Gitter backen (--placement lattice)",
    "{0} is damaged, it names probes that are not there": "{0} ist beschädigt, es nennt Sonden, die es nicht gibt",
    "thinning probes": "Sonden ausdünnen",
    "who sees whom": "wer wen sieht",
    "volume {0}: places of its probes are rounded by up to {1} cm, it is large: divide it into several":
        "Volumen {0}: die Stellen seiner Sonden sind um bis zu {1} cm gerundet, es ist groß: in mehrere teilen",
}
