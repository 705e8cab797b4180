#!/usr/bin/python3
"""Robot programs corrected by `plumbline program`: whether the loaded tool lands where they say.

    programs.py --product build/bin/plumbline          the programs of every brand in program_brands: each is
                                                       corrected; the original and the corrected files are run
                                                       by an interpreter of the tests; the arm, loaded by
                                                       loaded_arm.py, is compared with what the original asks for
    programs.py --brand krl --program circle           only these
    programs.py --public FOLDER                        other people's programs below a folder: every point
                                                       corrected once or listed with a reason, no other byte changed

Goals: at the points 1 um and 1e-6 rad for the numbers before rounding, 0.05 mm for those in the file;
between the points 0.1 mm with `--insert 0.1`; no byte changed but numbers on lines of corrected points
and the mark; a second run and a rigid arm change nothing. The exit code is 1 if one is missed.
"""

import argparse
import collections
import importlib
import json
import os
import re
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
from program_brands.common import Robot, Tool, apart, on_path, pose  # noqa: E402
from runs import ROOT  # noqa: E402

BRANDS = ("urscript", "krl", "rapid", "fanuc", "jbi", "pose_table")
EXACT_M, EXACT_RAD = 1e-6, 1e-6
WRITTEN_M, BETWEEN_M = 5e-5, 1e-4
OFFSET_M = 2e-5  # --offset-bound of the product, for points that are used with several offsets
SAMPLES = 6      # of a linear or circular motion
NUMBER = re.compile(rb" *[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
POINT_LINES = 12  # a point may be written over so many lines
SUFFIXES = {".src": "kuka", ".dat": "kuka", ".mod": "abb", ".prg": "abb", ".sys": "abb", ".ls": "fanuc",
            ".script": "ur", ".urscript": "ur", ".urp": "ur", ".jbi": "yaskawa"}


def write(folder, files):
    os.makedirs(folder, exist_ok=True)
    for name, data in files.items():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)
    return [os.path.join(folder, name) for name in files]


def read(folder, names):
    """The files of these names; those that are not there are left out."""
    found = {}
    for name in names:
        path = os.path.join(folder, name)
        if os.path.exists(path):
            with open(path, "rb") as file:
                found[name] = file.read()
    return found


def correct(product, cell, paths, output, options=()):
    """(exit code, report or None, messages)"""
    done = subprocess.run([product, "program", cell, *paths, "--output", output, "--json", *options],
                          capture_output=True, timeout=600)
    try:
        report = json.loads(done.stdout)
    except ValueError:
        report = None
    return done.returncode, report, done.stderr.decode("utf8", "replace")


def without_mark(old, new):
    """`new` without the comment line that names the product, if `old` has none."""
    lines = new.splitlines(keepends=True)
    kept = [line for line in lines if b"plumbline" not in line.lower() or line in old]
    return b"".join(kept) if len(lines) - len(kept) == 1 else new


def foreign_changes(old, new, lines):
    """What differs beside numbers on `lines` and the lines after them: texts."""
    new = without_mark(old, new)
    allowed = {line + k for line in lines for k in range(POINT_LINES)}
    a, b = list(NUMBER.finditer(old)), list(NUMBER.finditer(new))
    faults = []
    pieces = lambda data, numbers: [data[i.end():j] for i, j in zip(
        [re.match(rb"", data), *numbers], [*[n.start() for n in numbers], len(data)])]
    if len(a) != len(b) or pieces(old, a) != pieces(new, b):
        at = next((i for i, (x, y) in enumerate(zip(old, new)) if x != y), min(len(old), len(new)))
        return [f"bytes beside numbers differ, or a number was added: first difference in line "
                f"{old.count(bytes([10]), 0, at) + 1}"]
    for x, y in zip(a, b):
        if x[0] == y[0]:
            continue
        line = old.count(b"\n", 0, x.start()) + 1
        if line not in allowed:
            faults.append(f"line {line}: {x[0].decode()} became {y[0].decode()}, which is no corrected "
                          "point")
    return faults


