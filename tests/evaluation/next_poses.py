#!/usr/bin/python3
"""Scores the poses that an ambiguous diagnosis proposes: how many of them separate the rivals, beside
poses drawn at random.

Each case is drawn with few freedoms (a vertical tool, or one payload and rigid joints). Where the
diagnosis is ambiguous, its proposed poses are measured by the simulator and appended one after the
other until the answer is the hidden effect alone; likewise random poses within the joint limits,
with payloads of the same set. Poses needed beyond what is tried count as infinitely many.
"""

import argparse
import concurrent.futures
import csv
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zlib

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402  (after the thread limits)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scorer  # noqa: E402
import separability  # noqa: E402

DESIGNS = {"vertical tool, one payload": ["--vertical"],
           "one payload, rigid joints": ["--one-payload", "--rigid-joints"]}
FAMILIES = {"vertical tool, one payload": ["tool_stiffness", "payload_mass", "tool_root_compliance",
                                           "joint_offset", "backlash_load", "backlash_move"],
            "one payload, rigid joints": ["tool_stiffness", "payload_mass", "tool_root_compliance"]}
ROBOTS = ["kr210", "ur10", "arm6"]
BATCH, MOST_PROPOSED, MOST_RANDOM = 6, 12, 40
# Numbers of random poses tried: all of the first, then in steps of about a sixth.
TRIED = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 19, 22, 26, 30, 35, 40]
STEP_S, JITTER_C = 60.0, 0.35


class Case:
    """A simulated data set in a folder, and what is measured in it later."""

    def __init__(self, folder, family, seed, options, product, simulate):
        self.folder, self.product, self.simulate = folder, product, simulate
        self.run(simulate, "--family", family, "--seed", str(seed), "--out", folder, *options)
        with open(self.place("truth.json")) as file:
            self.truth = json.load(file)
        with open(self.place("measured.csv")) as file:
            self.rows = list(csv.DictReader(file))
        self.columns = list(self.rows[0])
        self.joints = [c for c in self.columns if c.startswith("q") and c.endswith("_deg")]
        self.limits = np.array(self.read_limits())
        self.optional = None

    def place(self, name):
        return os.path.join(self.folder, name)

    def run(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command[:2])} ends with {done.returncode}: "
                               f"{done.stderr.strip()[-300:]}")

    def read_limits(self):
        low, high = [], []
        with open(self.place("cell.toml")) as file:
            for line in file:
                name, _, value = line.partition("=")
                if name.strip() == "min_deg":
                    low.append(float(value))
                if name.strip() == "max_deg":
                    high.append(float(value))
        return list(zip(low, high))

    def write(self, name, rows, columns):
        with open(self.place(name), "w", newline="") as file:
            writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def measure(self, before, poses, draw):
        """`before` and the poses after it: a minute apart, at the hall's last temperature."""
        rows = [dict(row) for row in before]
        warm = float(np.mean([float(r["temp_C"]) for r in self.rows[-5:]]))
        t_s = float(rows[-1]["t_s"])
        for k, pose in enumerate(poses):
            row = dict(pose)
            row["t_s"] = f"{t_s + STEP_S * (k + 1):.5f}"
            row["temp_C"] = f"{warm + JITTER_C * draw.normal():.5f}"
            rows.append(row)
        asked = [c for c in self.columns if c not in ("x_mm", "y_mm", "z_mm")]
        self.write("asked.csv", rows, asked)
        self.run(self.simulate, "--predict", "--with", self.place("truth.json"), "--cell",
                 self.place("cell.toml"), "--poses", self.place("asked.csv"), "--out",
                 self.place("tips.csv"))
        tips = separability.points(self.place("tips.csv"))[len(before):]
        for row, tip in zip(rows[len(before):], tips):
            noisy = tip + self.truth["sigma"] * 1e3 * draw.normal(size=3)
            row.update({c: f"{v:.5f}" for c, v in zip(("x_mm", "y_mm", "z_mm"), noisy)})
        return rows

    def diagnose(self, rows):
        """(answer, proposed poses)"""
        self.write("all.csv", rows, self.columns)
        poses = self.place("next.csv")
        if os.path.exists(poses):
            os.remove(poses)
        self.run(self.product, "diagnose", self.place("cell.toml"), self.place("all.csv"), "--json",
                 self.place("diagnosis.json"), "--next-poses", poses, "--threads", "1", "--quiet")
        with open(self.place("diagnosis.json")) as file:
            answer = json.load(file)
        return answer, separability.table(poses) if os.path.exists(poses) else []

    def found(self, answer):
        judged = {"optional": self.optional} if self.optional else None
        return answer["verdict"] == "explained" and scorer.same_effects(
            answer["effects"], self.truth, judged)

    def random_poses(self, count, payloads, draw):
        poses = []
        for _ in range(count):
            q = draw.uniform(self.limits[:, 0], self.limits[:, 1])
            pose = {c: f"{v:.5f}" for c, v in zip(self.joints, q)}
            pose["payload_kg"] = f"{draw.choice(payloads):.5f}"
            poses.append(pose)
        return poses

    def judge_with(self, rows):
        """Joints too small to be seen even with the random poses, and whether those can tell."""
        self.write("measured.csv", rows, self.columns)
        judged = separability.judge(self.folder, self.simulate, scorer.key)
        self.optional = judged["optional"]
        return judged["class"]


