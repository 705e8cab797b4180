"""What the evaluations on fresh seeds share: their options, and runs in several processes."""

import argparse
import concurrent.futures
import os
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def parser(description, seeds, jobs, quick):
    made = argparse.ArgumentParser(description=description)
    made.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    made.add_argument("--simulate", default=os.path.join(ROOT, "build/bin/plumbline-simulate"))
    made.add_argument("--seeds", type=int, default=seeds, help="runs of each family")
    made.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000,
                      help="fresh by default")
    made.add_argument("--quick", action="store_true", help=quick)
    made.add_argument("--family", action="append", help="only these families")
    made.add_argument("--jobs", type=int, default=jobs, help="runs at once")
    made.add_argument("--json", help="write every run here")
    made.add_argument("--keep", help="keep the data sets in this folder")
    return made


def parse(made):
    """The options; ends the program where what they name is not there."""
    options = made.parse_args()
    for program in (options.product, options.simulate):
        if not os.access(program, os.X_OK):
            sys.exit(f"{made.prog}: no program {program}; build it with ./dev build, or name it")
    if options.keep:
        os.makedirs(options.keep, exist_ok=True)
    return options


def run_all(jobs, run_case, cases, *more):
    """run_case(case, *more) of every case, in order; on a terminal it tells how far it is."""
    rows = []
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        for number, run in enumerate([pool.submit(run_case, c, *more) for c in cases], 1):
            rows.append(run.result())
            if sys.stderr.isatty():
                print(f"\r{number}/{len(cases)}", end="", file=sys.stderr)
    return rows
