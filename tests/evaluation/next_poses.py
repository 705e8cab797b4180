#!/usr/bin/python3
"""Scores the poses that an ambiguous diagnosis proposes: how many of them separate the rivals, beside
poses drawn at random.

Each case is drawn with few freedoms (one payload and rigid joints; a vertical tool; twelve poses,
at rest or in motion).
Where the diagnosis is ambiguous, its proposed poses are measured by the simulator and appended one
after the other until the answer is the hidden effect alone and stays so with the next two poses;
every six poses the diagnosis proposes anew. Random poses are appended likewise, drawn from the same
range: joints within the measured range, widened as the product widens it, no tip lower than any
before, at the payloads that were measured or proposed, each a minute after the one before and
reached directly from it. A proposed wait passes, and a proposed via pose (measure = 0) is driven to
without being measured. Where motion is recorded, random poses, and proposed ones that leave it open,
have that of a row drawn from the case. Both are tried to 24 poses; a case that neither separates by then is counted
apart. Of a case that one random pose separates nothing can need half: they are listed, and the ratio
without them is printed, too.

    next_poses.py --results FILE --comparable 60 --cases 10     once and again, until it says enough
"""

import csv
import itertools
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import zlib

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402  (after the thread limits)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import runs  # noqa: E402
import scorer  # noqa: E402
import separability  # noqa: E402

DESIGNS = {"one payload, rigid joints": ["--one-payload", "--rigid-joints"],
           "vertical tool, one payload": ["--vertical"],
           "twelve poses": ["--rows", "12", "--repeats", "4"],
           "twelve poses, moves and time": ["--rows", "12", "--repeats", "4"],
           "twelve poses in motion": ["--rows", "12", "--repeats", "4", "--dyn"]}
FAMILIES = {"one payload, rigid joints": ["tool_stiffness", "payload_mass", "tool_root_compliance"],
            "vertical tool, one payload": ["tool_stiffness", "tool_root_compliance", "counterbalance",
                                           "joint_compliance"],
            "twelve poses": ["joint_offset", "gear_ratio", "joint_compliance", "tool_stiffness",
                             "tool_root_compliance", "payload_mass", "backlash_load"],
            "twelve poses, moves and time": ["backlash_move", "approach_lag", "following_error",
                                             "thermal_drift", "step_event"],
            "twelve poses in motion": ["latency", "dynamic_inertia"]}
ROBOTS = ["kr210", "ur10", "arm6"]
SIGNAL = 1.2, 5.0  # RMS displacement over sqrt(3) sigma, even in its logarithm
BATCH, MOST, STAYS = 6, 24, 2
TRIED = [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 24]
WIDENED, LEAST_DEG = 0.25, 5.157  # of a joint's measured range, as in pose_candidates.cc
STEP_S, JITTER_C = 60.0, 0.35
MEASURED = ("x_mm", "y_mm", "z_mm")


def measurements(proposed):
    """The rows of next_poses.csv that are measured; each holds the via pose before it, if any."""
    rows, before = [], None
    for row in proposed:
        if row.get("measure", "1") == "0":
            before = row
            continue
        if before:
            row = row | {"before": before, "wait_min": before.get("wait_min")}
        rows.append(row)
        before = None
    return rows


