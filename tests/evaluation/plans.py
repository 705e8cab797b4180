#!/usr/bin/python3
"""Do the rows of `plumbline plan` name a hidden effect more often than as many random postures?

For each case the simulator hides an effect, scaled to a signal over random postures. The same arm is measured at
the planned rows and at random ones, with the same payloads and independent noise, and both are diagnosed. Cells: the
tip unknown and one payload; the tip known and two payloads. Goals: fewer ambiguous verdicts than with random
postures, and no more wrong names.
"""

import csv
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import runs  # noqa: E402
import scorer  # noqa: E402
import separability  # noqa: E402

FAMILIES = ("none", "joint_offset", "gear_ratio", "link_geometry", "joint_compliance", "joint_hardening",
            "tool_stiffness", "tool_root_compliance", "gravity_direction", "pedestal_compliance",
            "backlash_load", "gear_periodic", "axis_coupling", "bearing_tilt", "link_bending", "payload_mass",
            "payload_cog")
ROBOTS = ("kr210", "ur10", "arm6")
CELLS = ("tip unknown", "two payloads")
PAYLOADS_KG = {"kr210": (40, 120), "ur10": (3, 8), "arm6": (10, 40)}
SIGMA_MM = 0.05
SIGNAL = 1.2, 8.0  # RMS displacement over sqrt(3) sigma, even in its logarithm
KINDS = ("random", "planned")


def payloads(robot, cell):
    return PAYLOADS_KG[robot][cell == "tip unknown":]


def read_rows(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def write_rows(path, rows):
    with open(path, "w") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def simulated(options, folder, family, robot, cell, seed, signal):
    arguments = ["--tool-unknown", "--one-payload"] if cell == "tip unknown" else []
    subprocess.run([options.simulate, "--family", family, "--robot", robot, "--seed", str(seed), "--rows",
                    str(options.rows), "--repeats", "0", "--tests", "2", "--sigma-mm", str(SIGMA_MM), "--signal",
                    f"{signal:.3f}", "--out", folder, *arguments], check=True, capture_output=True)
    with open(os.path.join(folder, "truth.json")) as file:
        truth = json.load(file)
    truth["unaligned"] = cell == "tip unknown"  # naming an unknown tip is no fault
    return truth


def plans_of(options):
    """{(robot, cell): rows}: a plan depends on neither the hidden effect nor the seed."""
    plans = {}
    for robot in ROBOTS:
        for cell in CELLS:
            with tempfile.TemporaryDirectory() as folder:
                simulated(options, folder, "none", robot, cell, 1, 1)
                path = os.path.join(folder, "plan.csv")
                subprocess.run([options.product, "plan", os.path.join(folder, "cell.toml"), "--rows",
                                str(options.rows), "--out", path, "--payloads-kg",
                                *map(str, payloads(robot, cell))], check=True, capture_output=True)
                plans[robot, cell] = read_rows(path)
    return plans


def random_rows(folder, robot, cell, columns, random):
    """The simulator's random postures with the columns of a plan and payloads at random."""
    rows = read_rows(os.path.join(folder, "measured.csv"))
    return [{name: row[name] for name in columns} | {"payload_kg": random.choice(payloads(robot, cell))}
            for row in rows]


def measured(options, folder, rows, random):
    """Writes the rows, with the simulator's tips and noise, as rows_measured.csv."""
    poses, tips = os.path.join(folder, "rows.csv"), os.path.join(folder, "tips.csv")
    write_rows(poses, rows)
    subprocess.run([options.simulate, "--predict", "--with", os.path.join(folder, "truth.json"), "--cell",
                    os.path.join(folder, "cell.toml"), "--poses", poses, "--out", tips], check=True,
                   capture_output=True)
    noisy = separability.points(tips) + SIGMA_MM * random.normal(size=(len(rows), 3))
    write_rows(os.path.join(folder, "rows_measured.csv"),
               [row | {name: f"{value:.5f}" for name, value in zip(("x_mm", "y_mm", "z_mm"), tip)}
                for row, tip in zip(rows, noisy)])


def diagnosed(options, folder, truth):
    path = os.path.join(folder, "answer.json")
    subprocess.run([options.product, "diagnose", os.path.join(folder, "cell.toml"),
                    os.path.join(folder, "rows_measured.csv"), "--json", path], check=True,
                   capture_output=True, timeout=300)
    with open(path) as file:
        answer = json.load(file)
    verdict = answer["verdict"]
    named = scorer.same_effects(answer.get("effects", []), truth, None, True)
    return {"verdict": verdict, "named": verdict in ("explained", "no_effect") and named,
            "wrong": verdict == "explained" and not named,
            "answer": [scorer.key(e)[0] for e in answer["effects"]],
            "rivals": [r["id"] for r in answer["rivals"]]}


def run_case(case, options, plans):
    family, robot, cell, seed = case
    random = np.random.default_rng([seed, FAMILIES.index(family), ROBOTS.index(robot), CELLS.index(cell)])
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=options.keep or None)
    row = {"family": family, "robot": robot, "cell": cell, "seed": seed}
    try:
        signal = math.exp(random.uniform(*np.log(SIGNAL)))
        truth = simulated(options, folder, family, robot, cell, seed, signal)
        plan = plans[robot, cell]
        for kind in KINDS:
            rows = plan if kind == "planned" else random_rows(folder, robot, cell, plan[0], random)
            measured(options, folder, rows, random)
            row[kind] = diagnosed(options, folder, truth)
    except (subprocess.SubprocessError, OSError, ValueError, KeyError) as error:
        row["error"] = str(error) + str(getattr(error, "stderr", "") or "")[-300:]
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    return row


