#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs packages, builds the release preset and runs all tests. Arguments go to ctest, e.g. -L unit or -R hinge.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

"$root/scripts/install_packages.sh"
"$root/scripts/build.sh" release
ctest --test-dir "$root/build/release" --output-on-failure --no-tests=error --timeout 900 \
  --parallel "$(nproc)" "$@" </dev/null
