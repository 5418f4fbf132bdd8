"""Light carried along paths: from receivers (the reference), from lamps, and the direct light at a point.

Paths know the whole `context`; estimators that keep nothing between their samples come in here.
"""