def sign_test(better, worse):
    """Probability of at least `better` of the changed cases if better and worse are equally likely."""
    count = better + worse
    return sum(math.comb(count, k) for k in range(better, count + 1)) / 2 ** count


def report(done):
    text = "| rows | sets | ambiguous | named exactly | explained wrongly |\n|---|---|---|---|---|\n"
    wrong, ambiguous = {}, {}
    for kind in KINDS:
        of = [r[kind] for r in done]
        ambiguous[kind] = [r["verdict"] == "ambiguous" for r in of]
        wrong[kind] = sum(r["wrong"] for r in of)
        text += (f"| {kind} | {len(of)} | {sum(ambiguous[kind])} | {sum(r['named'] for r in of)} | "
                 f"{wrong[kind]} |\n")
    changes = list(zip(ambiguous["random"], ambiguous["planned"]))
    better, worse = changes.count((True, False)), changes.count((False, True))
    return text + (f"\nambiguous with planned rows: {sum(ambiguous['planned'])} (goal: fewer than "
                   f"{sum(ambiguous['random'])}); {better} sets no longer ambiguous, {worse} newly (sign test "
                   f"p = {sign_test(better, worse):.2g}); explained wrongly {wrong['planned']} (goal: at most "
                   f"{wrong['random']})\n")


def main():
    parser = runs.parser(__doc__, seeds=1, jobs=2, quick="one robot")
    parser.add_argument("--rows", type=int, default=30, help="of each plan")
    options = runs.parse(parser)
    seeds = range(options.first_seed, options.first_seed + (1 if options.quick else options.seeds))
    cases = [(family, robot, cell, seed) for seed in seeds for family in FAMILIES
             for robot in (ROBOTS[:1] if options.quick else ROBOTS) for cell in CELLS
             if not options.family or family in options.family]
    rows = runs.run_all(options.jobs, run_case, cases, options, plans_of(options))
    done = [r for r in rows if "error" not in r]
    print(f"Seeds from {options.first_seed}, {options.rows} rows.\n\n{report(done)}")
    for r in rows:
        if "error" in r:
            print(f"{r['family']} {r['robot']} {r['cell']} {r['seed']}: {r['error']}", file=sys.stderr)
    if options.json:
        with open(options.json, "w") as file:
            json.dump(rows, file, indent=1, default=str)
    return 0


if __name__ == "__main__":
    sys.exit(main())
