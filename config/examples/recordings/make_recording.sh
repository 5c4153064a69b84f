#!/usr/bin/env bash
# Makes the recording two-robots anew with our own simulator: scenario manual, seed 1, 20 s.
#   cmake --build build/release --target pair_study
#   config/examples/recordings/make_recording.sh [BUILD_DIRECTORY]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
study=$(realpath "${1:-$here/../../../build/release}")/tests/pair_study
scratch=$(mktemp -d /tmp/crepes-recording.XXXXXX)
trap 'rm -rf "$scratch"' EXIT

"$study" --scenario manual --seeds 1 --duration 20 --write "$scratch"
# The written configurations have every key; those that differ from the defaults are enough.
for robot in r1 r2; do
  file=$scratch/manual-1/$robot/crepesd.yaml
  key() { sed -n "s/^ *$1: //p" "$file" | head -n1; }
  cat >"$file.short" <<END
# Robot ${robot#r} of a simulated recording, replayed by crepesctl replay.
robot: {id: ${robot#r}}
swarm:
  slot_ms: 10.0
  members:
    - {id: 1, name: r1, pattern: "011111111111111111", p_body_led: [0.05, 0.0, 0.01], p_body_uwb: [-0.04, 0.02, 0.1]}
    - {id: 2, name: r2, pattern: "001001011111111111", p_body_led: [0.05, 0.0, 0.01], p_body_uwb: [-0.04, 0.02, 0.1]}
cameras:
  - name: cam0
    camera_model: ds
    intrinsics: $(key intrinsics)
    resolution: [1280, 1024]
    rate_hz: 200.0
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
imu: {update_rate: 100.0, accelerometer_noise_density: 0.0018, gyroscope_noise_density: 0.00037}
uwb: {noise_m: 0.05}
recording: {socket: ""}
END
  mv "$file.short" "$file"
done
rm -rf "$here/two-robots"
mv "$scratch/manual-1" "$here/two-robots"
