"""The stylized effect in German: its settings, choices and presets, by their English."""

STYLES: dict[str, str] = {
    "Stylized": "Stilisiert",
    "Bands, ink and lines in place of smooth light": "Stufen, Tusche und Linien anstelle weichen Lichts",
    "Highlights and Rim": "Glanzlichter und Saum",
    "Ink and Paper": "Tusche und Papier",
    "Grading": "Farbabstimmung",
    "Style Strength": "Stilstärke",
    "How much of the styled picture is shown over the lit one": "Wie viel vom stilisierten Bild über dem beleuchteten zu sehen ist",
    "Shading": "Schattierung",
    "What light becomes: as it is, bands, a ramp's colours, or a plain sheet of paper":
        "Was aus Licht wird: was es ist, Stufen, die Farben eines Verlaufs oder ein Bogen Papier",
    "As lit": "Wie beleuchtet",
    "Bands": "Stufen",
    "Paper": "Papier",
    "Treads from dark to the key light; each stands for the middle of its band":
        "Stufen vom Dunkel bis zum Führungslicht; jede steht für die Mitte ihres Bereichs",
    "Bands per Channel": "Stufen je Kanal",
    "Step red, green and blue apart in place of brightness alone": "Rot, Grün und Blau einzeln abstufen statt nur die Helligkeit",
    "Band Softness": "Weichheit der Stufen",
    "How wide a step from band to band is": "Wie breit der Übergang von Stufe zu Stufe ist",
    "Key Light": "Führungslicht",
    "Irradiance that counts as full light; at π a white surface is just white":
        "Bestrahlungsstärke, die als volles Licht gilt; bei π ist eine weiße Fläche gerade weiß",
    "Ramp": "Verlauf",
    "Stops of the ramp, as 0:0.1,0.1,0.3 0.5:0.6,0.5,0.5 1:1,1,1 with the word constant before them for hard steps; empty is grey "
    "from black to white":
        "Marken des Verlaufs, wie 0:0.1,0.1,0.3 0.5:0.6,0.5,0.5 1:1,1,1, davor das Wort constant für harte Stufen; leer ist Grau "
        "von Schwarz bis Weiß",
    "Tint by Light": "Tönung durch Licht",
    "How much the colour of the light tints the ramp": "Wie sehr die Farbe des Lichts den Verlauf tönt",
    "Shadow Color": "Schattenfarbe",
    "What dark bands turn towards": "Wohin sich dunkle Stufen wenden",
    "Shadow Amount": "Schattenanteil",
    "How far dark bands turn towards the shadow color": "Wie weit sich dunkle Stufen der Schattenfarbe zuwenden",
    "Color Bleeding": "Farbübertragung",
    "Saturation of indirect light; 1 is as it is": "Sättigung des indirekten Lichts; 1 lässt es, wie es ist",
    "Highlights": "Glanzlichter",
    "What the shine of lamps becomes": "Was aus dem Glanz von Lampen wird",
    "Band": "Stufe",
    "Highlight Threshold": "Glanzschwelle",
    "Radiance from which on a shine is a highlight": "Strahldichte, ab der Glanz ein Glanzlicht ist",
    "Highlight Softness": "Glanzweichheit",
    "How wide a highlight's edge is, as a share of the threshold":
        "Wie breit der Rand eines Glanzlichts ist, als Anteil der Schwelle",
    "Highlight Brightness": "Glanzhelligkeit",
    "Radiance that a highlight has": "Strahldichte eines Glanzlichts",
    "Highlight Ramp": "Glanzverlauf",
    "Stops of the ramp that a shine up to the threshold goes through, as those of the other ramp":
        "Marken des Verlaufs, den Glanz bis zur Schwelle durchläuft, wie die des anderen Verlaufs",
    "Rim Strength": "Saumstärke",
    "Radiance of the rim light": "Strahldichte des Saumlichts",
    "Rim Width": "Saumbreite",
    "Cosine to the eye at which the rim begins: on a ball the square of it is the rim's share":
        "Kosinus zum Auge, bei dem der Saum beginnt: auf einer Kugel ist sein Quadrat der Anteil des Saums",
    "Rim Softness": "Saumweichheit",
    "How wide the edge of the rim is, in that cosine": "Wie breit der Rand des Saums ist, in diesem Kosinus",
    "Rim Color": "Saumfarbe",
    "Colour of the rim light": "Farbe des Saumlichts",
    "Rim by Light": "Saum nach Licht",
    "How much the rim shows only on the side where lamps shine": "Wie sehr sich der Saum nur auf der Seite der Lampen zeigt",
    "Pattern": "Muster",
    "What darkness is drawn with: nothing, dots, or strokes that cross where it is dark; anchored to objects":
        "Womit Dunkelheit gezeichnet wird: nichts, Punkte oder Striche, die sich im Dunkeln kreuzen; an Objekten verankert",
    "Stipple": "Punkte",
    "Hatching": "Schraffur",
    "Pattern Spacing": "Musterabstand",
    "Distance of dots or strokes, to a factor of two": "Abstand von Punkten oder Strichen, auf den Faktor zwei",
    "Pattern Tone": "Musterton",
    "Light as a share of the key light from which on there is no ink":
        "Licht als Anteil des Führungslichts, ab dem keine Tusche mehr ist",
    "Pattern Strength": "Musterstärke",
    "How much of the pattern shows": "Wie viel vom Muster zu sehen ist",
    "Ink Color": "Tuschfarbe",
    "Colour of dots and strokes": "Farbe der Punkte und Striche",
    "Paper Color": "Papierfarbe",
    "What the shading Paper shows, and the background if it is paper":
        "Was die Schattierung Papier zeigt, und der Hintergrund, wenn er Papier ist",
    "Paper Background": "Hintergrund aus Papier",
    "Show paper where nothing is seen, in place of the world": "Papier zeigen, wo nichts zu sehen ist, statt der Welt",
    "Contrast": "Kontrast",
    "Contrast of the picture about middle grey": "Kontrast des Bildes um mittleres Grau",
    "Saturation": "Sättigung",
    "Saturation of the picture": "Sättigung des Bildes",
    "Tint": "Tönung",
    "Colour that the picture is multiplied by": "Farbe, mit der das Bild multipliziert wird",
    "Lines": "Linien",
    "Draw lines over the picture": "Linien über das Bild zeichnen",
    "Depth Lines": "Tiefenlinien",
    "Where something stands in front: by the distance from the other pixel's plane, by the second difference of 1/depth, or by the "
    "depth's own gradient":
        "Wo etwas davor steht: nach dem Abstand von der Ebene des anderen Pixels, nach der zweiten Differenz von 1/Tiefe oder nach "
        "dem Gradienten der Tiefe selbst",
    "Plane": "Ebene",
    "Inverse depth": "Kehrwert der Tiefe",
    "Gradient": "Gradient",
    "Depth Threshold": "Tiefenschwelle",
    "Step that makes a line, in pixels at that distance": "Sprung, der eine Linie macht, in Pixeln in dieser Entfernung",
    "Crease Lines": "Knicklinien",
    "Where surfaces turn: by the angle between normals, or by the largest change of a component":
        "Wo sich Flächen wenden: nach dem Winkel zwischen Normalen oder der größten Änderung einer Komponente",
    "Angle": "Winkel",
    "Components": "Komponenten",
    "Crease Angle": "Knickwinkel",
    "Normals that differ by more make a line": "Normalen, die sich um mehr unterscheiden, machen eine Linie",
    "Normal Threshold": "Normalenschwelle",
    "Change of a normal's component that makes a line, if lines go by components":
        "Änderung einer Komponente der Normale, die eine Linie macht, wenn es nach Komponenten geht",
    "Object Borders": "Objektgrenzen",
    "Lines where one object ends and another begins": "Linien, wo ein Objekt endet und ein anderes beginnt",
    "Material Borders": "Materialgrenzen",
    "Lines where one material ends and another begins": "Linien, wo ein Material endet und ein anderes beginnt",
    "Curvature Lines": "Krümmungslinien",
    "Lines along what bulges, what is hollow, or both": "Linien entlang dem, was sich wölbt, was hohl ist, oder beidem",
    "Ridges": "Grate",
    "Valleys": "Täler",
    "Both": "Beides",
    "Curvature Threshold": "Krümmungsschwelle",
    "Turn of the normal over a pixel that makes a line": "Wendung der Normale über ein Pixel, die eine Linie macht",
    "Marked Edges": "Markierte Kanten",
    "Lines along edges marked for Freestyle": "Linien entlang von Kanten, die für Freestyle markiert sind",
    "Line Width": "Linienbreite",
    "Width of a line": "Breite einer Linie",
    "World Width": "Breite in der Welt",
    "Width of a line in the world, in place of pixels": "Breite einer Linie in der Welt, anstelle von Pixeln",
    "Thinning Distance": "Verjüngungsabstand",
    "Lines that are further away are thinner in proportion; unset keeps their width":
        "Linien, die weiter weg sind, sind im Verhältnis dünner; ohne Angabe bleibt ihre Breite",
    "Least Width": "Mindestbreite",
    "Width that no line falls below, however far away": "Breite, unter die keine Linie fällt, wie weit weg sie auch ist",
    "Line Color": "Linienfarbe",
    "Colour of lines": "Farbe der Linien",
    "Color by Material": "Farbe nach Material",
    "Take the colour and opacity of lines from each material's Line Art settings":
        "Farbe und Deckkraft der Linien aus den Line-Art-Einstellungen jedes Materials nehmen",
    "Line Opacity": "Liniendeckkraft",
    "How much lines cover": "Wie viel Linien verdecken",
    "Exclude Pass Index": "Pass-Index ausschließen",
    "Objects and materials with this pass index have no lines of their own; 0 excludes none":
        "Objekte und Materialien mit diesem Pass-Index haben keine eigenen Linien; 0 schließt nichts aus",
    "Exclude Collection": "Sammlung ausschließen",
    "Objects of this collection have no lines of their own": "Objekte dieser Sammlung haben keine eigenen Linien",

    # The panel's tools.
    "Style": "Stil",
    "Write the effect Stylized as it is set up, if it is on and the engine takes styles":
        "Den Effekt Stilisiert schreiben, wie er eingestellt ist, wenn er an ist und die Engine Stile nimmt",
    "RTGI Styles": "RTGI-Stile",
    "Apply RTGI Style": "RTGI-Stil anwenden",
    "Draw in this style": "In diesem Stil zeichnen",
    "The style's preset": "Die Vorgabe des Stils",
    "Add RTGI Style": "RTGI-Stil hinzufügen",
    "Keep the settings of the effect as a style, or remove one":
        "Die Einstellungen des Effekts als Stil behalten oder einen entfernen",
    "Edit Ramp": "Verlauf bearbeiten",
    "Edit the ramp as Blender's color ramp, or as response curves, in place of a line of text":
        "Den Verlauf als Blenders Farbverlauf oder als Antwortkurven bearbeiten statt als Textzeile",
    "Response curves of red, green and blue in place of the color ramp":
        "Antwortkurven für Rot, Grün und Blau statt des Farbverlaufs",
}

STYLE_SENTENCES: dict[str, str] = {
    "{0} takes no style": "{0} nimmt keinen Stil",
    "export to {0}, or leave it out": "nach {0} exportieren oder ihn weglassen",
    "Godot's style (rtgi/style.tscn, Forward+) goes without {0}": "Godots Stil (rtgi/style.tscn, Forward+) kommt ohne {0} aus",
    "three.js's style (rtgi/RTGIStyle.js, WebGLRenderer) goes without {0}":
        "Der Stil für three.js (rtgi/RTGIStyle.js, WebGLRenderer) kommt ohne {0} aus",
    "unknown style {0}": "unbekannter Stil {0}",
    "{0} is no stop of a ramp": "{0} ist keine Marke eines Verlaufs",
    "write position:red,green,blue with a position from 0 to 1": "Position:Rot,Grün,Blau mit einer Position von 0 bis 1 schreiben",
}
