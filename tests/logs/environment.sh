#!/usr/bin/env bash
# Makes a Python environment in a folder, unless it is there, and prints its interpreter.
#
#   tests/logs/environment.sh FOLDER [REQUIREMENTS]
#
# The packages are those of a file, with their versions: tests/logs/requirements.txt for tests/logs/readers.py.
set -euo pipefail
requirements=${2:-$(cd "$(dirname "$0")" && pwd)/requirements.txt}
folder=$1
stamp=$folder/requirements.txt
if ! cmp -s "$requirements" "$stamp"; then
    rm -rf "$folder"
    python3 -m venv "$folder" >&2
    "$folder/bin/pip" install --quiet --disable-pip-version-check --requirement "$requirements" >&2
    cp "$requirements" "$stamp"
fi
echo "$folder/bin/python3"