def with_via_rows(rows):
    """The rows as the robot goes: via poses stand before what they lead to, without a measurement."""
    way = []
    for row in rows:
        if "before" in row:
            way.append(row | row["before"] | {"via": True} | {c: "" for c in MEASURED})
        way.append(row)
    return way


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
        self.motion = [c for c in self.columns if c.startswith("qd")]
        self.limits = np.array(self.read_limits())
        # Whether a joint's share is large enough to be named is not what is asked here.
        self.joints_of_truth = [sorted(scorer.key(e)[1]) for e in self.truth["effects"]]
        self.answers = {}

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
        """`before` and the poses after it: a minute and what is to be waited apart, at the hall's last
        temperature."""
        rows = [dict(row) for row in before]
        warm = float(np.mean([float(r["temp_C"]) for r in self.rows[-5:]]))
        t_s = float(rows[-1]["t_s"])
        for pose in poses:
            row = dict(pose)
            t_s += STEP_S + 60.0 * float(row.get("wait_min") or 0)
            moving = self.rows[draw.integers(len(self.rows))] if self.motion else {}
            row = {c: moving[c] for c in self.motion} | row
            row["t_s"] = f"{t_s:.5f}"
            row["temp_C"] = f"{warm + JITTER_C * draw.normal():.5f}"
            rows.append(row)
        asked = [c for c in self.columns if c not in MEASURED]
        self.write("asked.csv", with_via_rows(rows), asked)
        self.run(self.simulate, "--predict", "--with", self.place("truth.json"), "--cell",
                 self.place("cell.toml"), "--poses", self.place("asked.csv"), "--out",
                 self.place("tips.csv"))
        tips = [tip for row, tip in zip(with_via_rows(rows), separability.points(self.place("tips.csv")))
                if not row.get("via")][len(before):]
        for row, tip in zip(rows[len(before):], tips):
            noisy = tip + self.truth["sigma"] * 1e3 * draw.normal(size=3)
            row.update({c: f"{v:.5f}" for c, v in zip(MEASURED, noisy)})
        return rows

    def diagnose(self, rows):
        """(answer, proposed poses)"""
        key = tuple((r["t_s"], r["x_mm"], r["y_mm"], r["z_mm"]) for r in rows)
        if key not in self.answers:
            self.answers[key] = self.ask(rows)
        return self.answers[key]

    def ask(self, rows):
        self.write("all.csv", with_via_rows(rows), self.columns)
        poses = self.place("next.csv")
        if os.path.exists(poses):
            os.remove(poses)
        self.run(self.product, "diagnose", self.place("cell.toml"), self.place("all.csv"), "--json",
                 self.place("diagnosis.json"), "--next-poses", poses, "--threads", "1", "--quiet")
        with open(self.place("diagnosis.json")) as file:
            answer = json.load(file)
        return answer, measurements(separability.table(poses)) if os.path.exists(poses) else []

    def found(self, rows):
        """The hidden effect alone, or beside nothing but its other names; no joint too many."""
        answer, _ = self.diagnose(rows)
        if not scorer.same_effects(answer["effects"], self.truth, {"optional": self.joints_of_truth}):
            return False
        return answer["verdict"] == "explained" or (
            answer["verdict"] == "ambiguous" and scorer.only_equivalents(answer, self.truth))

    def random_poses(self, count, payloads, draw):
        """From the pool that the proposals come from."""
        q = np.array([[float(r[c]) for c in self.joints] for r in self.rows])
        low, high = q.min(0), q.max(0)
        wider = np.maximum(LEAST_DEG, WIDENED * (high - low))
        low = np.minimum(low, np.maximum(low - wider, self.limits[:, 0]))
        high = np.maximum(high, np.minimum(high + wider, self.limits[:, 1]))
        lowest_mm = min([0.0] + [float(r["z_mm"]) for r in self.rows])  # the simulator's base is at 0
        poses = []
        while len(poses) < count:
            some = []
            for at in draw.uniform(low, high, (2 * count, len(low))):
                pose = {c: f"{v:.5f}" for c, v in zip(self.joints, at)}
                pose["payload_kg"] = f"{draw.choice(payloads):.5f}"
                some.append(pose)
            measured = self.measure(self.rows, some, np.random.default_rng(0))[len(self.rows):]
            poses += [p for p, m in zip(some, measured) if float(m["z_mm"]) >= lowest_mm]
        return poses[:count]


def stays_found(case, rows, count):
    """Found with `count` of the rows beyond the case's own, and with the next two."""
    own = len(case.rows)
    return all(case.found(rows[:own + count + k]) for k in range(STAYS + 1))


