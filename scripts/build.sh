#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Configures and builds a preset: scripts/build.sh [release|dev|asan|tsan] [ninja target...]
# CCACHE=1 in the environment compiles through ccache.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset="${1:-release}"
shift || true
launcher=()
if [[ "${CCACHE:-0}" == 1 ]]; then
  launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

log="$(mktemp)"
trap 'rm -f "$log"' EXIT
echo "Configuring preset $preset"
if ! cmake --preset "$preset" "${launcher[@]}" </dev/null >"$log" 2>&1; then
  cat "$log" >&2
  exit 1
fi
echo "Building into build/$preset"
cmake --build --preset "$preset" ${1:+--target "$@"} </dev/null
