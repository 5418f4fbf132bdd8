"""Files (rank 5): the bake bundle as EXR and JSON, and one file or folder an engine in `engines/`.

What turns a ``Field`` into bytes on a disk, or reads them back with every check, comes in here.
"""