def lines_of(report, name):
    return [p["line"] for p in report["corrected"] if os.path.basename(p["file"]) == name]


def load_of(motion):
    mass = motion.mass + motion.tool_mass
    cog = (motion.mass * motion.cog + motion.tool_mass * motion.tool_cog) / mass if mass else np.zeros(3)
    return mass, cog


class Run:
    """Motions with the readings that a controller chooses for them, and where the loaded tool lands."""

    def __init__(self, robot, motions, start):
        self.motions, self.q, self.landed, self.faults = motions, [], [], []
        previous = start
        for k, motion in enumerate(motions):
            # Where a program starts nobody knows: its first motion is in the posture that it states.
            q = robot.solve(motion, previous, followed=k > 0)
            if q is None and motion.left:
                q = previous
            elif q is None:
                self.faults.append(f"{motion.file}:{motion.line}: no posture reaches the target")
                q = previous
            self.q.append(q)
            self.landed.append(robot.landed(q, motion.tool, *load_of(motion)))
            previous = q


def deviation(robot, original, k, commanded, steps):
    """Largest distance of the landings between the points of motion k from its programmed path.
    `steps` are the corrected motions that replace it, after the corrected motion before it."""
    motion = original.motions[k]
    start = original.motions[k - 1].target
    ideal = np.array([on_path(motion.kind, start, motion.via, motion.target, s)[:3, 3]
                      for s in np.linspace(0, 1, 401)])
    worst = 0.0
    for before, now in zip(steps, steps[1:]):
        part = commanded.motions[now]
        q = commanded.q[before]
        A = commanded.motions[before].target if commanded.motions[before].joints is None else \
            robot.flange(q) @ part.tool
        for s in np.linspace(0, 1, SAMPLES + 2)[1:-1]:
            X = on_path(part.kind, A, part.via, part.target, s)
            q = robot.solve(part, q, target=X) if part.kind != "joint" else None
            if q is None:
                return np.inf
            landed = robot.landed(q, part.tool, *load_of(part))[:3, 3]
            i = np.argmin(np.linalg.norm(ideal - landed, axis=1))
            a, b = ideal[max(i - 1, 0)], ideal[min(i + 1, 400)]
            along = np.clip((landed - a) @ (b - a) / max((b - a) @ (b - a), 1e-18), 0, 1)
            worst = max(worst, np.linalg.norm(landed - a - along * (b - a)))
    return worst


def matched(original, commanded):
    """Index of the corrected motion that ends each original one; inserted motions lie between."""
    if len(original.motions) == len(commanded.motions):
        return list(range(len(original.motions)))
    ends, j = [], 0
    for k, motion in enumerate(original.motions):
        left = len(original.motions) - k - 1
        while j < len(commanded.motions) - left - 1 and (
                commanded.motions[j].kind != motion.kind and commanded.motions[j].kind == "linear"
                or apart(commanded.landed[j] if not motion.left else commanded.motions[j].target,
                         motion.target)[0] > 3e-4):
            j += 1
        ends.append(j)
        j += 1
    return ends


Result = collections.namedtuple("Result", "exact_m exact_rad written_m between_m points before_m faults")


