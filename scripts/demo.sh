#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# From a bare Debian 12 to a report: installs packages, builds, runs `tenter demo` with the arguments given.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

"$root/scripts/install_packages.sh"
"$root/scripts/build.sh" release tenter
exec "$root/build/release/bin/tenter" demo "$@"
