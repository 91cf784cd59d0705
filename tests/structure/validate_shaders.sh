#!/bin/bash
# Usage: validate_shaders.sh FILE
# Validates a shader with glslangValidator: once per line "//! variant -DNAME=VALUE ..." in it, or
# once without definitions if it has none. FILE holds its includes already, see
# cmake/EmbedShaders.cmake.
set -euo pipefail
file=$1
if ! command -v glslangValidator >/dev/null; then
  echo "glslangValidator is missing: install the package glslang-tools" >&2
  exit 1
fi
if ! grep -q '^#version' "$file"; then
  echo "$file has no #version line" >&2
  exit 1
fi
mapfile -t variants < <(sed -n 's|^//! variant *||p' "$file")
if [ ${#variants[@]} -eq 0 ]; then variants=(""); fi
for variant in "${variants[@]}"; do
  # As gl::with_defines(): definitions follow the #version line.
  defines=$(sed -E 's/-D([A-Za-z0-9_]+)=?([^ ]*) */#define \1 \2\n/g' <<<"$variant")
  source=$(awk -v defines="$defines" '{ print } /^#version/ { print defines }' "$file")
  if ! errors=$(glslangValidator --stdin -S "${file##*.}" <<<"$source"); then
    echo "$file ${variant:+with $variant}:" >&2
    echo "$errors" >&2
    exit 1
  fi
done