def evaluate(product, brand, name, files, folder):
    robot, faults = Robot(brand.ARM), []
    tools = list(brand.TOOLS)
    options = list(getattr(brand, "OPTIONS", {}).get(name, []))
    if hasattr(brand, "START"):
        options += ["--start", "joints=" + ",".join("%.6f" % v for v in np.degrees(brand.START))]
    cell, stiff = os.path.join(folder, "cell.toml"), os.path.join(folder, "stiff.toml")
    write(folder, {"cell.toml": robot.cell_text(tools).encode(),
                   "stiff.toml": Robot(brand.ARM, stiff=True).cell_text(tools).encode()})
    paths = write(os.path.join(folder, "old"), files)
    new_folder = os.path.join(folder, "new")
    code, report, messages = correct(product, cell, paths, new_folder, options)
    nothing = Result(np.inf, np.inf, np.inf, np.inf, 0, 0, [f"exit code {code}: {messages.strip()}"])
    if code not in (0, 1) or report is None:
        return nothing
    new = read(new_folder, files)
    if code == 0 and not new:
        return nothing._replace(faults=["no file was written"])
    new = {**files, **new}  # a file of which no digit changes is not written
    for file, old in files.items():
        faults += [f"{file}: {text}" for text in foreign_changes(old, new[file], lines_of(report, file))]

    start = (robot.low.clip(-3, 3) + robot.high.clip(-3, 3)) / 2
    start = getattr(brand, "START", start)
    original = Run(robot, brand.execute(files), start)
    for motion in original.motions:  # used with several offsets
        motion.shared = motion.shared or any(
            (m.file, m.line) == (motion.file, motion.line) and apart(m.target, motion.target)[0] > 1e-9
            for m in original.motions)
    commanded = Run(robot, brand.execute(new), start)
    faults += commanded.faults
    if len(original.motions) != len(commanded.motions):
        return nothing._replace(faults=["the corrected program makes another number of motions"])

    # Before rounding: the joints that the report gives land somewhere that the program names. Whole
    # turns do not count: which one a linear motion ends in depends on its start.
    exact_m = exact_rad = written_m = before_m = 0.0
    points = 0
    posed = [np.radians(p["posture_corrected"]) for p in report["corrected"]]
    for k, motion in enumerate(original.motions):
        now = commanded.motions[k]
        if motion.left:
            if motion.left != "computed" and apart(motion.target, now.target)[0] > 1e-12:
                faults.append(f"{motion.file}:{motion.line}: changed, but should be left ({motion.left})")
            continue
        points += 1
        before_m = max(before_m, apart(original.landed[k], motion.target)[0])
        written = apart(commanded.landed[k], motion.target)
        written_m = max(written_m, written[0])
        if written[0] > WRITTEN_M:
            faults.append(f"{motion.file}:{motion.line}: lands {written[0] * 1e3:.4f} mm away"
                          + "".join(f"; {p['name']} of line {p['line']} is left: {p['reason']}"
                                    for p in report["left"][:3]))
        lands = [apart(robot.landed(q, motion.tool, *load_of(motion)), motion.target)
                 for q in posed if np.abs(np.sin((q - commanded.q[k]) / 2)).max() < 1e-3]
        near = min(lands, default=(np.inf, np.inf), key=lambda d: d[0] + d[1])
        # A point that is used with several offsets has the exact correction of one of them.
        if (motion.shared or not lands and any(m.shared for m in original.motions)) \
                and written[0] < OFFSET_M:
            near = (0.0, 0.0)
        exact_m, exact_rad = max(exact_m, near[0]), max(exact_rad, near[1])
        if near[0] > EXACT_M or near[1] > EXACT_RAD:
            faults.append(f"{motion.file}:{motion.line}: before rounding {near[0] * 1e6:.2f} um, "
                          f"{near[1]:.1e} rad away ({len(lands)} points of the report in this posture)")

    # Between the points, refined.
    between_m = between(product, brand, robot, cell, paths, files, options, original, start, folder,
                        faults)

    # A second run, and an arm that does not deflect.
    again = os.path.join(folder, "again")
    at_hand = [next(p for p in (os.path.join(new_folder, n), os.path.join(folder, "old", n))
                    if os.path.exists(p)) for n in files]
    code, _, messages = correct(product, cell, at_hand, again, options)
    if code != 0 or any(data != new[n] for n, data in read(again, files).items()) \
            or {**files, **read(new_folder, files)} != new:
        faults.append(f"a second run changes something, or fails: exit code {code} {messages.strip()}")
    code, report, messages = correct(product, stiff, paths, os.path.join(folder, "same"), options)
    same = read(os.path.join(folder, "same"), files)
    if code not in (0, 1) or any(same.get(n, data) != data for n, data in files.items()):
        faults.append(f"a rigid arm changes bytes: exit code {code} {messages.strip()}")
    return Result(exact_m, exact_rad, written_m, between_m, points, before_m, faults)


