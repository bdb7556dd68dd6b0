#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Formats every tracked C++ file; with --check it changes nothing and fails if one would change.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mode=(-i)
if [[ "${1:-}" == --check ]]; then
  mode=(--dry-run -Werror)
fi
git -c safe.directory="*" ls-files -z -- '*.cpp' '*.h' | xargs -0 -r -n 16 -P "$(nproc)" clang-format-16 "${mode[@]}"
