# SPDX-License-Identifier: GPL-3.0-or-later
"""A table by kind of a campaign's lines; exit 1 if any injection has a problem or is missing."""
import argparse
import json
import sys

PHASES = ["idle", "homing", "jog", "loading", "holding", "unloading"]


def largest(lines, key):
    return max((line.get(key, 0.0) for line in lines), default=0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--expect", type=int, default=0)
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    lines = []
    for file in options.files:
        with open(file, encoding="utf-8") as text:
            lines += [json.loads(line) for line in text]
    bad = [line for line in lines if line["problems"]]
    print("| kind | " + " | ".join(PHASES) + " | last loading [ms] | tensions compared | wrong | problems |")
    print("|---" * (len(PHASES) + 5) + "|")
    for kind in sorted({line["kind"] for line in lines}):
        of_kind = [line for line in lines if line["kind"] == kind]
        moving = [line for line in of_kind if line["phase"] in ("jog", "loading")]
        counts = [sum(line["phase"] == phase for line in of_kind) for phase in PHASES]
        cells = [str(count) if count else "" for count in counts]
        cells += [f"{largest(moving, 'loading_ms'):.0f}" if moving else ""]
        cells += [str(sum(line.get("values", 0) for line in of_kind))]
        cells += [str(sum(line.get("wrong_values", 0) for line in of_kind))]
        cells += [str(sum(bool(line["problems"]) for line in of_kind))]
        print(f"| {kind} | " + " | ".join(cells) + " |")
    print(
        f"\n{len(lines)} injections, {len({line['kind'] for line in lines})} kinds, "
        f"{len({(line['kind'], line['phase']) for line in lines})} pairs of kind and phase, "
        f"{len({(line['kind'], line['phase'], line['device']) for line in lines})} with the device; "
        f"{sum(line.get('values', 0) for line in lines)} tensions compared, "
        f"{sum(line.get('wrong_values', 0) for line in lines)} wrong; "
        f"longest call of the daemon {largest(lines, 'longest_call_s'):.3f} s; "
        f"{sum(line.get('overlong_calls', 0) for line in lines)} calls of devices beyond twice their time-out; "
        f"{sum(line.get('disturbed', 0) for line in lines)} attempts disturbed before the injection; "
        f"{len(bad)} with a problem"
    )
    for line in bad:
        print(json.dumps(line), file=sys.stderr)
    if bad or len(lines) < options.expect:
        sys.exit(1)


if __name__ == "__main__":
    main()