def between(product, brand, robot, cell, paths, files, options, original, start, folder, faults):
    refined = os.path.join(folder, "refined")
    code, report, messages = correct(product, cell, paths, refined,
                                     [*options, "--insert", str(BETWEEN_M * 1e3)])
    if code not in (0, 1) or report is None:
        faults.append(f"--insert: exit code {code}: {messages.strip()}")
        return np.inf
    refused = {s["line"]: s["note"] for s in report["segments"] if s["note"]}
    commanded = Run(robot, brand.execute({**files, **read(refined, files)}), start)
    ends = matched(original, commanded)
    worst = 0.0
    for k, motion in enumerate(original.motions):
        before = original.motions[k - 1] if k else None
        if not k or motion.kind in ("joint", "spline") or motion.left or before.left or motion.shared or \
                before.shared or not np.array_equal(before.tool, motion.tool) or \
                load_of(before)[0] != load_of(motion)[0]:
            continue
        if motion.line in refused or motion.instruction in refused:
            continue  # the report says that it could not be refined
        found = deviation(robot, original, k, commanded, range(ends[k - 1], ends[k] + 1))
        worst = max(worst, found)
        if found > BETWEEN_M:
            faults.append(f"{motion.file}:{motion.line}: {found * 1e3:.3f} mm from the path between "
                          "the points")
    return worst


def public(product, folder):
    """Every file below a folder, alone and, if there are several, with the others of its folder."""
    reasons, faults, tried, counts = collections.Counter(), [], 0, collections.Counter()
    for path, _, names in sorted(os.walk(folder)):
        programs = collections.defaultdict(list)
        for name in sorted(names):
            brand = SUFFIXES.get(os.path.splitext(name)[1].lower())
            if brand:
                programs[brand].append(os.path.join(path, name))
        for brand, files in programs.items():
            sets = [[file] for file in files] + ([files] if len(files) > 1 else [])
            for one in sets:
                tried += 1
                problem = public_program(product, brand, one, reasons, counts)
                faults += [f"{os.path.relpath(one[0], folder)}"
                           f"{'' if len(one) == 1 else f' and {len(one) - 1} more'}: {p}" for p in problem]
    print(f"{tried} programs tried: {counts['corrected']} points corrected, {counts['left']} listed with a "
          f"reason, {counts['refused']} files refused, {counts['none']} programs not recognised")
    for reason, count in reasons.most_common(40):
        print(f"  {count:7d}  {reason}")
    for fault in faults:
        print("FAULT", fault)
    return not faults


# The remedies that a message names, with values that the harness chooses.
STATED = re.compile(r"(--routine) '([^']*=harmless)'|(--complete)")
REMEDY = re.compile(r"give (?:--start \S+ or )?(--tool|--base|--load|--joints|--external-axes-still)(?: '([^']*)=)?")


