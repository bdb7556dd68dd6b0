#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What captures cost: every fabric and protocol once, a row each.
# bench/captures.sh TENTER [NODES [FRAMES [SEED]]]; 1 if one of them fails.
set -euo pipefail

tenter="${1:?usage: bench/captures.sh TENTER [NODES [FRAMES [SEED]]]}"
nodes="${2:-31}" frames="${3:-60}" seed="${4:-7}"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
TIMEFORMAT='%U'

status=0
echo "| fabric | protocol | CPU s | Newton steps | factorizations | ok |"
echo "|---|---|---|---|---|---|"
for fabric in $("$tenter" twin fabrics); do
  for protocol in $("$tenter" protocol list); do
    ok=yes
    { time "$tenter" twin capture --fabric "$fabric" --protocol "$protocol" --seed "$seed" \
      --nodes "$nodes" --frames "$frames" --measurement -o "$folder/capture" --json \
      >"$folder/answer.json" 2>/dev/null || ok=no; } 2>"$folder/seconds"
    [[ $ok == yes ]] || status=1
    count() { sed -n "s/.*\"$1\": *\([0-9]*\).*/\1/p" "$folder/answer.json"; }
    echo "| $fabric | $protocol | $(cat "$folder/seconds") | $(count newton_steps)" \
      "| $(count factorizations) | $ok |"
  done
done
exit $status
