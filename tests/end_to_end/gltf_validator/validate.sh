#!/usr/bin/env bash
# validate.sh BAKE_PROGRAM SOURCE_FOLDER WORK_FOLDER: bakes a block and hands it to the Khronos validator.
# Exit status 77: skipped, and why.
set -euo pipefail
bake=$1 source=$2 work=$3
for tool in node npm; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed"; exit 77; }
done
mkdir -p "$work"
cp "$source/package.json" "$source/validate.cjs" "$work"
cd "$work"
if [ ! -d node_modules/gltf-validator ]; then
  npm install --no-audit --no-fund --silent >npm.log 2>&1 || { echo "skipped: npm cannot install gltf-validator"; tail -3 npm.log; exit 77; }
fi
"$bake" --model block --texture 128 -o block.glb
node validate.cjs block.glb
