#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of the rig on this machine, the shipped tenterd on virtual devices; rows for docs/rig-safety.md.

    bench/rig_timing.py halts [--modbus tcp|rtu] [--count 1000] [--seed 1] [--out FILE.jsonl]
    bench/rig_timing.py jitter [--minutes 10]

halts: eight axes in motion, one cell steps beyond the absolute limit at a random moment; how long until the last
axis draws in no more. jitter: four axes go back and forth; how late the 50 Hz loop's ticks are, and whether each
missed deadline stands in the session. Both at real-time priority where that is allowed (as the unit file gives it).
"""
import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

BIN = pathlib.Path(os.environ.get("TENTER_BIN", pathlib.Path(__file__).parent.parent / "build/release/bin"))
TICK_MS = 20.0
PRIORITY = ["chrt", "--rr", "20"]


def priority():
    allowed = subprocess.run([*PRIORITY, "true"], stderr=subprocess.DEVNULL).returncode == 0
    print("at real-time priority" if allowed else "WITHOUT real-time priority: not allowed here", file=sys.stderr)
    return PRIORITY if allowed else []


def quantile(ordered, share):
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def halts(options):
    program = [*priority(), str(BIN / "rig_force_series"), "--modbus", options.modbus, "--count", str(options.count),
               "--seed", str(options.seed)]
    trials = []
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True) as series:
        for line in series.stdout:
            trials.append(json.loads(line))
            if options.out:
                with open(options.out, "a", encoding="utf-8") as out:
                    out.write(line)
    counted = [t for t in trials if t["moved_before"]]
    if not counted or series.returncode != 0:
        print(f"{len(trials)} trials, {len(counted)} in motion, exit code {series.returncode}", file=sys.stderr)
        return 1
    halted = sorted(t["halted_ms"] for t in counted)
    overshoot = sorted(t["overshoot_N"] for t in counted)
    scan = trials[-1]["scan_ms"]
    limit = 25.0 if options.modbus == "tcp" else scan + 10.0
    beyond = sum(h > limit for h in halted)
    print("| cells on | trials | in motion | scan [ms] | p50 [ms] | p99 [ms] | max [ms] | beyond | overshoot p50, max [N] |")
    print("|---|---|---|---|---|---|---|---|---|")
    print(f"| {options.modbus} | {len(trials)} | {len(counted)} | {scan:.1f} | {quantile(halted, .5):.1f} | "
          f"{quantile(halted, .99):.1f} | {halted[-1]:.1f} | {beyond} beyond {limit:.1f} ms | "
          f"{quantile(overshoot, .5):.2f}, {overshoot[-1]:.2f} |")
    broken = sum(not t["session_ok"] for t in trials)
    if broken:
        print(f"{broken} sessions are not whole", file=sys.stderr)
    return 1 if beyond or broken else 0


def back_and_forth(minutes):
    axes = [f"axis-{i}" for i in range(1, 5)]
    steps = [(0.004, 3.0), (0.0005, 3.0)]
    lines = ["schema_version = 1", 'name = "back-and-forth"', 'description = "loads and lets go, again and again"',
             'axes = ["axis-1"]', "speed_m_per_s = 0.002", "capture_interval_s = 1.0"]
    lines += ["[[phase]]", 'name = "cycles"', f"cycles = {max(1, round(minutes * 60 / 9.7))}"]
    for target, hold in steps:
        targets = ", ".join(f"{axis} = {target}" for axis in axes)
        lines += ["[[phase.step]]", 'end = "travel"', f"targets_m = {{{targets}}}"]
        lines += ["[[phase.step]]", 'end = "hold"', f"hold_s = {hold}"]
    return "\n".join(lines) + "\n"


def rig(socket, *arguments):
    done = subprocess.run([str(BIN / "tenter"), "rig", "--socket", str(socket), *arguments, "--json"],
                          stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise SystemExit(f"tenter rig {' '.join(arguments)} ended with {done.returncode}: {done.stdout}")
    return json.loads(done.stdout or "{}") if arguments[0] == "status" else {}


def of_session(session):
    """How far samples were from 20 ms apart [ms], in order; missed deadlines; other faults."""
    sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "docs/formats/python"))
    import read_session
    records = read_session.read_session(session)["records"]
    times = [r["time_ns"] for r in records if r["kind"] == "sample"]
    apart = sorted(abs(1e-6 * (b - a) - TICK_MS) for a, b in zip(times, times[1:]))
    faults = [r["fault"] for r in records if r.get("event") == "fault"]
    return apart, faults.count("missed-deadline"), [f for f in faults if f != "missed-deadline"]


def jitter(options):
    real_time = priority()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        socket = folder / "rig" / "tenterd.sock"
        protocol = folder / "back-and-forth.toml"
        protocol.write_text(back_and_forth(options.minutes))
        serve = subprocess.Popen([*real_time, str(BIN / "tenter"), "twin", "serve", "--fabric", "knit-12", "--state",
                                  str(socket.parent)], stdout=subprocess.PIPE, text=True)
        daemon = None
        try:
            command = next((line for line in serve.stdout if "tenterd" in line), None)
            if command is None:
                raise SystemExit("tenter twin serve ended before it served")
            daemon = subprocess.Popen(" ".join(["exec", *real_time, command.strip()]), shell=True,
                                      env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"},
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            until = time.monotonic() + 20
            while not socket.exists() and time.monotonic() < until:
                time.sleep(0.1)
            time.sleep(1.0)  # until each cell is trusted
            rig(socket, "home")
            rig(socket, "tare")
            before = rig(socket, "status")["loop"]
            rig(socket, "run", str(protocol), "-o", str(folder / "session"))
            after = rig(socket, "status")["loop"]
        finally:
            for process in (daemon, serve):
                if process:
                    process.send_signal(signal.SIGTERM)
                    process.wait(30)
        apart, recorded, others = of_session(folder / "session")
    ticks, missed = after["ticks"] - before["ticks"], after["missed"] - before["missed"]
    print("| ticks in motion | minutes | samples off 20 ms: p99, max [ms] | missed deadlines, of them in the session | since "
          "the start, late: p99, max [ms] |")
    print("|---|---|---|---|---|")
    print(f"| {ticks} | {ticks * TICK_MS / 60e3:.1f} | {quantile(apart, .99):.2f}, {apart[-1]:.1f} | {missed}, {recorded} | "
          f"{after['p99_late_ms']:.1f}, {after['worst_late_ms']:.1f} |")
    if others:
        print(f"other faults: {others[:5]}", file=sys.stderr)
    return 0 if recorded == missed and not others else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    series = verbs.add_parser("halts")
    series.add_argument("--modbus", choices=["tcp", "rtu"], default="tcp")
    series.add_argument("--count", type=int, default=1000)
    series.add_argument("--seed", type=int, default=1)
    series.add_argument("--out", help="the trials, a JSON line each")
    series.set_defaults(run=halts)
    ticks = verbs.add_parser("jitter")
    ticks.add_argument("--minutes", type=float, default=10.0)
    ticks.set_defaults(run=jitter)
    options = parser.parse_args()
    return options.run(options)


if __name__ == "__main__":
    sys.exit(main())
