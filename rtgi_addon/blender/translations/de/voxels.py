"""What is said about voxels, and the labels of the techniques that see a scene in them."""

VOXELS: dict[str, str] = {
    "the voxel grid has no extent": "das Voxelgitter hat keine Ausdehnung",
    "{0} places where lines meet triangles are more than a texture of this GPU holds":
        "{0} Stellen, an denen Linien Dreiecke treffen, sind mehr, als eine Textur dieser GPU hält",
    "the preview tells no more than {0} voxels that hold surfaces apart":
        "die Vorschau unterscheidet nicht mehr als {0} Voxel, in denen Flächen liegen",
    "lower the resolution": "eine kleinere Auflösung wählen",
    "place a probe volume around what is to be lit": "ein Sondenvolumen um das legen, was beleuchtet werden soll",
    "a voxel grid of {0} cells of {1} m is beyond {2} cells": "ein Voxelgitter von {0} Zellen zu {1} m ist größer als {2} Zellen",
    "raise the cell size or lower the resolution": "größere Voxel oder eine kleinere Auflösung wählen",
    "the voxel grid ({0}) holds no geometry": "das Voxelgitter ({0}) enthält keine Geometrie",
    "place the probe volumes where surfaces are": "die Sondenvolumen dorthin setzen, wo Flächen sind",
    "the voxel grid holds no geometry: nothing lies within {0} m of the probe volumes":
        "das Voxelgitter enthält keine Geometrie: im Umkreis von {0} m um die Sondenvolumen liegt nichts",
    "raise reach, or place the probe volumes where surfaces are":
        "die Reichweite erhöhen oder die Sondenvolumen dorthin setzen, wo Flächen sind",
    "a voxel of {0} m is larger than the thinnest wall ({1} m): light may get through; voxels of {2} m would hold two of them":
        "ein Voxel von {0} m ist größer als die dünnste Wand ({1} m): Licht kann hindurch; Voxel von {2} m passen zweimal hinein",
    "{0} takes what of {1} lies beyond the voxel grid for black":
        "{0} nimmt für schwarz, was von {1} außerhalb des Voxelgitters liegt",
    "{0} reflects the light of {1} on, beyond the bounces that it is limited to":
        "{0} reflektiert das Licht von {1} weiter, über die Reflexionen hinaus, auf die es begrenzt ist",
    "a voxel is brighter than half floats hold ({0} W/(sr m^2))":
        "ein Voxel ist heller, als halbe Fließkommazahlen fassen ({0} W/(sr m^2))",
    "the voxels hold values that are not finite": "die Voxel enthalten Werte, die nicht endlich sind",
    "{0} voxels that hold surfaces are more than an image takes": "{0} Voxel mit Flächen sind mehr, als ein Bild fasst",
    "{0} names other rows than there are": "{0} nennt andere Zeilen, als es gibt",
    "the voxel grid has {0} cells and {1} voxels that hold surfaces, more than textures of engines take":
        "das Voxelgitter hat {0} Zellen und {1} Voxel mit Flächen, mehr als Texturen von Engines fassen",
    "bake it with a lower resolution": "mit einer kleineren Auflösung backen",
    "cones is {0}": "Kegel ist {0}",
    "give 6, or at least {0}": "6 angeben, oder mindestens {0}",
    "gather is {0} and cascades is {1}": "Sammeln ist {0} und Kaskaden sind {1}",
    "gather from receivers, or use one grid": "an den Empfängern sammeln oder ein einziges Gitter nehmen",
    "cascades of {0} voxels leave nothing between their borders": "Kaskaden von {0} Voxeln lassen nichts zwischen ihren Rändern",
    "raise resolution until there are {0} along each side, or set cascades to 1":
        "die Auflösung erhöhen, bis es entlang jeder Seite {0} sind, oder Kaskaden auf 1 setzen",
    "the cascades of the voxel grid lie about the scene's camera, and it has none":
        "die Kaskaden des Voxelgitters liegen um die Kamera der Szene, und sie hat keine",
    "add a camera, or set center to volumes": "eine Kamera hinzufügen oder die Mitte auf die Volumen setzen",
    "putting the scene into voxels": "Szene in Voxel zerlegen",
    "lamps on voxels": "Lampen auf Voxeln",
    "light on voxels": "Licht auf Voxeln",
    "light between voxels": "Licht zwischen Voxeln",
    "sweeping the voxels": "Voxel durchlaufen",
    "voxels": "Voxel",
}

