#!/usr/bin/env bash
# Packs a module that cargo has built, with the Python files beside it, into a wheel in a folder.
#
#   python/tests/pack_wheel.sh LIBRARY FOLDER PYTHON
#
# `pip install ./python` builds the module by itself, for release. The tests pack the one that they are built with, so
# that nothing is built twice. Names, versions and tags are those that maturin writes.
set -euo pipefail
library=$(realpath "$1")
folder=$(realpath "$2")
python=$3
cd "$(dirname "$0")/.."
tree=$(mktemp -d)
trap 'rm -r "$tree"' EXIT
"$(dirname "$python")/maturin" pep517 write-dist-info --metadata-directory "$tree" --interpreter "$python"
mkdir "$tree/micromotor"
cp micromotor/*.py micromotor/*.pyi micromotor/py.typed "$tree/micromotor"
strip --strip-debug -o "$tree/micromotor/_micromotor.abi3.so" "$library"
"$python" -m wheel pack --dest-dir "$folder" "$tree"
