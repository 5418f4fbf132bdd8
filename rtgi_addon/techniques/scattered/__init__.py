"""Probes placed where a scene is used, instead of on a lattice: any technique's.

Candidates stand above every floor (`floors`), those that their neighbours predict are left out (`thinning`), and the nodes of a
lattice of words name the probes that see them (`index`), which the look-up interpolates (`lattice/lookup.py`). What else decides
where probes stand comes in here.

Source: the placement of M. Gilabert and N. Stefanov, "Deferred Radiance Transfer Volumes: Global Illumination in Far Cry 3", GDC
2012, whose grid of bytes names the nearest probe of each cell.
"""
