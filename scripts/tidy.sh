#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs clang-tidy over the tree, or over the sources whose path matches the given regular expressions,
# e.g. scripts/tidy.sh mechanics/src
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

filters=("$@")
if [[ ${#filters[@]} -eq 0 ]]; then
  filters=("^$PWD/(?!build/)")  # what the build generates is not ours to lint
fi
log="$(mktemp)"
trap 'rm -f "$log"' EXIT
if ! cmake --preset tidy </dev/null >"$log" 2>&1; then
  cat "$log" >&2
  exit 1
fi
if ! run-clang-tidy-16 -quiet -extra-arg=-Wno-unknown-warning-option -p build/tidy -j "$(nproc)" "${filters[@]}" </dev/null >"$log" 2>&1; then
  grep -vE '^(clang-tidy-16 |[0-9]+ warnings? generated|Suppressed |Use -header-filter)' "$log" >&2 || true
  echo "clang-tidy: findings stand above." >&2
  exit 1
fi
echo "clang-tidy: clean ($(grep -c '^clang-tidy-16 ' "$log") sources)."
