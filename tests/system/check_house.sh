#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# House rules that no compiler checks, over all tracked files: a licence line in every source, no file past
# 600 lines, no path of somebody's machine, no link of a document to a file that is not there. Prints each breach;
# exit 77 says that there is no git checkout here.
set -euo pipefail
cd "${1:-$(dirname "${BASH_SOURCE[0]}")/../..}"

max_lines=600
licence='SPDX-License-Identifier: (GPL-3\.0-or-later|CC0-1\.0)$'
# In two halves each, so that this file does not contain what it looks for.
machine_path='(^|[^[:alnum:]_.])(/wo''rk/|/tm''p/w(/|[^[:alnum:]]|$)|/ro''ot/|/ho''me/[a-z])'

tracked() {
  git -c safe.directory='*' ls-files --cached -- "$@"
}

if ! tracked >/dev/null 2>&1; then
  echo "Skipped: not a git checkout."
  exit 77
fi

breaches=0
breach() {
  echo "$1"
  breaches=$((breaches + 1))
}

while IFS= read -r file; do
  [[ -f "$file" ]] || continue
  head -n 3 "$file" | tr -d '\r' | sed 's/ *-->$//' | grep -qE "$licence" || breach "$file: no SPDX line among the first three"
done < <(tracked '*.cpp' '*.h' '*.cmake' '*CMakeLists.txt' '*.sh' '*.py' '*.toml' '.ci/run' '.clang-*')

while IFS= read -r file; do
  [[ -f "$file" ]] || continue
  lines=$(wc -l <"$file")
  [[ $lines -le $max_lines ]] || breach "$file: $lines lines, $max_lines are allowed"
done < <(tracked '*.cpp' '*.h' '*.cmake' '*CMakeLists.txt' '*.sh' '*.py' '*.toml' '*.md')

while IFS= read -r document; do
  [[ -f "$document" ]] || continue
  while IFS= read -r target; do
    [[ -e "$(dirname "$document")/$target" ]] || breach "$document: links to $target, which is not there"
  done < <(sed 's/<!--.*-->//' "$document" | grep -oE '\]\([^)# ]+' | cut -c3- | grep -vE '^[a-z]+:' || true)
done < <(tracked '*.md')

while IFS= read -r hit; do
  breach "$hit: names a path of one machine"
done < <(git -c safe.directory='*' grep -nIoE "$machine_path" -- . || true)

[[ $breaches -eq 0 ]] || { echo "$breaches breaches of the house rules"; exit 1; }
echo "House rules hold for $(tracked | wc -l) files."
