"""Right answers rendered by Cycles: irradiance at probes and on surfaces, for references and comparisons.

Whatever needs Cycles as a judge comes in here; what Cycles bakes as an input of extraction is `blender/materials/fallback.py`.
"""
