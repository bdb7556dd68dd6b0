#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Injects seeded faults into the daemon on virtual rigs and fails if any of them did what it must not:
#   scripts/fault_campaign.sh [--count 120] [--seed 1] [--shards 2] [--modbus tcp|rtu] [--bin DIR] [--out DIR]
# With --out, the lines of all injections and a table by kind stay there.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

count=120
seed=1
shards=2
modbus=tcp
bin="$root/build/release/bin"
out=""
while [[ $# -gt 0 ]]; do
  case "$1" in
    --count | --seed | --shards | --modbus | --bin | --out) declare "${1#--}=$2"; shift 2 ;;
    *) echo "usage: fault_campaign.sh [--count N] [--seed N] [--shards N] [--modbus tcp|rtu] [--bin DIR] [--out DIR]" >&2; exit 2 ;;
  esac
done
if [[ -z "$out" ]]; then
  out="$(mktemp -d)"
  trap 'rm -rf "$out"' EXIT
fi
mkdir -p "$out"

pids=()
for ((shard = 0; shard < shards; ++shard)); do
  "$bin/rig_fault_campaign" --seed "$seed" --count "$count" --shard "$shard" --shards "$shards" --modbus "$modbus" \
    >"$out/$modbus-$shard.jsonl" </dev/null &
  pids+=($!)
done
status=0
for pid in "${pids[@]}"; do wait "$pid" || status=1; done
/usr/bin/python3 "$root/tests/rig/campaign/table.py" --expect "$count" "$out/$modbus-"*.jsonl | tee "$out/$modbus.md"
exit "$((status | PIPESTATUS[0]))"