VOXEL_LABELS: dict[str, str] = {
    "Voxel Cone Tracing": "Voxel-Kegelverfolgung",
    "A few cones through a hierarchy of lit voxels: smooth and quick, leaks through what is thinner than two voxels":
        "Wenige Kegel durch eine Hierarchie beleuchteter Voxel: weich und schnell, undicht an allem, was dünner ist als zwei Voxel",
    "Voxel Ray Marching": "Strahlen durch Voxel",
    "Rays through a grid of lit voxels: what voxel engines show, slower here than rays among triangles":
        "Strahlen durch ein Gitter beleuchteter Voxel: was Voxel-Engines zeigen, hier langsamer als Strahlen zwischen Dreiecken",
    "Voxels along the longest side of the grid": "Voxel entlang der längsten Seite des Gitters",
    "Highest band of the exported probes": "Höchstes Band der exportierten Sonden",
    "Grids about one place, each half as large as the one around it, in voxels half as large: finer there for as many voxels more":
        "Gitter um eine Stelle, jedes halb so groß wie das um es herum, in halb so großen Voxeln: dort feiner, für so viele mehr",
    "About": "Um",
    "What cascades lie about: the middle of the probe volumes, or the scene's camera":
        "Worum Kaskaden liegen: die Mitte der Sondenvolumen oder die Kamera der Szene",
    "Voxel Size": "Voxelgröße",
    "Side of a voxel; unset divides the longest side of the grid by the resolution":
        "Seite eines Voxels; ohne Angabe wird die längste Seite des Gitters durch die Auflösung geteilt",
    "Reach": "Reichweite",
    "How far beyond the probe volumes the grid reaches for surfaces, as a share of the volumes' longest side":
        "Wie weit das Gitter über die Sondenvolumen hinaus nach Flächen greift, als Anteil von deren längster Seite",
    "Light on Voxels": "Licht auf Voxeln",
    "All light on surfaces, traced by rays, or the light of lamps, by shadow rays or from their reflective shadow maps, and what "
    "voxels then send each other":
        "Alles Licht auf Flächen, mit Strahlen verfolgt, oder das Licht der Lampen, durch Schattenstrahlen oder aus ihren "
        "reflektierenden Schattenkarten, und was Voxel einander dann zusenden",
    "Shadow maps": "Schattenkarten",
    "Cached Bounces": "Gespeicherte Reflexionen",
    "How often voxels send each other light before it is gathered, where they light themselves":
        "Wie oft Voxel einander Licht zusenden, bevor es gesammelt wird, wo sie sich selbst beleuchten",
    "Add what all further bounces would, in voxels twice as large":
        "Hinzufügen, was alle weiteren Reflexionen brächten, in doppelt so großen Voxeln",
    "Voxels": "Voxel",
    "The cubes that cone tracing and voxel marching see the scene in: in the light that their faces send out, or white for what "
    "they block of it":
        "Die Würfel, in denen Kegel und Strahlen durch Voxel die Szene sehen: im Licht, das ihre Seiten aussenden, oder weiß, je "
        "nachdem, was sie davon aufhalten",
    "Voxel Level": "Voxelstufe",
    "Which voxels are shown: 0 are the finest, and each level's are twice as large as those of the last":
        "Welche Voxel gezeigt werden: 0 sind die feinsten, und die jeder Stufe sind doppelt so groß wie die der vorigen",
    "Cones": "Kegel",
    "Cones from every receiver: 6 as games take them, or 12 and more, which see more between them":
        "Kegel von jedem Empfänger aus: 6, wie Spiele sie nehmen, oder 12 und mehr, die mehr dazwischen sehen",
    "Step": "Schritt",
    "Length of a step along a cone, in the voxels that it reads there":
        "Länge eines Schritts entlang eines Kegels, in den Voxeln, die er dort liest",
    "Near Field": "Nahbereich",
    "Voxels from a receiver that are walked one by one before cones widen":
        "Voxel um einen Empfänger, die einzeln durchlaufen werden, bevor Kegel sich weiten",
    "Rays from every receiver, or directions in which cells hand light on":
        "Strahlen von jedem Empfänger aus, oder Richtungen, in denen Zellen Licht weitergeben",
    "Voxel Reflections": "Spiegelungen aus Voxeln",
    "Reflections of the scene in lit voxels, one cone a pixel by its roughness: off the screen, too, and never sharp":
        "Spiegelungen der Szene in beleuchteten Voxeln, ein Kegel je Pixel nach der Rauheit: auch von außerhalb des Bilds, nie "
        "scharf",
    "Voxels along the longest side of the scene, where the bake has none of its own":
        "Voxel entlang der längsten Seite der Szene, wenn das Backen keine eigenen hat",
    "Voxels from a surface that are walked one by one before the cone widens":
        "Voxel vor einer Fläche, die einzeln durchlaufen werden, bevor der Kegel sich weitet",
    "Rougher layers are taken for this rough: their lobe is no cone any more":
        "Rauere Schichten gelten als so rau: ihre Keule ist kein Kegel mehr",
    "Gather": "Sammeln",
    "Rays from receivers, or what arrives in the voxels before them":
        "Strahlen von Empfängern aus, oder was in den Voxeln davor ankommt",
    "Receivers": "Empfänger",
    "Opacity": "Deckkraft",
    "All voxels count for what they cover, or the first that is half covered counts whole":
        "Alle Voxel zählen mit dem, was sie bedecken, oder der erste halb bedeckte zählt ganz",
    "Compositing": "Überlagern",
    "First hit": "Erster Treffer",
}
