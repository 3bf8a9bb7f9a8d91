#!/usr/bin/env bash
# validate.sh BAKE_PROGRAM SOURCE_FOLDER WORK_FOLDER: bakes a block, has a slave stamp one and saves it, and hands both to the
# Khronos validator.
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
programs="$(dirname "$bake")"
rm -rf saved ready
"$programs/farfeel-slave" --scene living --editable --listen 127.0.0.1:0 --ready-fd 9 9> ready > slave.log 2>&1 &
slave=$!
trap 'kill "$slave" 2> /dev/null || true' EXIT
until grep -q ready ready; do
  kill -0 "$slave" || { cat slave.log; exit 1; }
  sleep 0.1
done
to=(--connect "127.0.0.1:$(cut -d' ' -f2 ready)")
"$programs/farfeel-edit" edit stamp block --at 0 0 0.02 --depth 0.0005 "${to[@]}"
"$programs/farfeel-edit" save -o saved "${to[@]}"
node validate.cjs block.glb saved/*.glb
