#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# House rules that no compiler checks, over all tracked files: a licence line in every source, no file past
# 600 lines, no path of somebody's machine, no link of a document to a file that is not there. Prints each breach;
# exit 77 says that there is no git checkout here.
set -euo pipefail
cd "${1:-$(dirname "${BASH_SOURCE[0]}")/../..}"

max_lines=600
licence='SPDX-License-Identifier: (GPL-3[.]0-or-later|CC0-1[.]0)$'
# In two halves each, so that this file does not contain what it looks for.
machine_path='(^|[^[:alnum:]_.])(/wo''rk/|/tm''p/w(/|[^[:alnum:]]|$)|/ro''ot/|/ho''me/[a-z])'

tracked() {
  git -c safe.directory='*' ls-files --cached -- "$@"
}

# Those that are still there.
present() {
  tracked "$@" | while IFS= read -r file; do
    [[ -f "$file" ]] && printf '%s\n' "$file"
  done
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
  breach "$file: no SPDX line among the first three"
done < <(present '*.cpp' '*.h' '*.cmake' '*CMakeLists.txt' '*.sh' '*.py' '*.toml' '.ci/run' '.clang-*' |
  xargs -d '\n' awk -v licence="$licence" '
    FNR == 1 { if (name != "" && !licensed) print name; name = FILENAME; licensed = 0 }
    FNR <= 3 { sub(/\r$/, ""); sub(/ *-->$/, ""); if ($0 ~ licence) licensed = 1 }
    END { if (name != "" && !licensed) print name }')

while read -r lines file; do
  breach "$file: $lines lines, $max_lines are allowed"
done < <(present '*.cpp' '*.h' '*.cmake' '*CMakeLists.txt' '*.sh' '*.py' '*.toml' '*.md' | xargs -d '\n' wc -l |
  awk -v most="$max_lines" '$1 > most && $2 != "total"')

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
