#!/usr/bin/env bash
# Makes the README's pictures from real output. Needs chromium (Debian: chromium) for plot.png.
#   config/docs/pictures/make_pictures.sh [BUILD_DIRECTORY]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../../.." && pwd)
tool=$(realpath "${1:-$source/build/release}")/daemon/crepesctl
recording=config/examples/recordings/two-robots
scratch=$(mktemp -d /tmp/crepes-pictures.XXXXXX)
trap 'rm -rf "$scratch"' EXIT
cd "$source"

"$tool" replay "$recording" --out "$scratch/out" --debug-innovations >/dev/null
"$here/draw.py" paths "$scratch/out" "$recording" "$here/paths.svg"

"$tool" plot "$scratch/out" --truth "$recording" --out "$scratch/plot.html" >/dev/null
sed -i "s|$scratch/||g" "$scratch/plot.html"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1140,1000 \
  --virtual-time-budget=5000 --screenshot="$here/plot.png" "file://$scratch/plot.html" 2>/dev/null

"$tool" demo --scenario four --for 40 --port 47581 >"$scratch/demo" &
demo=$!
sleep 15
"$tool" status --port 47581 >"$scratch/status"
wait "$demo"
"$here/draw.py" screen "$scratch/status" "$here/status.svg"
PYTHONPATH=config/examples/clients/python "$tool" demo --scenario formation --port 47591 --keep "$scratch/formation" \
  --run config/examples/clients/python/examples/formation.py >/dev/null
"$here/draw.py" formation "$scratch/formation" "$here/formation.svg"
CREPES_TOOL=$tool "$source/tests/page/make_pictures.py" "$here"
ls -l "$here"/*.svg "$here"/*.png
