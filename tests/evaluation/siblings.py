#!/usr/bin/python3
"""Do measured arms of the same model help to calibrate the next one with fewer rows?

Simulated fleets: the arms of a model share three effects whose sizes vary by 3 or 15 % from arm to arm,
and every arm has joint offsets of its own. A new arm is diagnosed with all its rows, and with a quarter of
them with and without its siblings; each corrected cell predicts test poses without noise. "different"
arms draw three effects anew; with five to draw from, at least one is shared, with another size. Goals: a
quarter of the rows with siblings reaches the error of all rows (median ratio at most 1); for a different arm
never worse than without siblings by more than 5 %. Exit code 1 if a goal is missed.

Printed besides: the error of the linearised Bayes estimate from a quarter of the rows that is given the hidden
effects, their true mean over the fleet and their true spread.
"""

import csv
import itertools
import json
import os
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

SHARED = ("joint_compliance", "joint_hardening", "gear_ratio", "thermal_growth", "link_geometry")
ROBOTS = ("kr210", "ur10", "arm6")
SIBLINGS, ROWS, SIGMA_MM = 4, 60, 0.05
# Standard deviation of the shared sizes, relative, and of the joint offsets [rad], from arm to arm.
SPREADS = {"alike": (0.03, 2e-5), "usual": (0.15, 1e-4)}


def call(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


def points(path):
    with open(path) as file:
        return np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)])


def drawn_effects(random, options, robot, seed, folder):
    """Three effects of plausible size, as the simulator draws them."""
    family = "+".join(random.choice(SHARED, 3, replace=False))
    call(options.simulate, "--family", family, "--robot", robot, "--seed", str(seed), "--rows", "40",
         "--signal", "6", "--out", folder)
    with open(os.path.join(folder, "truth.json")) as file:
        return json.load(file)["effects"]


def of_arm(random, shared, spread):
    """The effects of one arm: the shared ones with sizes of its own, and its joint offsets."""
    effects = json.loads(json.dumps(shared))
    for effect in effects:
        for parameter in effect["parameters"]:
            if isinstance(parameter["value"], (int, float)):
                parameter["value"] *= 1 + SPREADS[spread][0] * random.standard_normal()
    joints = [f"q{i}" for i in range(2, 6)]
    effects.append({"id": "joint_offset", "scope": joints,
                    "parameters": [{"name": joint, "value": SPREADS[spread][1] * random.standard_normal(),
                                    "unit": "rad"} for joint in joints]})
    return effects


def make_arm(random, options, robot, seed, effects, rows, folder):
    call(options.simulate, "--family", "none", "--robot", robot, "--seed", str(seed), "--rows", str(rows),
         "--repeats", "0", "--tests", "100", "--sigma-mm", str(SIGMA_MM), "--out", folder)
    with open(os.path.join(folder, "with.json"), "w") as file:
        json.dump({"effects": effects, "nuisances": []}, file)

    def predicted(poses, out):
        call(options.simulate, "--predict", "--cell", os.path.join(folder, "cell.toml"), "--poses",
             os.path.join(folder, poses), "--with", os.path.join(folder, "with.json"), "--out",
             os.path.join(folder, out))
        return points(os.path.join(folder, out))

    predicted("test_poses.csv", "test_truth.csv")
    tips = predicted("measured.csv", "tips.csv")
    tips += SIGMA_MM * random.standard_normal(tips.shape)
    path = os.path.join(folder, "measured.csv")
    with open(path) as file:
        reader = csv.DictReader(file)
        heads, table = reader.fieldnames, list(reader)
    for row, tip in zip(table, tips):
        for axis, value in zip("xyz", tip):
            row[f"{axis}_mm"] = f"{value:.5f}"
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, heads, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    quarter = [k for k in range(0, len(table), 4)]
    with open(os.path.join(folder, "quarter.csv"), "w", newline="") as file:
        writer = csv.DictWriter(file, heads, lineterminator="\n")
        writer.writeheader()
        writer.writerows([table[k] for k in quarter])


def numbers_of(effects):
    """The values that vary from arm to arm, as (effect, parameter) indices."""
    return [(i, k) for i, effect in enumerate(effects) for k, parameter in enumerate(effect["parameters"])
            if isinstance(parameter["value"], (int, float))]


