#!/usr/bin/python3
"""Seconds and peak memory of `plumbline diagnose` on small and large sets, beside the goals. Meant for
a machine that does nothing else: the load average beside the figures shows whether it did."""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import runs  # noqa: E402

# (what, family, poses, second visits, runs, goal in s, goal in MB or None)
SETS = [("96 rows", "pair", 80, 16, 5, 0.8, None),
        ("12,000 rows, unknown cause", "creep", 11000, 1000, 1, 30.0, None),
        ("100,000 rows, two effects", "joint_compliance@q2,q3+backlash_move@q4", 99000, 1000, 1, 25.0,
         400)]


def measured_run(command):
    """(seconds, peak resident memory in MB, exit status) of a command and its children"""
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    # Of this child alone: RUSAGE_CHILDREN keeps the largest of all before it.
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return time.monotonic() - begin, usage.ru_maxrss / 1024, process.returncode


def set_line(entry, product, simulate, first_seed):
    what, family, poses, repeats, count, goal_s, goal_MB = entry
    seconds, peaks, failed = [], [], 0
    for k in range(count):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([simulate, "--family", family, "--seed", str(first_seed + k), "--out", folder,
                            "--rows", str(poses), "--repeats", str(repeats), "--tests", "10"],
                           check=True, capture_output=True)
            cell, rows, answer = (os.path.join(folder, n) for n in ("cell.toml", "measured.csv", "d.json"))
            taken, peak, status = measured_run([product, "diagnose", cell, rows, "--json", answer, "--quiet"])
            seconds.append(taken)
            peaks.append(peak)
            failed += status != 0
    goal = f"<= {goal_s:g} s" + (f", <= {goal_MB} MB" if goal_MB else "")
    reached = f"{statistics.median(seconds):.2f} s (longest {max(seconds):.2f}), {max(peaks):.0f} MB"
    return f"| {what} | {goal} | {reached}{f', {failed} FAILED' if failed else ''} |\n"


def table(product, simulate, first_seed, quick=False):
    text = "| set | goal | reached: median, peak |\n|---|---|---|\n"
    for entry in SETS[:1] if quick else SETS:
        text += set_line(entry, product, simulate, first_seed)
    return text + (f"\nSeeds from {first_seed}; {os.cpu_count()} processors, load average "
                   f"{os.getloadavg()[0]:.1f} afterwards.\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(runs.ROOT, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(runs.ROOT, "build/bin/plumbline-simulate"))
    parser.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000)
    parser.add_argument("--quick", action="store_true", help="96 rows only")
    parser.add_argument("--out", help="write the table here too")
    o = parser.parse_args()
    text = table(o.product, o.simulate, o.first_seed, o.quick)
    print(text)
    if o.out:
        with open(o.out, "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()
