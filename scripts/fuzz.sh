#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs a fuzzer of tests/fuzz under libFuzzer, ASan and UBSan: scripts/fuzz.sh NAME [SECONDS]. Needs clang-16 and
# libclang-rt-16-dev, or version 14 of both. What it finds is left in build/fuzz/found.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

name="${1:?which fuzzer, such as journal}"
seconds="${2:-600}"

hasFuzzer() {
  command -v "clang++-$1" >/dev/null &&
    [[ -e "$("clang++-$1" -print-runtime-dir 2>/dev/null)/libclang_rt.fuzzer-x86_64.a" ]]
}
version=""
for candidate in 16 14; do
  if hasFuzzer "$candidate"; then
    version="$candidate"
    break
  fi
done
if [[ -z "$version" ]]; then
  echo "No Clang with libFuzzer here: apt-get install clang-16 libclang-rt-16-dev" >&2
  exit 77
fi

mkdir -p build
# libFuzzer's own instrumentation goes into everything, its main only into the fuzzers.
cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTENTER_FUZZ=ON -DTENTER_BENCHMARKS=OFF \
  -DTENTER_SANITIZE=address,undefined,fuzzer-no-link \
  -DCMAKE_C_COMPILER="clang-$version" -DCMAKE_CXX_COMPILER="clang++-$version" </dev/null >build/fuzz.log 2>&1 ||
  { tail -n 30 build/fuzz.log >&2; exit 1; }
cmake --build build/fuzz --target "${name}_fuzz" </dev/null
mkdir -p build/fuzz/found "build/fuzz/corpus/$name"
exec "build/fuzz/bin/${name}_fuzz" -max_total_time="$seconds" -print_final_stats=1 -artifact_prefix=build/fuzz/found/ \
  "build/fuzz/corpus/$name"