def proposed_needed(case, first_poses, draw):
    """(poses needed, the verdicts on the way, all poses proposed)."""
    rows, poses, verdicts, asked = case.rows, first_poses, [], []
    for _ in range(MOST_PROPOSED // BATCH):
        asked += poses
        measured = case.measure(rows, poses, draw)
        for k in range(len(rows) + 1, len(measured) + 1):
            answer, further = case.diagnose(measured[:k])
            verdicts.append(answer["verdict"])
            if case.found(answer):
                return k - len(case.rows), verdicts, asked
        if not further:
            break
        rows, poses = measured, further[:BATCH]
    return math.inf, verdicts, asked


def random_needed(case, rows):
    for count in TRIED:
        if case.found(case.diagnose(rows[:len(case.rows) + count])[0]):
            return count
    return math.inf


def run_case(case, options):
    design, family, seed, arguments = case
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=options.keep or tempfile.gettempdir())
    row = {"design": design, "family": family, "seed": seed, "options": arguments}
    try:
        cell = Case(folder, family, seed, arguments, options.product, options.simulate)
        answer, poses = cell.diagnose(cell.rows)
        row["verdict"] = answer["verdict"]
        if not poses:
            return row
        row["rivals"] = sorted({e["id"] for e in answer["effects"] + answer["rivals"]})
        heaviest = max(float(r["payload_kg"]) for r in cell.rows)
        payloads = [0.0, heaviest / 2, heaviest]
        draw = np.random.default_rng([seed, zlib.crc32(f"{design} {family}".encode())])
        tables = [cell.measure(cell.rows, cell.random_poses(MOST_RANDOM, payloads, draw), draw)
                  for _ in range(options.draws)]
        row["class"] = cell.judge_with(tables[0])
        row["random"] = [random_needed(cell, table) for table in tables]
        row["proposed"], row["verdicts"], asked = proposed_needed(cell, poses, draw)
        row["payloads"] = sorted({float(p["payload_kg"]) for p in asked})
    except (RuntimeError, OSError, ValueError, KeyError, subprocess.TimeoutExpired) as error:
        row["error"] = f"{type(error).__name__}: {error}"
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    return row


def plan(seeds, first_seed):
    for k in range(seeds):
        for design, arguments in DESIGNS.items():
            for family in FAMILIES[design]:
                seed = first_seed + k
                draw = np.random.default_rng([seed, zlib.crc32(f"{design} {family}".encode())])
                robot = ROBOTS[(k + zlib.crc32(family.encode())) % len(ROBOTS)]
                yield design, family, seed, arguments + [
                    "--signal", f"{draw.uniform(8, 20):.3f}", "--robot", robot]


def ratio_of(pairs):
    """Median of the proposed over the median of the random ones; nan where neither is finite."""
    a, b = (statistics.median(v) for v in zip(*pairs))
    return a / b if math.isfinite(b) else (0.0 if math.isfinite(a) else math.nan)


