"""Whether two bundles are the same."""

import json
from pathlib import Path


def same_bundle(first, second):
    """Whether all files are the same bytes, but for the statistics of bake.json."""
    def content(folder):
        files = {file.relative_to(folder).as_posix(): file.read_bytes() for file in Path(folder).rglob("*") if file.is_file()}
        manifest = json.loads(files.pop("bake.json"))
        return files, {name: value for name, value in manifest.items() if name != "stats"}
    return content(first) == content(second)