def public_program(product, brand, paths, reasons, counts):
    with tempfile.TemporaryDirectory() as folder:
        robot = Robot(brand)
        cell = write(folder, {"cell.toml": robot.cell_text([Tool(1, pose(np.eye(3), (0, 0, 0.2)))]).replace(
            "[tool]", "[[tool]]\nnumber = 1").encode()})[0]
        old = {os.path.basename(p): open(p, "rb").read() for p in paths}
        options, output = [], os.path.join(folder, "out")
        try:
            for _ in range(4):
                code, report, messages = correct(product, cell, paths, output, options)
                if report is None:
                    break
                more = []
                for point in report["left"]:
                    for option, key in REMEDY.findall(point["reason"]):
                        value = {"--tool": "1", "--load": "5,0,0,100", "--base": "0,0,0,0,0,0"}.get(option)
                        if value and option == "--base" and brand == "abb":
                            value = "0,0,0,1,0,0,0"
                        if option == "--base" and not key:
                            continue
                        given = [option] + ([f"{key}={value}" if key else value] if value else [])
                        if given[-1] not in options and given[-1] not in more and len(more) < 400:
                            more += given
                    for routine, harmless, complete in STATED.findall(point["reason"]):
                        given = [routine, harmless] if routine else [complete]
                        if given[-1] not in options and given[-1] not in more and len(more) < 400:
                            more += given
                if not more:
                    break
                options += more
        except subprocess.TimeoutExpired:
            return ["takes more than 10 minutes"]
        if report is None:
            counts["none"] += 1
            known = code == 2 and ("no robot program" in messages or "is a program of" in messages
                                   or "already corrected" in messages)
            return [] if known else [f"exit code {code}: {messages.strip()[:300]}"]
        problems = []
        counts["corrected"] += len(report["corrected"])
        counts["left"] += len(report["left"])
        counts["refused"] += len(report["refusals"])
        seen = [p["index"] for p in report["corrected"] + report["left"]]
        if len(set(seen)) != len(seen) or len(seen) != report["counts"]["points"]:
            problems.append("a point is neither corrected once nor listed once")
        for point in report["left"]:
            # Without names, numbers and values, so that the same reasons are counted together.
            reasons[re.sub(r"'[^']*'|\"[^\"]*\"|[\w$./\\:\[\]]*\d[\w.$\[\]]*", "*", point["reason"])[:110]] += 1
            if not point["reason"]:
                problems.append("a point is left without a reason")
        new = read(output, old)
        for name, data in old.items():
            changes = foreign_changes(data, new.get(name, data), lines_of(report, name))
            problems += [f"{name}: {text}" for text in changes[:3]]
        return problems


def main():
    made = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    made.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    made.add_argument("--brand", action="append", help="only these modules of program_brands")
    made.add_argument("--program", action="append", help="only these programs")
    made.add_argument("--quick", action="store_true", help="the first program of each brand")
    made.add_argument("--public", metavar="FOLDER")
    made.add_argument("--keep", metavar="FOLDER", help="keep cells and programs there")
    options = made.parse_args()
    if options.public:
        sys.exit(0 if public(options.product, options.public) else 1)
    fine, rows = True, []
    for brand_name in options.brand or BRANDS:
        try:
            brand = importlib.import_module("program_brands." + brand_name)
        except ModuleNotFoundError:
            if options.brand:
                raise
            continue
        programs = brand.programs()
        names = [n for n in programs if not options.program or n in options.program]
        results = {}
        for name in names[:1] if options.quick else names:
            with tempfile.TemporaryDirectory() as folder:
                if options.keep:
                    folder = os.path.join(options.keep, brand_name, name)
                    shutil.rmtree(folder, ignore_errors=True)
                os.makedirs(folder, exist_ok=True)
                results[name] = evaluate(options.product, brand, name, programs[name], folder)
            for fault in results[name].faults:
                print(f"{brand.NAME}, {name}: {fault}")
            fine &= not results[name].faults
        if results:
            worst = Result(*map(max, list(zip(*results.values()))[:4]),
                           sum(r.points for r in results.values()),
                           max(r.before_m for r in results.values()),
                           sum(bool(r.faults) for r in results.values()))
            rows.append((brand.NAME, len(results), worst))
    print(f"{'brand':28} {'programs':>8} {'points':>6} {'uncorrected':>12} {'exact':>20} {'written':>9} "
          f"{'between':>9} {'failed':>6}")
    for name, count, r in rows:
        print(f"{name:28} {count:8d} {r.points:6d} {r.before_m * 1e3:9.3f} mm {r.exact_m * 1e6:8.3f} um "
              f"{r.exact_rad:7.1e} {r.written_m * 1e3:6.4f} mm {r.between_m * 1e3:6.3f} mm {r.faults:6d}")
    print(f"{'goal':28} {'':8} {'':6} {'':12} {EXACT_M * 1e6:8.3f} um {EXACT_RAD:7.1e} "
          f"{WRITTEN_M * 1e3:6.4f} mm {BETWEEN_M * 1e3:6.3f} mm {0:6d}")
    sys.exit(0 if fine else 1)


if __name__ == "__main__":
    main()
