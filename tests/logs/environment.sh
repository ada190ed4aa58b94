#!/usr/bin/env bash
# Makes the Python environment of tests/logs/readers.py in a folder, unless it is there, and prints its interpreter.
#
#   tests/logs/environment.sh FOLDER
#
# The packages are those of tests/logs/requirements.txt, with their versions.
set -euo pipefail
requirements=$(cd "$(dirname "$0")" && pwd)/requirements.txt
folder=$1
stamp=$folder/requirements.txt
if ! cmp -s "$requirements" "$stamp"; then
    rm -rf "$folder"
    python3 -m venv "$folder" >&2
    "$folder/bin/pip" install --quiet --disable-pip-version-check --requirement "$requirements" >&2
    cp "$requirements" "$stamp"
fi
echo "$folder/bin/python3"
