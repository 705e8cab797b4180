#!/usr/bin/python3
"""Does a measured orientation separate what positions alone confound?

Each simulated set is diagnosed twice: as poses (position and orientation), and with the orientation
removed. Poor designs are drawn on purpose: one payload, few rows, the tip unknown, so that positions alone
often leave two explanations. Goals: at most half as many ambiguous verdicts with orientation as without,
and no more wrong names.
"""

import json
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

FAMILIES = ("none", "joint_offset", "joint_compliance", "gear_ratio", "link_geometry", "gear_periodic",
            "backlash_load", "backlash_move", "thermal_growth", "tool_stiffness", "pedestal_compliance",
            "tool_root_compliance", "link_bending", "bearing_tilt")
ROBOTS = ("kr210", "ur10", "arm6")
SIGMA_MM, SIGMA_DEG = 0.05, 0.005
ORIENTATION = ("qw", "qx", "qy", "qz")


def remove_orientation(folder):
    """Writes positions.csv and positions.toml beside measured.csv and cell.toml."""
    with open(os.path.join(folder, "measured.csv")) as file:
        rows = [line.rstrip("\n").split(",") for line in file]
    kept = [k for k, name in enumerate(rows[0]) if name not in ORIENTATION]
    with open(os.path.join(folder, "positions.csv"), "w") as file:
        file.writelines(",".join(row[k] for k in kept) + "\n" for row in rows)
    with open(os.path.join(folder, "cell.toml")) as file:
        lines = [line for line in file if not line.startswith("sigma_deg")]
    with open(os.path.join(folder, "positions.toml"), "w") as file:
        file.writelines(lines)


def diagnosed(product, folder, cell, measured):
    path = os.path.join(folder, "answer.json")
    subprocess.run([product, "diagnose", os.path.join(folder, cell), os.path.join(folder, measured),
                    "--json", path], check=True, capture_output=True, timeout=300)
    with open(path) as file:
        return json.load(file)


def run_case(case, product, simulate, keep):
    family, robot, seed = case
    random = np.random.default_rng([seed, FAMILIES.index(family), ROBOTS.index(robot)])
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=keep or None)
    row = {"family": family, "robot": robot, "seed": seed}
    try:
        subprocess.run([simulate, "--family", family, "--robot", robot, "--seed", str(seed), "--rows",
                        str(int(random.integers(25, 70))), "--repeats", "0", "--tests", "20",
                        "--one-payload", "--tool-unknown", "--sigma-mm", str(SIGMA_MM), "--sigma-deg",
                        str(SIGMA_DEG), "--signal", f"{np.exp(random.uniform(1.2, 3.0)):.3f}", "--out",
                        folder], check=True, capture_output=True)
        with open(os.path.join(folder, "truth.json")) as file:
            truth = json.load(file)
        truth["unaligned"] = True  # the tip is unknown, so naming it is no fault
        remove_orientation(folder)
        for name, cell, measured in (("poses", "cell.toml", "measured.csv"),
                                     ("positions", "positions.toml", "positions.csv")):
            answer = diagnosed(product, folder, cell, measured)
            named = scorer.same_effects(answer.get("effects", []), truth, None, True)
            verdict = answer["verdict"]
            row[name] = {"verdict": verdict, "named": verdict == "explained" and named,
                         "wrong": verdict == "explained" and not named,
                         "answer": [scorer.key(e)[0] for e in answer["effects"]]}
    except (subprocess.SubprocessError, OSError, ValueError, KeyError) as error:
        row["error"] = str(error) + str(getattr(error, "stderr", "") or "")[-300:]
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    return row


def main():
    options = runs.parse(runs.parser(__doc__, seeds=3, jobs=2, quick="one seed, one robot"))
    seeds = range(options.first_seed, options.first_seed + (1 if options.quick else options.seeds))
    cases = [(family, robot, seed) for family in FAMILIES
             for robot in (ROBOTS[:1] if options.quick else ROBOTS) for seed in seeds
             if not options.family or family in options.family]
    rows = runs.run_all(options.jobs, run_case, cases, options.product, options.simulate, options.keep)
    done = [r for r in rows if "error" not in r]
    print("| measured | sets | ambiguous | named exactly | explained wrongly |\n|---|---|---|---|---|")
    for name in ("positions", "poses"):
        of = [r[name] for r in done]
        ambiguous = sum(r["verdict"] == "ambiguous" for r in of)
        print(f"| {name} | {len(of)} | {ambiguous} | {sum(r['named'] for r in of)} | "
              f"{sum(r['wrong'] for r in of)} |")
    before, after = (sum(r[name]["verdict"] == "ambiguous" for r in done)
                     for name in ("positions", "poses"))
    print(f"\nambiguous with orientation: {after / max(1, before):.2f} of those without (goal 0.5); "
          f"explained wrongly: {sum(r['poses']['wrong'] for r in done)} (goal: at most "
          f"{sum(r['positions']['wrong'] for r in done)})")
    for r in rows:
        if "error" in r:
            print(f"{r['family']} {r['robot']} {r['seed']}: {r['error']}", file=sys.stderr)
        elif r["poses"]["verdict"] != r["positions"]["verdict"] or r["poses"]["wrong"]:
            print(f"{r['family']} {r['robot']} {r['seed']}: positions {r['positions']['verdict']} "
                  f"{r['positions']['answer']}, poses {r['poses']['verdict']} {r['poses']['answer']}",
                  file=sys.stderr)
    if options.json:
        with open(options.json, "w") as file:
            json.dump(rows, file, indent=1, default=str)
    return 0


if __name__ == "__main__":
    sys.exit(main())
