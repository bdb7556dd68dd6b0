#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the Debian 12 packages that Tenter needs: the one list of them. Does nothing when all are there.
# With --list it only prints them.
set -euo pipefail

packages=(
  # tools
  build-essential cmake ninja-build pkg-config git clang-format-16 clang-tidy-16
  # libraries
  libeigen3-dev libceres-dev libsuitesparse-dev libopenblas-pthread-dev libopenblas0-pthread libtbb-dev
  nlohmann-json3-dev libtomlplusplus-dev libcli11-dev libspdlog-dev libssl-dev libvtk9-dev zlib1g-dev libhdf5-dev
  libopencv-dev
  libopencv-contrib-dev libexpat1-dev libembree-dev
  # libraries that talk to devices
  libusb-1.0-0-dev libumockdev-dev umockdev libmodbus-dev libsystemd-dev libaravis-dev
  # tests and benchmarks
  libgtest-dev libgmock-dev libbenchmark-dev libvalijson-dev python3-numpy python3-jsonschema
  opencv-doc aravis-tools aravis-tools-cli
  python3-usb usbutils mbpoll python3-pymodbus python3-serial-asyncio
  clang-16 libclang-rt-16-dev  # scripts/fuzz.sh
)

if [[ "${1:-}" == --list ]]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

isInstalled() {
  [[ "$(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null)" == installed ]]
}

missing=()
for package in "${packages[@]}"; do
  isInstalled "$package" || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  echo "Packages: all ${#packages[@]} are installed."
  exit 0
fi
echo "Packages: installing ${missing[*]}"

as_root=()
if [[ "$(id -u)" -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "Installing packages needs root: run this script as root, or install sudo." >&2
    exit 1
  fi
  as_root=(sudo)
fi
log="$(mktemp)"
trap 'rm -f "$log"' EXIT
run() {
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive "$@" </dev/null >"$log" 2>&1; then
    tail -n 30 "$log" >&2
    echo "'$*' failed; its last lines stand above." >&2
    exit 1
  fi
}
# Minimal images leave manual pages out, and then OpenJDK, on which libvtk9-dev depends, does not configure.
run mkdir -p /usr/share/man/man1
run dpkg --configure -a  # finishes what an interrupted run left
run apt-get --quiet update
run apt-get --quiet --option DPkg::Lock::Timeout=300 install --yes --no-install-recommends "${missing[@]}"
echo "Packages: done."