def least_error(options, folder, shared, own, spread):
    """3-D RMS at the test poses [mm] of the fit that knows the effects and the distribution of their sizes."""
    def tips(poses, effects):
        with open(os.path.join(folder, "trial.json"), "w") as file:
            json.dump({"effects": effects, "nuisances": []}, file)
        out = os.path.join(folder, "trial.csv")
        call(options.simulate, "--predict", "--cell", os.path.join(folder, "cell.toml"), "--poses",
             os.path.join(folder, poses), "--with", os.path.join(folder, "trial.json"), "--out", out)
        return points(out).ravel()

    columns = {"quarter.csv": [], "test_poses.csv": []}
    away, deviations = [], []  # of the arm's values from their mean
    at_own = {poses: tips(poses, own) for poses in columns}
    for i, k in numbers_of(own):
        is_offset = i >= len(shared)
        value = own[i]["parameters"][k]["value"]
        mean = 0.0 if is_offset else shared[i]["parameters"][k]["value"]
        deviation = SPREADS[spread][1] if is_offset else SPREADS[spread][0] * abs(mean)
        away.append(value - mean)
        deviations.append(deviation)
        changed = json.loads(json.dumps(own))
        changed[i]["parameters"][k]["value"] = value + deviation
        for poses, found in columns.items():
            found.append(tips(poses, changed) - at_own[poses])  # per standard deviation
    measured = points(os.path.join(folder, "quarter.csv")).ravel()
    rows, test = (np.array(columns[poses]).T for poses in ("quarter.csv", "test_poses.csv"))
    ratio = np.array(away) / np.array(deviations)
    noise = measured - at_own["quarter.csv"]
    information = rows.T @ rows / SIGMA_MM ** 2 + np.eye(len(ratio))
    error = np.linalg.solve(information, rows.T @ noise / SIGMA_MM ** 2 - ratio)
    return float(np.sqrt(((test @ error).reshape(-1, 3) ** 2).sum(axis=1).mean()))


def test_error(options, folder, rows, siblings):
    """3-D RMS at the test poses [mm], and the answer."""
    model, answer = os.path.join(folder, "model.toml"), os.path.join(folder, "answer.json")
    words = [options.product, "diagnose", os.path.join(folder, "cell.toml"), os.path.join(folder, rows),
             "--write-model", model, "--json", answer, "--quiet", "--threads", "1"]
    if siblings:
        words += ["--siblings", *siblings]
    call(*words)
    out = os.path.join(folder, "predicted.csv")
    call(options.product, "predict", model, os.path.join(folder, "test_poses.csv"), "--out", out)
    away = points(out) - points(os.path.join(folder, "test_truth.csv"))
    with open(answer) as file:
        return float(np.sqrt((away ** 2).sum(axis=1).mean())), json.load(file)


def run(case, options):
    seed, spread, different = case
    random = np.random.default_rng(seed)
    robot = ROBOTS[seed % len(ROBOTS)]
    with tempfile.TemporaryDirectory() as folder:
        def at(name):
            return os.path.join(folder, name)
        shared = drawn_effects(random, options, robot, seed, at("parent"))
        siblings = []
        for k in range(SIBLINGS):
            siblings.append(at(f"arm{k}"))
            make_arm(random, options, robot, 100 * seed + k, of_arm(random, shared, spread), ROWS, siblings[-1])
        own = drawn_effects(random, options, robot, seed + 500000, at("other")) if different else shared
        effects = of_arm(random, own, spread)
        make_arm(random, options, robot, 100 * seed + 99, effects, ROWS, at("new"))
        full, _ = test_error(options, at("new"), "measured.csv", [])
        without, _ = test_error(options, at("new"), "quarter.csv", [])
        with_them, answer = test_error(options, at("new"), "quarter.csv", siblings)
        least = least_error(options, at("new"), own, effects, spread)
    return {"seed": seed, "robot": robot, "spread": spread, "different": different, "full_mm": full,
            "quarter_without_mm": without, "quarter_with_mm": with_them, "least_mm": least,
            "used": answer["siblings"]["used"], "in_words": answer["siblings"]["in_words"]}


def main():
    made = runs.parser(__doc__, seeds=10, jobs=2, quick="two fleets")
    options = runs.parse(made)
    seeds = 2 if options.quick else options.seeds
    cases = [(options.first_seed + k, spread, different) for k in range(seeds) for spread in SPREADS
             for different in (False, True)]
    rows = []
    for row in runs.run_each(options.jobs, run, cases, options):
        rows.append(row)
        print(f"seed {row['seed']} {row['robot']:6} {row['spread']} {'different' if row['different'] else 'same':9} "
              f"all rows {row['full_mm']:.3f}, a quarter {row['quarter_without_mm']:.3f}, with siblings "
              f"{row['quarter_with_mm']:.3f}{'' if row['used'] else ' (not used)'}, at best {row['least_mm']:.3f} mm", flush=True)
    if options.json:
        with open(options.json, "w") as file:
            json.dump(rows, file, indent=1)
    missed = False
    for spread, different in itertools.product(SPREADS, (False, True)):
        some = [row for row in rows if (row["spread"], row["different"]) == (spread, different)]
        over_full = [row["quarter_with_mm"] / row["full_mm"] for row in some]
        without = [row["quarter_without_mm"] / row["full_mm"] for row in some]
        ratio = [row["quarter_with_mm"] / row["quarter_without_mm"] for row in some]
        least = [row["least_mm"] / row["full_mm"] for row in some]
        print(f"{spread}, {'different' if different else 'same'}: siblings used in "
              f"{sum(row['used'] for row in some)} of {len(some)}; a quarter of the rows over all of them: median "
              f"{np.median(without):.2f} without, {np.median(over_full):.2f} with siblings, {np.median(least):.2f} at best; "
              f"with over without: "
              f"median {np.median(ratio):.2f}, largest {max(ratio):.2f}, worse by more than 5 % in "
              f"{sum(one > 1.05 for one in ratio)}")
        missed = missed or max(ratio) > 1.05 or (not different and np.median(over_full) > 1)
    return 1 if missed and not options.smoke else 0


if __name__ == "__main__":
    sys.exit(main())
