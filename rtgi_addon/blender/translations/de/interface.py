"""Labels, tooltips and lines of the panels in German, by their English."""

INTERFACE: dict[str, str] = {
    # What labels and tooltips of settings are put together from.
    "{0} to {1}": "{0} bis {1}",
    "at least {0}": "mindestens {0}",
    "in {0}": "in {0}",
    "Override {0}": "{0} überschreiben",
    "Use another value of {0} for this volume than the scene's": "Für dieses Volumen einen anderen Wert von „{0}“ als den der "
    "Szene "
                                                                 "verwenden",
    "Use {0}": "{0} verwenden",

    # Panels and their lines.
    "RTGI": "RTGI",
    "Output": "Ausgabe",
    "Folder": "Ordner",
    "RTGI Overrides": "RTGI-Abweichungen",
    "Light Probes": "Lichtsonden",
    "Last Bake": "Letztes Backen",
    "Checks": "Prüfungen",
    "RTGI Presets": "RTGI-Voreinstellungen",
    "Techniques Compared": "Techniken im Vergleich",
    "Leaks": "Lichtlecks",
    "Stability": "Stabilität",
    "Preview": "Vorschau",
    "Shadow Maps": "Schattenkarten",
    "Effects": "Effekte",
    "Ray-Traced Light": "Licht durch Strahlen",
    "Indirect and mirrored light by rays from every pixel: exact, not fast":
        "Indirektes und gespiegeltes Licht durch Strahlen von jedem Pixel aus: genau, nicht schnell",
    "Media": "Medien",
    "Media Presets": "Medien-Voreinstellungen",
    "The preset": "Die Voreinstellung",
    "Show media as this preset says": "Medien so zeigen, wie diese Voreinstellung sagt",
    "Apply Media Preset": "Medien-Voreinstellung anwenden",
    "Keep how media are shown as a preset, or remove one":
        "Wie Medien gezeigt werden als Voreinstellung behalten oder eine entfernen",
    "Add Media Preset": "Medien-Voreinstellung hinzufügen",
    "To move about in: columns of 16 pixels in 32 slices": "Zum Umsehen: Säulen von 16 Pixeln in 32 Scheiben",
    "To judge a picture: columns of 8 pixels in 64 slices": "Um ein Bild zu beurteilen: Säulen von 8 Pixeln in 64 Scheiben",
    "For small smoke and sharp shafts: columns of 3 pixels in 96 slices, ten times the work":
        "Für kleinen Rauch und scharfe Lichtbahnen: Säulen von 3 Pixeln in 96 Scheiben, die zehnfache Arbeit",
    "Find Media": "Medien suchen",
    "No fog, smoke or fire was found": "Kein Nebel, Rauch oder Feuer gefunden",
    "and {count} more": "und {count} weitere",
    "{name}: glows, and takes no light": "{name}: leuchtet und nimmt kein Licht",
    "{name}: mean free path from {path} m, albedo {albedo}, g {g}":
        "{name}: mittlere freie Weglänge ab {path} m, Albedo {albedo}, g {g}",
    "{name}: mean free path {path} m, albedo {albedo}, g {g}":
        "{name}: mittlere freie Weglänge {path} m, Albedo {albedo}, g {g}",
    ", glows": ", leuchtet",
    "What fog, smoke and fire take, scatter and give between the eye and surfaces":
        "Was Nebel, Rauch und Feuer zwischen Auge und Flächen nehmen, streuen und geben",
    "Mist": "Nebel",
    "What is further away fades into the world or a colour": "Was weiter weg ist, verschwindet in der Welt oder in einer Farbe",
    "Compare": "Vergleichen",
    "Film": "Film",
    "Passes": "Durchgänge",
    "Data": "Daten",
    "Light": "Licht",
    "Show": "Anzeigen",
    "Resolution": "Auflösung",
    "Albedo": "Albedo",
    "Transparent": "Transparent",
    "Viewport Samples": "Abtastwerte im Ansichtsfenster",
    "Split the Viewport": "Ansichtsfenster teilen",
    "Starting": "Beginnt",
    "Cancelling…": "Bricht ab …",
    "{share}%  ·  {time} left": "{share} %  ·  noch {time}",
    "{time} left": "noch {time}",
    "RTGI: cancelling…": "RTGI: bricht ab …",
    "RTGI: {progress}  |  Esc to cancel": "RTGI: {progress}  |  Esc bricht ab",
    "No Light Probe Volume: one will be fitted to the scene": "Kein Lichtsondenvolumen: der Szene wird eines angepasst",
    "{probes:,} probes in 1 volume": "{probes:,} Sonden in 1 Volumen",
    "{probes:,} probes in {volumes} volumes": "{probes:,} Sonden in {volumes} Volumen",
    "Nothing baked yet": "Noch nichts gebacken",
    "The scene or its settings have changed since": "Die Szene oder ihre Einstellungen haben sich seither geändert",
    "Probes": "Sonden",
    "Usable": "Brauchbar",
    "Error on Surfaces": "Fehler auf Flächen",
    "Noise at Probes": "Rauschen an Sonden",
    "unknown": "unbekannt",
    "Time": "Zeit",
    "Nothing to report": "Nichts zu melden",
    "Setting": "Einstellung",
    "Error": "Fehler",
    "Cancelled before the end": "Vor dem Ende abgebrochen",
    "At the 3D cursor: {error}": "Am 3D-Cursor: {error}",
    "Found in an earlier bake": "In einem früheren Backvorgang gefunden",
    "Show on Surfaces": "Auf Flächen zeigen",
    "Test This Scene": "Diese Szene prüfen",
    "This Scene, All Techniques": "Diese Szene, alle Techniken",
    "Sample {sample} of {samples}": "Abtastwert {sample} von {samples}",
    "Relighting": "Beleuchtet neu",
    "Right of the line: {note}": "Rechts der Linie: {note}",
    "The bake is out of date": "Das Gebackene ist veraltet",

    # Operators: labels, tooltips, what they report and why they are greyed out.
    "Bake Probes": "Sonden backen",
    "Bake the light of this scene into its Light Probe Volumes": "Das Licht dieser Szene in ihre Lichtsondenvolumen backen",
    "Select What a Line Is About": "Auswählen, wovon eine Zeile handelt",
    "Select the objects that this line is about": "Wählt die Objekte aus, von denen diese Zeile handelt",
    "Objects": "Objekte",
    "Names of objects, one a line": "Namen von Objekten, einer je Zeile",
    "Materials": "Materialien",
    "Names of materials, one a line: whatever carries one of them is selected":
        "Namen von Materialien, einer je Zeile: ausgewählt wird, was eines davon trägt",
    "Nothing of that name can be selected in this view layer": "Nichts dieses Namens ist in diesem View Layer auswählbar",
    "Verify with Cycles": "Mit Cycles prüfen",
    "Compare what is read of this scene, and its bake, with Cycles at a few places, and find what makes a difference":
        "Vergleicht, was von dieser Szene gelesen wird, und ihr Gebackenes an wenigen Stellen mit Cycles und sucht, was einen "
        "Unterschied macht",
    "Stop the verification": "Beendet die Prüfung",
    "Cancel Verification": "Prüfung abbrechen",
    "Against Cycles": "Gegen Cycles",
    "A verification or a bake is already running": "Es wird schon geprüft oder gebacken",
    "Verification cancelled": "Prüfung abgebrochen",
    "Without {name}: {difference}": "Ohne {name}: {difference}",
    "the world": "die Welt",
    "A bake is already running": "Es wird schon gebacken",
    "Bake cancelled; the last one is as it was": "Backen abgebrochen; das letzte Ergebnis ist, wie es war",
    "Baked {probes:,} probes in {time}, light on surfaces off by {error:.2g}%":
        "{probes:,} Sonden in {time} gebacken, Licht auf Flächen um {error:.2g} % falsch",
    "Baked {probes:,} probes in {time}": "{probes:,} Sonden in {time} gebacken",
    "Cancel Bake": "Backen abbrechen",
    "Stop the bake. What was baked before stays as it is": "Das Backen anhalten. Was vorher gebacken war, bleibt, wie es ist",
    "Check Scene": "Szene prüfen",
    "Read the scene as a bake would and list what would spoil it, and what of it is not followed":
        "Die Szene wie zum Backen lesen und auflisten, was es verderben würde und wem darin nicht gefolgt wird",
    "1 thing to look at": "1 Auffälligkeit",
    "{count} things to look at": "{count} Auffälligkeiten",
    "Nothing stands in the way of a bake": "Dem Backen steht nichts im Weg",
    "Open Bake Folder": "Ordner öffnen",
    "Show the folder of the last bake in the system's file browser":
        "Den Ordner des letzten Backens in der Dateiverwaltung des Systems zeigen",
    "{folder} is no longer there: bake again": "{folder} ist nicht mehr da: neu backen",
    "Apply RTGI Preset": "RTGI-Voreinstellung anwenden",
    "Bake with the settings of this preset": "Mit den Einstellungen dieser Voreinstellung backen",
    "Add RTGI Preset": "RTGI-Voreinstellung hinzufügen",
    "Keep the technique and its settings as a preset, or remove one":
        "Die Technik und ihre Einstellungen als Voreinstellung behalten oder eine entfernen",
    "Draft": "Entwurf",
    "Final": "Endgültig",
    "To see where light goes: probes with 10% error (0.2 s of processor time for the 64 of the Cornell box)":
        "Um zu sehen, wohin Licht geht: Sonden mit 10 % Fehler (0,2 s Prozessorzeit für die 64 der Cornell-Box)",
    "To judge a picture: probes with 3% error (0.3 s of processor time for the 64 of the Cornell box)":
        "Um ein Bild zu beurteilen: Sonden mit 3 % Fehler (0,3 s Prozessorzeit für die 64 der Cornell-Box)",
    "To ship: probes with 1% error (0.8 s of processor time for the 64 of the Cornell box)":
        "Zum Ausliefern: Sonden mit 1 % Fehler (0,8 s Prozessorzeit für die 64 der Cornell-Box)",
    "Chart Techniques": "Techniken vergleichen",
    "Bake this scene with every technique at several settings and chart their errors against time, rays and memory":
        "Diese Szene mit jeder Technik in mehreren Einstellungen backen und ihre Fehler über Zeit, Strahlen und Speicher auftragen",
    "Seeds": "Startwerte",
    "Bakes of each setting, from which intervals follow":
        "Wie oft jede Einstellung gebacken wird; daraus folgen Vertrauensbereiche",
    "Surface Points": "Punkte auf Flächen",
    "Points on surfaces where errors are measured": "Punkte auf Flächen, an denen Fehler gemessen werden",
    "Reference Noise": "Rauschen der Referenz",
    "Relative noise at which the reference stops": "Relatives Rauschen, bei dem die Referenz aufhört",
    "Error Maps": "Fehlerkarten",
    "Also draw where in the scene each technique is wrong": "Auch zeichnen, wo in der Szene jede Technik irrt",
    "Pictures of Effects": "Bilder mit Effekten",
    "Also hold pictures with effects to Cycles', through the scene's camera; Blender waits while it renders":
        "Auch Bilder mit Effekten durch die Kamera der Szene mit denen von Cycles vergleichen; Blender wartet, solange es rendert",
    "Error of the Picture": "Fehler des Bildes",
    "Error in the Light Atlas": "Fehler im Lichtatlas",
    "Reference": "Referenz",
    "What is held to be right": "Was als richtig gilt",
    "Path Tracer": "Pfadverfolgung",
    "This add-on's own path tracer": "Die eigene Pfadverfolgung dieses Add-ons",
    "Cycles": "Cycles",
    "Cycles, on the CPU; Blender waits while it renders": "Cycles auf der CPU; Blender wartet, solange es rendert",
    "A chart or a bake is already running": "Es wird schon gemessen oder gebacken",
    "Chart cancelled": "Vergleich abgebrochen",
    "Charted {count} settings into {folder}": "{count} Einstellungen verglichen, Ergebnis in {folder}",
    "Cancel Chart": "Vergleich abbrechen",
    "Stop measuring. What was measured is kept": "Das Messen anhalten. Was gemessen ist, bleibt erhalten",
    "Find Leaks": "Lichtlecks suchen",
    "Compare the last bake of this session with the path reference on the scene's surfaces, and say why it is off where it is":
        "Das zuletzt in dieser Sitzung Gebackene auf den Flächen der Szene mit der Pfadverfolgung vergleichen und sagen, warum es "
        "abweicht, wo es abweicht",
    "Points": "Punkte",
    "How many points of surfaces are looked at": "Wie viele Punkte auf Flächen betrachtet werden",
    "A bake or a search is already running": "Es wird schon gebacken oder gesucht",
    "Bake with this technique first: a bake from disk has no scene to compare with":
        "Erst mit dieser Technik backen: zu Gebackenem von der Platte gibt es keine Szene zum Vergleichen",
    "Cancel Search": "Suche abbrechen",
    "Stop searching. What was found before is kept": "Die Suche anhalten. Vorher Gefundenes bleibt erhalten",
    "Search cancelled; what was found before is kept": "Suche abgebrochen; vorher Gefundenes bleibt erhalten",
    "Test Stability": "Stabilität prüfen",
    "Bake this scene with its volumes and lamps moved, or built-in ones in which methods are known to fail, and report what "
    "changed "
    "that should not have":
        "Diese Szene mit verschobenen Volumen und Lampen backen, oder eingebaute, an denen Verfahren bekanntermaßen scheitern, und "
        "melden, was sich geändert hat und es nicht sollte",
    "Which technique is tested": "Welche Technik geprüft wird",
    "Case": "Fall",
    "Only the case of this name; all if empty": "Nur der Fall dieses Namens; alle, wenn leer",
    "This Scene": "Diese Szene",
    "Test this scene instead of the built-in ones": "Diese Szene statt der eingebauten prüfen",
    "A bake or a measurement is already running": "Es wird schon gebacken oder gemessen",
    "Cancel Test": "Prüfung abbrechen",
    "Stop testing. What was measured is kept": "Die Prüfung anhalten. Was gemessen ist, bleibt erhalten",
    "Stability test cancelled": "Prüfung abgebrochen",
    "Continue": "Fortsetzen",
    "Go on from what a cancelled run has measured": "Dort weitermachen, wo ein abgebrochener Lauf aufhörte",
    "{case} of {technique}": "{case} von {technique}",
    "{count} figures hold. See the text {text!r} and {folder}": "{count} Werte halten. Siehe den Text {text!r} und {folder}",
    "{failed} of {count} figures are above their goals: {listed}. The text {text!r} says what helps":
        "{failed} von {count} Werten liegen über ihren Zielen: {listed}. Der Text {text!r} sagt, was hilft",
    "Worse than their bounds: {listed}. See the text {text!r}": "Schlechter als ihre Schranken: {listed}. Siehe den Text {text!r}",
    "The render failed with {kind}: {error} (details in the console)":
        "Das Rendern schlug mit {kind} fehl: {error} (Einzelheiten in der Konsole)",

    # Export.
    "Export": "Export",
    "Godot 4.6": "Godot 4.6",
    "3D textures, shader include, GDScript loader, LightmapGIData and a sample project":
        "3D-Texturen, Shader-Include, GDScript-Lader, LightmapGIData und ein Beispielprojekt",
    "three.js": "three.js",
    "Probe volumes for WebGL and WebGPU: loader, materials, light probe, demo":
        "Sondenvolumen für WebGL und WebGPU: Lader, Materialien, Lichtsonde, Beispielseite",
    "Export to Engine": "In Engine exportieren",
    "Write the last bake as textures, shaders and a sample scene of an engine":
        "Das zuletzt Gebackene als Texturen, Shader und Beispielszene einer Engine schreiben",
    "Engine": "Engine",
    "For which engine the probes are written": "Für welche Engine die Sonden geschrieben werden",
    "Part": "Teil",
    "How much of the export is written": "Wie viel des Exports geschrieben wird",
    "Sample Project": "Beispielprojekt",
    "A project that runs as it is, with the probes in it": "Ein Projekt mit den Sonden darin, das läuft, wie es ist",
    "Probes Only": "Nur Sonden",
    "The folder with the probes and what reads them, into a project of your own":
        "Der Ordner mit den Sonden und dem, was sie liest, in ein eigenes Projekt",
    "Where the export goes; files of an earlier export there are replaced, unless somebody changed them":
        "Wohin der Export geht; Dateien eines früheren dort werden ersetzt, außer wenn jemand sie geändert hat",
    "{name} was changed since the last export and stays as it is":
        "{name} wurde seit dem letzten Export geändert und bleibt, wie es ist",
    "{count} files for {engine} in {folder}": "{count} Dateien für {engine} in {folder}",
    "Model": "Modell",
    "Write what renders of this scene as glTF into the sample scene, lit by the probes":
        "Was von dieser Szene gerendert wird, als glTF in die Beispielszene schreiben, von den Sonden beleuchtet",
    "A bake or an export is already running": "Es wird schon gebacken oder exportiert",
    "Cancel Export": "Export abbrechen",
    "Stop writing. An earlier export stays as it is": "Das Schreiben anhalten. Ein früherer Export bleibt, wie er ist",
    "Export cancelled; an earlier one is as it was": "Export abgebrochen; ein früherer ist, wie er war",
    "{count} files for {engine} in {folder}; README.md there says how to use them":
        "{count} Dateien für {engine} in {folder}; README.md dort sagt, wie man sie benutzt",

    # Plan.
    "Plan": "Plan",
    "Plan Bake": "Backen planen",
    "Measure which technique, lattices, order and rays light the surfaces of this scene well enough for the least time":
        "Messen, mit welcher Technik, welchen Gittern, welcher Ordnung und wie vielen Strahlen die Flächen dieser Szene am "
        "schnellsten "
        "gut genug beleuchtet sind",
    "Cancel Plan": "Planen abbrechen",
    "Stop planning. An earlier plan is kept": "Das Planen anhalten. Ein früherer Plan bleibt erhalten",
    "Apply Plan": "Plan anwenden",
    "Write the plan to this scene: technique, settings, resolutions and left out probes of its volumes, and those within others":
        "Den Plan in diese Szene schreiben: Technik, Einstellungen, Auflösungen und ausgelassene Sonden seiner Volumen, und solche "
        "in anderen",
    "Error at Surfaces": "Fehler auf Flächen",
    "Relative error of the light on surfaces that is aimed at": "Angestrebter relativer Fehler des Lichts auf Flächen",
    "Keep Air": "Luft behalten",
    "Also bake probes that no surface reads, for things that move through the air":
        "Auch Sonden backen, die keine Fläche liest, für Dinge, die sich durch die Luft bewegen",
    "Memory": "Speicher",
    "MiB that the bake may take; 0 for any": "MiB, die das Backen nehmen darf; 0 für beliebig viele",
    "Compare Techniques": "Techniken vergleichen",
    "Also measure what the other techniques would do": "Auch messen, was die anderen Techniken leisten würden",
    "Planned: {error} at surfaces with {probes:,} probes": "Geplant: {error} auf Flächen mit {probes:,} Sonden",
    "Out of reach; the best there is: {error} at surfaces with {probes:,} probes":
        "Unerreichbar; das Beste ist {error} auf Flächen mit {probes:,} Sonden",
    "Applied: {lattices} probes": "Angewendet: {lattices} Sonden",
    "Error below": "Fehler unter",
    "A plan or a bake is already running": "Es wird schon geplant oder gebacken",
    "Plan cancelled": "Planen abgebrochen",

    # Scene: what and how to bake.
    "Technique": "Technik",
    "How indirect light is computed": "Wie indirektes Licht berechnet wird",
    "Irradiance Probes": "Bestrahlungsstärke-Sonden",
    "Spherical harmonics of incident light on a lattice, the form that engines read":
        "Kugelflächenfunktionen des einfallenden Lichts auf einem Gitter, die Form, die Engines lesen",
    "Virtual Point Lights": "Virtuelle Punktlichter",
    "Instant radiosity: bounced light from virtual lights that can follow a moving lamp":
        "Instant Radiosity: reflektiertes Licht von virtuellen Lichtern, die einer bewegten Lampe folgen können",
    "Reflective Shadow Maps": "Reflektierende Schattenkarten",
    "One bounce of the lamps, gathered from what each of them lights first; without occlusion, as in the paper":
        "Eine Reflexion der Lampen, gesammelt von dem, was jede zuerst beleuchtet; ohne Verdeckung, wie im Artikel",
    "Light Propagation Volumes": "Lichtausbreitungsvolumen",
    "Light flows from cell to cell of a lattice: fast, smooth, leaks and spreads":
        "Licht fließt von Zelle zu Zelle eines Gitters: schnell und weich, aber es leckt und zerfließt",
    "Seed": "Startwert",
    "Start of the random numbers. The same seed gives the same bytes":
        "Anfang der Zufallszahlen. Derselbe Startwert ergibt dieselben Bytes",
    "Device": "Gerät",
    "Where the inner loops of the bake run": "Wo die inneren Schleifen des Backens laufen",
    "CPU": "CPU",
    "Every core of the processor": "Jeder Kern des Prozessors",
    "GPU": "GPU",
    "The graphics card that Blender draws with; the window waits for it":
        "Die Grafikkarte, mit der Blender zeichnet; das Fenster wartet auf sie",
    "Stop At": "Ende bei",
    "What ends the tracing of a probe": "Was die Strahlverfolgung einer Sonde beendet",
    "Trace each probe until its estimated error is small enough":
        "Jede Sonde verfolgen, bis ihr geschätzter Fehler klein genug ist",
    "Rays": "Strahlen",
    "Trace the same number of rays for every probe": "Für jede Sonde gleich viele Strahlen verfolgen",
    "Folder the bake is written to. An earlier bake in it is replaced once the new one is whole":
        "Ordner, in den gebacken wird. Früher Gebackenes darin wird ersetzt, sobald das neue vollständig ist",
    "Where the last bake lies": "Wo das zuletzt Gebackene liegt",
    "The technique that made the last bake": "Die Technik, mit der zuletzt gebacken wurde",
    "How many probes the last bake has, over all volumes": "Wie viele Sonden das zuletzt Gebackene in allen Volumen hat",
    "Share of probes that lie in the open; the others take their light from neighbours":
        "Anteil der Sonden, die frei liegen; die anderen nehmen ihr Licht von Nachbarn",
    "Estimated relative error of what probes measured against infinitely many rays; negative if unknown":
        "Geschätzter relativer Fehler dessen, was Sonden gemessen haben, gegen unendlich viele Strahlen; negativ, wenn unbekannt",
    "Relative error of the light that surfaces read from probes, at a few points; negative if unknown":
        "Relativer Fehler des Lichts, das Flächen aus Sonden lesen, an einigen Punkten; negativ, wenn unbekannt",
    "Error on Surfaces at Least": "Fehler auf Flächen mindestens",
    "Lower end of the 95% interval of the error on surfaces; negative if unknown":
        "Unteres Ende des 95-%-Intervalls des Fehlers auf Flächen; negativ, wenn unbekannt",
    "Error on Surfaces at Most": "Fehler auf Flächen höchstens",
    "Upper end of the 95% interval of the error on surfaces; negative if unknown":
        "Oberes Ende des 95-%-Intervalls des Fehlers auf Flächen; negativ, wenn unbekannt",
    "Seconds": "Sekunden",
    "How long the last bake took": "Wie lange das letzte Backen gedauert hat",

    # Preview.
    "Frames that are averaged until a still picture is done": "Bilder, die gemittelt werden, bis ein ruhendes Bild fertig ist",
    "Share of the region's width and height that is rendered": "Anteil von Breite und Höhe des Bereichs, der gerendert wird",
    "What the viewport shows": "Was das Ansichtsfenster zeigt",
    "Combined": "Kombiniert",
    "Direct": "Direkt",
    "Indirect": "Indirekt",
    "Irradiance": "Bestrahlungsstärke",
    "Volume direct": "Volumen direkt",
    "Volume indirect": "Volumen indirekt",
    "Volume Direct": "Volumen direkt",
    "Deliver the light of lamps that media scatter once, and what media give of their own":
        "Das Licht von Lampen ausgeben, das Medien einmal streuen, und was Medien selbst geben",
    "Volume Indirect": "Volumen indirekt",
    "Deliver the light that media scatter after it was scattered or reflected before":
        "Das Licht ausgeben, das Medien streuen, nachdem es schon einmal gestreut oder zurückgeworfen wurde",
    "Transmittance": "Durchlässigkeit",
    "Deliver the share of light that media leave between surfaces and the eye":
        "Den Anteil des Lichts ausgeben, den Medien zwischen Flächen und Auge übrig lassen",
    "Normal": "Normale",
    "Depth": "Tiefe",
    "Shadow Map": "Schattenkarte",
    "Texels along each side of a shadow map": "Texel entlang jeder Seite einer Schattenkarte",
    "Sun Cascades": "Kaskaden der Sonne",
    "Shadow maps a sun has, for near to far parts of the view":
        "Schattenkarten einer Sonne, für nahe bis ferne Teile der Ansicht",
    "Shadow Views": "Schattenansichten",
    "Shadow maps drawn a frame; where lamps need more, every frame has its share of them":
        "Schattenkarten, die je Bild gezeichnet werden; brauchen die Lampen mehr, bekommt jedes Bild seinen Teil davon",
    "Moving Points": "Bewegte Punkte",
    "Points of what has moved that every frame puts into voxels, of what the camera sees, until they are made anew; 0 for none":
        "Punkte von Bewegtem, das die Kamera sieht und jedes Bild in die Voxel einträgt, bis diese neu entstehen; 0 für keine",
    "Leave the world out of the picture; it still lights the scene":
        "Die Welt nicht im Bild zeigen; die Szene beleuchtet sie trotzdem",
    "Spheres where the probes are: in the light that they hold, those of sphere probes as mirrors, or coloured by whether they are "
    "usable (green), moved (orange) or inside geometry (red)":
        "Kugeln an den Orten der Sonden: in ihrem Licht, die von Kugelsonden als Spiegel, oder gefärbt danach, ob sie brauchbar "
        "(grün), verschoben (orange) oder in Geometrie (rot) sind",
    "None": "Keine",
    "Validity": "Gültigkeit",
    "Probe Size": "Sondengröße",
    "How large the spheres of probes are": "Wie groß die Kugeln der Sonden sind",
    "Volume Bounds": "Grenzen der Volumen",
    "The boxes of the probe volumes": "Die Quader der Sondenvolumen",
    "Colours on surfaces for how far the light is off there: red is too bright, blue is too dark; what was measured last with Find "
    "Leaks":
        "Farben auf Flächen dafür, wie weit das Licht dort abweicht: Rot ist zu hell, Blau zu dunkel; was „Lichtlecks suchen“ "
        "zuletzt "
        "gemessen hat",
    "Render": "Rendern",
    "Frames that are averaged for a render": "Bilder, die für ein gerendertes Bild gemittelt werden",
    "In Renders": "In gerenderten Bildern",
    "Draw the overlays over the combined pass of renders as well":
        "Die Überlagerungen auch über den kombinierten Durchgang gerenderter Bilder zeichnen",
    "Show another technique right of a line through the viewport":
        "Rechts einer Linie durch das Ansichtsfenster eine andere Technik zeigen",
    "Other Technique": "Andere Technik",
    "What is shown right of the line": "Was rechts der Linie gezeigt wird",
    "Split": "Teilung",
    "Where the line is, from the left edge of the viewport to the right":
        "Wo die Linie ist, vom linken Rand des Ansichtsfensters zum rechten",
    "Deliver the light of lamps and what surfaces emit": "Das Licht der Lampen liefern, und was Flächen ausstrahlen",
    "Deliver the indirect light that surfaces reflect": "Das indirekte Licht liefern, das Flächen reflektieren",
    "Deliver the indirect light that arrives at surfaces (in W/m²)":
        "Das indirekte Licht liefern, das bei Flächen ankommt (in W/m²)",
}