def bounds(pairs, times=2000):
    draw = np.random.default_rng(1)
    drawn = [ratio_of([pairs[i] for i in draw.integers(0, len(pairs), len(pairs))])
             for _ in range(times)]
    drawn = sorted(r for r in drawn if not math.isnan(r))
    return (drawn[int(0.025 * len(drawn))], drawn[int(0.975 * len(drawn))]) if drawn else (math.nan,) * 2


def told(value):
    return "more than tried" if math.isinf(value) else f"{value:g}"


def line(name, rows):
    """Cases that random poses can tell at all, in the median of their draws or by the proposed."""
    pairs = [(r["proposed"], statistics.median(r["random"])) for r in rows]
    able = [p for p in pairs if math.isfinite(min(p))]
    missed = sum(math.isinf(p[0]) for p in able)
    text = f"| {name} | {len(rows)} | {len(pairs) - len(able)} | "
    if not able:
        return text + "- | - | - | - |\n"
    a, b = (statistics.median(v) for v in zip(*able))
    low, high = bounds(able)
    return text + f"{told(a)} | {told(b)} | {ratio_of(able):.2f} ({low:.2f} to {high:.2f}) | {missed} |\n"


def markdown(rows):
    compared = [r for r in rows if "proposed" in r]
    text = f"{len(compared)} of {len(rows)} runs ambiguous and compared.\n\n"
    text += ("| cases | count | told by neither | poses needed, proposed (median) | random (median) | "
             "ratio (95 %; wanted 0.5) | proposed told nothing |\n" + "|---" * 7 + "|\n")
    text += line("all", compared) if compared else ""
    for design in DESIGNS:
        for family in [None] + FAMILIES[design]:
            some = [r for r in compared if r["design"] == design and family in (None, r["family"])]
            if some:
                text += line(f"{design}: {family or 'all'}", some)
    return text


def main():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(root, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(root, "build/bin/plumbline-simulate"))
    parser.add_argument("--seeds", type=int, default=8, help="runs of each family and design")
    parser.add_argument("--first-seed", type=int, default=None, help="fresh by default")
    parser.add_argument("--draws", type=int, default=5, help="sets of random poses a case")
    parser.add_argument("--quick", action="store_true", help="one run of each, three draws")
    parser.add_argument("--family", action="append", help="only these families")
    parser.add_argument("--jobs", type=int, default=2, help="runs at once")
    parser.add_argument("--json", help="write every run here")
    parser.add_argument("--keep", help="keep the data sets in this folder")
    options = parser.parse_args()
    for program in (options.product, options.simulate):
        if not os.access(program, os.X_OK):
            sys.exit(f"next_poses.py: no program {program}; build it with ./dev build, or name it")
    if options.keep:
        os.makedirs(options.keep, exist_ok=True)
    if options.quick:
        options.seeds, options.draws = 1, 3
    first_seed = options.first_seed if options.first_seed is not None else int(time.time()) % 1000000
    cases = [c for c in plan(options.seeds, first_seed)
             if not options.family or c[1] in options.family]
    rows = []
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        for number, run in enumerate([pool.submit(run_case, c, options) for c in cases], 1):
            rows.append(run.result())
            if sys.stderr.isatty():
                print(f"\r{number}/{len(cases)}", end="", file=sys.stderr)
    print(f"Seeds from {first_seed}, {options.draws} random draws a case.\n\n" + markdown(rows))
    for r in rows:
        case = f"- --family {r['family']} --seed {r['seed']} {' '.join(r['options'])}: "
        if "error" in r:
            print(case + r["error"])
        elif "proposed" in r:
            print(case + f"proposed {told(r['proposed'])} (payloads {r['payloads']}), random "
                  f"{', '.join(map(told, r['random']))}; {r['class']} with the random ones; "
                  f"between {', '.join(r['rivals'])}")
    if options.json:
        with open(options.json, "w") as file:
            json.dump({"first_seed": first_seed, "runs": rows}, file, indent=1)


if __name__ == "__main__":
    main()