def random_needed(case, rows):
    # What is found neither with a third of the poses, nor with two, nor with all, is not searched.
    if not any(case.found(rows[:len(case.rows) + MOST * k // 3]) for k in (3, 2, 1)):
        return math.inf
    return next((n for n in TRIED if stays_found(case, rows, n)), math.inf)


def proposed_needed(case, poses, spare, draw):
    """Poses needed, and why it ended. The poses after those of a batch, which only show that the
    answer stays, are random ones."""
    rows, asked = case.rows, []
    while len(asked) < MOST:
        batch = poses[:BATCH]
        measured = case.measure(rows, batch + spare, draw)
        first, last = len(asked) + 1, len(asked) + len(batch)
        # As with random poses: what is found neither with half of the batch nor with all of it, nor
        # with its first pose, is not searched.
        hopeful = any(case.found(measured[:len(case.rows) + n])
                      for n in {last, (first + last) // 2, first})
        for n in range(first, last + 1):
            if hopeful and n in TRIED and stays_found(case, measured, n):
                return n, "separated"
        asked += batch
        rows = measured[:len(case.rows) + len(asked)]
        answer, poses = case.diagnose(rows)
        if not poses:
            return math.inf, f"{answer['verdict']}, no further pose proposed"
    return math.inf, "limit"


def payloads_seen(rows):
    payloads = sorted({float(r["payload_kg"]) for r in rows})
    return payloads if len(payloads) <= 3 else [payloads[0], payloads[len(payloads) // 2], payloads[-1]]


def run_case(case, options):
    design, family, seed, arguments = case
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=options.keep or tempfile.gettempdir())
    row = {"design": design, "family": family, "seed": seed, "options": arguments}
    try:
        cell = Case(folder, family, seed, arguments, options.product, options.simulate)
        answer, poses = cell.diagnose(cell.rows)
        row["verdict"] = answer["verdict"]
        if answer["verdict"] != "ambiguous" or scorer.only_equivalents(answer, cell.truth):
            return row
        row["rivals"] = sorted({e["id"] for e in answer["effects"] + answer["rivals"]})
        row["among"] = scorer.truth_among(answer, cell.truth, {"optional": cell.joints_of_truth})
        payloads = sorted(set(payloads_seen(cell.rows)) | {float(p["payload_kg"]) for p in poses})
        row["payloads"] = payloads
        draw = np.random.default_rng([seed, zlib.crc32(f"{design} {family}".encode())])
        tables = [cell.measure(cell.rows, cell.random_poses(MOST + STAYS, payloads, draw), draw)
                  for _ in range(options.draws)]
        spare = cell.random_poses(STAYS, payloads, draw)
        if poses:
            row["proposed"], row["end"] = proposed_needed(cell, poses, spare, draw)
        else:
            row["proposed"], row["end"] = math.inf, "none proposed"
        row["random"] = [random_needed(cell, table) for table in tables]
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
                    "--signal", f"{math.exp(draw.uniform(*np.log(SIGNAL))):.3f}", "--robot", robot]


def ratios(pairs):
    """(of the medians, of the means with 24 for what was not separated) of proposed over random."""
    a, b = (np.minimum(values, MOST) for values in zip(*pairs))
    return float(np.median(a) / np.median(b)), float(np.mean(a) / np.mean(b))


def bounds(pairs, times=2000):
    """95 % of both ratios, by the bootstrap over cases."""
    draw = np.random.default_rng(1)
    drawn = [ratios([pairs[i] for i in draw.integers(0, len(pairs), len(pairs))])
             for _ in range(times)]
    return [tuple(np.percentile([d[k] for d in drawn], [2.5, 97.5])) for k in (0, 1)]


def count(value):
    return f"> {MOST}" if value > MOST else f"{value:g}"


def line(name, pairs):
    able = [p for p in pairs if math.isfinite(min(p))]
    text = f"| {name} | {len(pairs)} | {len(pairs) - len(able)} | "
    if not able:
        return text + "- | - | - | - | - |\n"
    a, b = (statistics.median(v) for v in zip(*able))
    (of_medians, of_means), limits = ratios(able), bounds(able)
    half = sum(p[0] <= p[1] / 2 for p in able)
    low, high = scorer.wilson(half, len(able))
    return text + (f"{count(a)} | {count(b)} | {of_medians:.2f} ({limits[0][0]:.2f} to {limits[0][1]:.2f}) | "
                   f"{of_means:.2f} ({limits[1][0]:.2f} to {limits[1][1]:.2f}) | "
                   f"{half}/{len(able)} ({100 * low:.0f} to {100 * high:.0f} %) |\n")


def markdown(rows):
    compared = [r for r in rows if "random" in r]
    text = f"{len(compared)} of {len(rows)} runs ambiguous and compared.\n\n"
    text += ("| cases | count | separated by neither | of the others: proposed (median) | random (median) | "
             "ratio of medians (95 %; wanted 0.5) | ratio of means | at most half |\n" + "|---" * 8 + "|\n")
    pairs_of = lambda some: [(r["proposed"], statistics.median(r["random"])) for r in some]
    text += line("all", pairs_of(compared))
    text += line("those that one random pose does not separate", [p for p in pairs_of(compared) if p[1] > 1])
    text += line("those that one random pose separates", [p for p in pairs_of(compared) if p[1] <= 1])
    for design in DESIGNS:
        for family in [None] + FAMILIES[design]:
            some = [r for r in compared if r["design"] == design and family in (None, r["family"])]
            if some:
                text += line(f"{design}: {family or 'all'}", pairs_of(some))
    return text


def comparable(rows):
    """Runs that were ambiguous and separated by proposed or by random poses: those that a ratio is of."""
    return [r for r in rows if "random" in r
            and math.isfinite(min(r["proposed"], statistics.median(r["random"])))]


def cases_left(options, results):
    """Cases in the order of their seeds, without those that are in the results."""
    done = {(r["design"], r["family"], r["seed"]) for r in results.rows}
    for case in plan(10000 if options.comparable else options.seeds, results.settings["first_seed"]):
        if case[:3] in done or (options.design and case[0] not in options.design):
            continue
        if not options.family or case[1] in options.family:
            yield case


def evaluate(options, results):
    """Runs cases until there are enough."""
    left = cases_left(options, results)
    if options.cases:
        left = itertools.islice(left, options.cases)

    def until_enough():
        for case in left:
            if options.comparable and len(comparable(results.rows)) >= options.comparable:
                return
            yield case

    for row in runs.run_each(options.jobs, run_case, until_enough(), options):
        results.add(row)


def listed_cases(rows):
    text = ""
    for r in rows:
        case = f"- --family {r['family']} --seed {r['seed']} {' '.join(r['options'])}: "
        if "error" in r:
            text += case + r["error"] + "\n"
        elif "random" in r:
            text += (case + f"proposed {count(r['proposed'])} ({r['end']}), random "
                     f"{', '.join(map(count, r['random']))}; payloads {r['payloads']}; between "
                     f"{', '.join(r['rivals'])}{'' if r['among'] else ', the hidden one not among them'}\n")
    return text


def main():
    parser = runs.parser(__doc__, 8, 2, "one run of each, three draws")
    parser.add_argument("--draws", type=int, default=5, help="sets of random poses a case")
    parser.add_argument("--results", help="a file that keeps every finished run; those in it are not "
                        "run again, its first seed is taken")
    parser.add_argument("--design", action="append", choices=list(DESIGNS), help="only these designs")
    parser.add_argument("--comparable", type=int, help="run until so many cases can be compared, "
                        "whatever --seeds says")
    parser.add_argument("--cases", type=int, help="run at most so many cases now")
    options = runs.parse(parser)
    if options.quick:
        options.seeds, options.draws = 1, 1 if options.smoke else 3
    resumed = options.results and os.path.exists(options.results)
    results = runs.Results(options.results, {"draws": options.draws,
                                             "first_seed": None if resumed else options.first_seed})
    evaluate(options, results)
    rows = sorted(results.rows, key=lambda r: r["seed"])
    print(f"Seeds from {results.settings['first_seed']}, {options.draws} random draws a case.\n\n" +
          markdown(rows) + "\n" + listed_cases(rows))
    if options.comparable:
        print(f"{len(comparable(rows))} of the {options.comparable} comparable cases asked for.")
    if options.json:
        with open(options.json, "w") as file:
            json.dump({"first_seed": results.settings["first_seed"], "runs": rows}, file, indent=1)


if __name__ == "__main__":
    main()
