"""The add-on never touches a network: no module for it is imported, no operator of Blender's that does is called."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [ROOT / "__init__.py", *sorted((ROOT / "rtgi_addon").rglob("*.py"))]
NETWORK = {
    "aiohttp", "asyncio", "ftplib", "http", "httplib2", "httpx", "imaplib", "multiprocessing", "nntplib", "poplib", "requests",
    "smtplib", "socket", "socketserver", "ssl", "telnetlib", "urllib", "urllib3", "webbrowser", "websocket", "wsgiref", "xmlrpc",
}
# Blender's own ways out.
OPERATORS = {"url_open", "url_open_preset", "repo_sync", "repo_sync_all", "package_install", "package_upgrade_all"}


def faults(source: str):
    """Whatever in ``source`` could reach a network, one line each."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            imported = [node.module]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in ("import_module", "__import__"):
            imported = [argument.value for argument in node.args if isinstance(argument, ast.Constant)]
        else:
            imported = []
        yield from (f"line {node.lineno} imports {name}" for name in imported if str(name).split(".")[0] in NETWORK)
        if isinstance(node, ast.Attribute) and node.attr in OPERATORS:
            yield f"line {node.lineno} names {node.attr}"


@pytest.mark.parametrize("source", [
    "import socket", "import urllib.request as u", "def f():\n    from http.client import HTTPSConnection", "import requests",
    "import importlib\nimportlib.import_module('urllib.request')", "bpy.ops.wm.url_open(url='x')",
])
def test_a_way_out_is_found(source):
    assert list(faults(source))


def test_no_module_of_the_add_on_has_one():
    wrong = [f"{path.relative_to(ROOT)}: {fault}" for path in SOURCES for fault in faults(path.read_text(encoding="utf-8"))]
    assert len(SOURCES) > 100 and not wrong, "\n" + "\n".join(wrong)


def test_what_is_exported_loads_nothing_from_elsewhere():
    loads = re.compile(r"""(?:\b(?:src|href)\s*=|\bfrom\b|\bimport\b|\bfetch\(|\burl\()[ (]*["'](?:https?:)?//""")
    pages = [path for suffix in ("js", "mjs", "html", "gd") for path in (ROOT / "rtgi_addon").rglob(f"*.{suffix}")]
    wrong = [str(path.relative_to(ROOT)) for path in pages if loads.search(path.read_text(encoding="utf-8"))]
    assert not wrong
    assert loads.search("import * as THREE from 'https://cdn.example/three.js'")
    assert loads.search('<script src="//cdn.example/x.js">') and loads.search('await import("https://cdn.example/x.js")')


def test_importing_the_add_on_loads_no_socket():
    """Its own imports, that is: Blender may have loaded one for itself."""
    program = ("import sys; sys.path.insert(0, sys.argv[1]); import numpy, concurrent.futures; before = set(sys.modules); "
               "import rtgi_addon.jobs.bake, rtgi_addon.exchange.bundle, rtgi_addon.techniques; "
               "print(sorted({'socket', 'ssl', 'urllib.request', 'http.client'} & (set(sys.modules) - before)))")
    ran = subprocess.run([sys.executable, "-c", program, str(ROOT)], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
