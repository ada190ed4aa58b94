#!/usr/bin/env bash
# Makes a Python environment in a folder, unless it is there, and prints its interpreter.
#
#   tests/logs/environment.sh FOLDER [REQUIREMENTS]
#
# The packages are those of a file, with their versions: tests/logs/requirements.txt for tests/logs/readers.py and the
# tests of the Python module.
set -euo pipefail
requirements=${2:-$(cd "$(dirname "$0")" && pwd)/requirements.txt}
folder=$1
stamp=$folder/requirements.txt
if ! cmp -s "$requirements" "$stamp"; then
    rm -rf "$folder"
    python3 -m venv "$folder" >&2
    pip() { "$folder/bin/pip" install --quiet --disable-pip-version-check "$@" >&2; }
    # uv asks for many packages at once, which takes a fifth of the time. It does not read the settings of pip.
    pip uv==0.13.9
    "$folder/bin/uv" pip install --quiet --python "$folder/bin/python3" --requirement "$requirements" >&2 ||
        pip --requirement "$requirements"
    cp "$requirements" "$stamp"
fi
echo "$folder/bin/python3"
