"""What the evaluations on fresh seeds share: their options, and runs in several processes."""

import argparse
import concurrent.futures
import itertools
import json
import os
import sys
import time

MOST_CASES = None  # of --smoke
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def parser(description, seeds, jobs, quick):
    made = argparse.ArgumentParser(description=description)
    made.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    made.add_argument("--simulate", default=os.path.join(ROOT, "build/bin/plumbline-simulate"))
    made.add_argument("--seeds", type=int, default=seeds, help="runs of each family")
    made.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000,
                      help="fresh by default")
    made.add_argument("--quick", action="store_true", help=quick)
    made.add_argument("--smoke", type=int, metavar="N",
                      help="N runs among those of --quick, only to see that the evaluation works")
    made.add_argument("--family", action="append", help="only these families")
    made.add_argument("--jobs", type=int, default=jobs, help="runs at once")
    made.add_argument("--json", help="write every run here")
    made.add_argument("--keep", help="keep the data sets in this folder")
    return made


def limit(options):
    """Has run_all and run_each take so few cases, if asked for."""
    global MOST_CASES
    if options.smoke:
        options.quick, MOST_CASES = True, options.smoke


def parse(made):
    """The options; ends the program where what they name is not there."""
    options = made.parse_args()
    limit(options)
    for program in (options.product, options.simulate):
        if not os.access(program, os.X_OK):
            sys.exit(f"{made.prog}: no program {program}; build it with ./dev build, or name it")
    if options.keep:
        os.makedirs(options.keep, exist_ok=True)
    return options


def run_each(jobs, run_case, cases, *more):
    """run_case(case, *more) of each case, given as they end; the caller may stop asking for more."""
    cases, pending = itertools.islice(cases, MOST_CASES), set()
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        while True:
            for case in itertools.islice(cases, jobs - len(pending)):
                pending.add(pool.submit(run_case, case, *more))
            if not pending:
                return
            done, pending = concurrent.futures.wait(pending, return_when="FIRST_COMPLETED")
            for run in done:
                yield run.result()


class Results:
    """Finished runs in a file, a line each, so that a long evaluation can be made in parts. Its first
    line holds the settings; parts of other settings are refused."""

    def __init__(self, path, settings):
        self.path, self.settings, self.rows = path, settings, []
        if path and os.path.exists(path):
            with open(path) as file:
                self.settings, *self.rows = map(json.loads, file)
            other = {k: v for k, v in settings.items() if v is not None and self.settings.get(k) != v}
            if other:
                sys.exit(f"{path} was made with {self.settings}, not {other}: name another file, or "
                         "leave these options out")
        elif path:
            self.append_line(settings)

    def append_line(self, what):
        with open(self.path, "a") as file:
            file.write(json.dumps(what) + "\n")

    def add(self, row):
        self.rows.append(row)
        if self.path:
            self.append_line(row)


def run_all(jobs, run_case, cases, *more):
    """run_case(case, *more) of every case, in order; on a terminal it tells how far it is."""
    if MOST_CASES:  # spread over all, so that each group has some
        cases = cases[::max(1, len(cases) // MOST_CASES)][:MOST_CASES]
    rows = []
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        for number, run in enumerate([pool.submit(run_case, c, *more) for c in cases], 1):
            rows.append(run.result())
            if sys.stderr.isatty():
                print(f"\r{number}/{len(cases)}", end="", file=sys.stderr)
    return rows
