#!/usr/bin/python3
"""Does the diagnosis name an effect exactly where the arm is measured on artefacts alone?

Simulated cells without an instrument: sockets in printed tools, a touched table with dial gauges, or
draw wires, all in unknown places, with an unknown tip; and the sockets again without their known
distances, and with one of them declared wrongly by 4 to 100 standard deviations. Whether the rows can
tell the hidden effect from another is judged as in separability.py, in what such rows see, with
places, tip and known distances as further unknowns. Goals: at least 90 % of the separable effects
named exactly; at most 1 % of all answers confidently wrong. A last line times 2,000 rows on
40 sockets: at most 3 s.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import groups  # noqa: E402
import runs  # noqa: E402
import scorer  # noqa: E402
import separability  # noqa: E402

KINDS = ("sockets", "gauges", "wires", "sockets without distances", "sockets, one distance wrong")
FAMILIES = ("none", "joint_offset", "joint_compliance", "gear_ratio", "link_geometry", "gear_periodic",
            "backlash_load", "backlash_move", "thermal_growth", "tool_stiffness", "pedestal_compliance",
            "tool_root_compliance")
ROBOTS = ("kr210", "ur10", "arm6")
SIGMA_MM, PRINTED_MM = 0.05, 0.05


class Observed(separability.Blocks):
    """Column blocks in what rows on artefacts see: the part of the tip's displacement along a normal or
    a ray, or all of it; then one more number for each known distance."""

    def __init__(self, heads, values, rows, truth, tips):
        super().__init__(heads, values, rows)
        self.sigma_mm = 1e3 * truth["sigma"]
        self.artefacts = {a["name"]: a for a in truth["artefacts"]}
        self.row_of, self.along, self.own = [], [], []
        for number, (row, tip) in enumerate(zip(rows, tips)):
            artefact = self.artefacts[row["artefact"]]
            away = tip - np.array(artefact["xyz_mm"])
            normal = np.array(artefact["direction"])
            if row.get("range_mm"):
                lines, places = [away / np.linalg.norm(away)], "point"
            elif artefact["kind"] == "point":
                lines, places = list(np.eye(3)), "point"
            else:
                lines, places = [normal], "plane"
            for line in lines:
                self.row_of.append(number)
                self.along.append(line)
                self.own.append((artefact["name"], line if places == "point" else np.concatenate(
                    [[1.0], np.delete(away, np.argmax(np.abs(normal))) / 1e3])))
        self.row_of, self.along = np.array(self.row_of), np.array(self.along)
        self.pairs = truth["pairs"]
        self.columns = {key: self.seen(value) for key, value in self.columns.items()}
        self.t = np.concatenate([self.t[3 * self.row_of], np.full(len(self.pairs), -1.0)])
        self.session = np.concatenate([self.session[3 * self.row_of], [""] * len(self.pairs)])

    def seen(self, displacement_mm):
        of_rows = np.asarray(displacement_mm).reshape(-1, 3)[self.row_of]
        return np.concatenate([np.sum(of_rows * self.along, axis=1), np.zeros(len(self.pairs))])

    def nuisances(self):
        columns = [self.stack("tool_frame")]
        first = {}
        for name in self.artefacts:
            own = [k for k, (of, _) in enumerate(self.own) if of == name]
            if not own:
                continue
            block = np.zeros((len(self.t), 3))
            block[own] = [self.own[k][1] for k in own]
            first[name] = block
        for number, (a, b) in enumerate(self.pairs):
            apart = np.array(self.artefacts[b]["xyz_mm"]) - np.array(self.artefacts[a]["xyz_mm"])
            apart *= self.sigma_mm / PRINTED_MM / np.linalg.norm(apart)
            if a in first and b in first:
                first[a][len(self.row_of) + number] = -apart
                first[b][len(self.row_of) + number] = apart
        return np.hstack(columns + list(first.values()))


def judge(folder, simulate, truth):
    """separability.judge for a data set on artefacts."""
    if not truth["effects"]:
        return {"class": "none", "optional": []}
    place = lambda name: os.path.join(folder, name)
    rows = separability.table(place("measured.csv"))

    def tips(effects):
        with open(place("with.json"), "w") as file:
            json.dump({"effects": effects, "nuisances": []}, file)
        subprocess.run([simulate, "--predict", "--with", place("with.json"), "--cell",
                        place("cell.toml"), "--poses", place("poses.csv"), "--out", place("tips.csv")],
                       check=True)
        return separability.points(place("tips.csv"))

    # The simulator reads joints and conditions only.
    kept = [name for name in rows[0] if name not in ("artefact", "gauge_mm", "range_mm")]
    with open(place("poses.csv"), "w") as file:
        file.write("\n".join([",".join(kept)] + [",".join(r[n] for n in kept) for r in rows]) + "\n")
    still = tips([])
    cycles = set(separability.CYCLES)
    for effect in truth["effects"]:
        cycles |= {p["value"] for p in effect["parameters"] if p["name"].endswith("_cycles")}
    moved = [tips([effect]) - still for effect in truth["effects"]]
    tips([])
    subprocess.run([simulate, "--columns", "--cell", place("cell.toml"), "--measured",
                    place("poses.csv"), "--with", place("with.json"), "--out", place("columns"),
                    "--cycles", ",".join(f"{c:g}" for c in sorted(cycles))], check=True)
    blocks = Observed(*separability.read_columns(place("columns")), rows, truth, still)
    keys = [scorer.key(effect) for effect in truth["effects"]]
    return separability.judge_blocks({**truth, "unaligned": True}, keys, blocks,
                                     [blocks.seen(field) for field in moved], 1e3 * truth["sigma"])


def simulated(simulate, folder, kind, family, robot, seed, count, signal, places):
    subprocess.run([simulate, "--artefacts", kind, "--tool-unknown", "--family", family, "--robot", robot,
                    "--seed", str(seed), "--rows", str(count), "--repeats", "0", "--tests", "50",
                    "--places", str(places), "--signal", f"{signal:.3f}", "--sigma-mm",
                    str(groups.SIGMA_MM.get(family, SIGMA_MM)),  # for a believable size of the effect
                    "--out", folder], check=True, capture_output=True)
    with open(os.path.join(folder, "truth.json")) as file:
        return json.load(file)


def with_distances(text, changed):
    """cell.toml with its known distances replaced: changed(distances in mm) -> distances or None."""
    tables = re.split(r"(?m)^(?=\[)", text)
    at = [k for k, table in enumerate(tables) if table.startswith("[[distance]]")]
    values = changed([float(re.search(r"value_mm = ([-0-9.e]+)", tables[k]).group(1)) for k in at])
    for k, value in zip(at, values):
        tables[k] = "" if value is None else re.sub(r"value_mm = .*", f"value_mm = {value}", tables[k])
    return "".join(tables)


def change_distances(kind, folder, random, truth):
    """Edits the cell as the kind of set says, and notes which pairs of sockets have a true distance."""
    truth["pairs"] = [(a["name"], a["name"][:-1] + "1") for a in truth["artefacts"]
                      if a["name"].startswith("tool") and a["name"].endswith("_0")]
    if kind == KINDS[3]:
        truth["pairs"] = []
        changed = lambda values: [None] * len(values)
    elif kind == KINDS[4]:
        wrong = int(random.integers(len(truth["pairs"])))
        del truth["pairs"][wrong]
        error = random.choice([-1, 1]) * PRINTED_MM * np.exp(random.uniform(np.log(4), np.log(100)))
        changed = lambda values: [v + error * (k == wrong) for k, v in enumerate(values)]
    else:
        return
    path = os.path.join(folder, "cell.toml")
    with open(path) as file:
        text = with_distances(file.read(), changed)
    with open(path, "w") as file:
        file.write(text)


def diagnosed(product, folder):
    begin = time.monotonic()
    subprocess.run([product, "diagnose", os.path.join(folder, "cell.toml"),
                    os.path.join(folder, "measured.csv"), "--json", os.path.join(folder, "d.json")],
                   check=True, capture_output=True, timeout=300)
    with open(os.path.join(folder, "d.json")) as file:
        return json.load(file), time.monotonic() - begin


def run_case(case, product, simulate, keep):
    kind, family, robot, seed = case
    random = np.random.default_rng([seed, KINDS.index(kind), ROBOTS.index(robot), len(family)])
    count, signal = int(random.integers(120, 260)), float(np.exp(random.uniform(1.6, 3.4)))
    folder = tempfile.mkdtemp(prefix=f"{kind}-{family}-{seed}-", dir=keep or None)
    row = {"group": kind, "family": family, "robot": robot, "seed": seed, "rows": count,
           "signal": signal}
    try:
        truth = simulated(simulate, folder, kind.split()[0].strip(","), family, robot, seed, count,
                          signal, 6)
        change_distances(kind, folder, random, truth)
        judged = judge(folder, simulate, truth)
        answer, row["seconds"] = diagnosed(product, folder)
        row.update({k: judged.get(k) for k in ("distance", "nearest")})
        row.update(scorer.judge_answer(answer, {**truth, "unaligned": True}, judged))
    except (subprocess.SubprocessError, OSError, ValueError, KeyError) as error:
        row.update(kind="error", right=False, wrong=False,
                   error=str(error) + str(getattr(error, "stderr", "") or "")[-300:])
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    return row


def line(title, rows):
    clear = [r for r in rows if r["kind"] == "separable"]
    named = sum(r["named"] for r in clear)
    wrong = sum(bool(r["wrong"]) for r in rows)
    low, high = scorer.wilson(named, len(clear))
    of_wrong = scorer.wilson(wrong, len(rows))
    share = 100 * named / len(clear) if clear else float("nan")
    return (f"| {title} | {len(rows)} | {len(clear)} | {share:.0f} % ({100 * low:.0f}..{100 * high:.0f}) | "
            f"{100 * wrong / len(rows):.1f} % ({100 * of_wrong[0]:.1f}..{100 * of_wrong[1]:.1f}) | "
            f"{100 * np.mean([bool(r['right']) for r in rows]):.0f} % | "
            f"{np.median([r.get('seconds', np.nan) for r in rows]):.1f} |")


def time_many(product, simulate):
    with tempfile.TemporaryDirectory() as folder:
        simulated(simulate, folder, "sockets", "joint_compliance", "kr210", 1, 2000, 10, 20)
        return min(diagnosed(product, folder)[1] for _ in range(3))


def main():
    options = runs.parse(runs.parser(__doc__, seeds=4, jobs=2, quick="one seed, one robot"))
    seeds = range(options.first_seed, options.first_seed + (1 if options.quick else options.seeds))
    cases = [(kind, family, robot, seed) for kind in KINDS for family in FAMILIES
             for robot in (ROBOTS[:1] if options.quick else ROBOTS) for seed in seeds
             if not options.family or family in options.family]
    rows = runs.run_all(options.jobs, run_case, cases, options.product, options.simulate, options.keep)
    print("| measured on | sets | separable | named exactly (goal 90 %) | confidently wrong (goal 1 %) | "
          "right | median s |\n|---|---|---|---|---|---|---|")
    for kind in KINDS:
        print(line(kind, [r for r in rows if r["group"] == kind]))
    print(line("all", rows))
    for r in rows:
        if not r["right"]:
            print(f"{r['group']} {r['family']} {r['robot']} {r['seed']} rows {r['rows']} signal "
                  f"{r['signal']:.1f}: {r['kind']}, {r.get('verdict', r.get('error'))}, answer "
                  f"{r.get('answer')}, truth {r.get('truth')}, nearest {r.get('nearest')} at "
                  f"{r.get('distance')}", file=sys.stderr)
    if not options.family:
        print(f"\n2,000 rows on 40 sockets: {time_many(options.product, options.simulate):.1f} s "
              "(goal 3)")
    if options.json:
        with open(options.json, "w") as file:
            json.dump(rows, file, indent=1, default=str)
    return 0


if __name__ == "__main__":
    sys.exit(main())
