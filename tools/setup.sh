#!/bin/sh
# Finds any Python that really runs (a pyenv shim may not) and hands over to setup.py, which picks the one Blender needs.
cd "$(dirname "$0")/.." || exit 1

try() {
    "$1" -I -c 'import sys; sys.exit(sys.version_info < (3, 8))' >/dev/null 2>&1
}

for python in "${RTGI_PYTHON:-python3}" python3 python3.13 python3.11 python /usr/bin/python3 /usr/local/bin/python3 \
    "$HOME"/.pyenv/versions/*/bin/python3 /opt/*/bin/python3 "$HOME"/.local/share/uv/python/*/bin/python3 \
    "$HOME"/*conda3/bin/python3 "$HOME"/miniforge3/bin/python3; do
    if try "$python"; then
        exec "$python" tools/setup.py "$@"
    fi
done

if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "setup: there is no Python here; installing python3 and python3-venv with apt-get"
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends python3 python3-venv \
        >/dev/null && exec python3 tools/setup.py "$@"
fi
echo "setup: no Python 3 was found: install Python 3.13 or 3.11 (Debian: sudo apt-get install python3 python3-venv)" >&2
exit 1
