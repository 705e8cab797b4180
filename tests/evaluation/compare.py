#!/usr/bin/python3
"""Held-out error of `plumbline diagnose` beside plain methods, on the same splits: simulated sets
against their truth without noise, real sets against measured rows that took no part."""

import argparse
import concurrent.futures
import importlib.util
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import evaluate  # noqa: E402
import goals  # noqa: E402
import groups  # noqa: E402
import real_sets  # noqa: E402
import rivals  # noqa: E402
import separability  # noqa: E402

PRODUCT, KNOWS = "plumbline", "knows the form"


def lines_of(path):
    with open(path) as file:
        return file.read().splitlines()


def write_rows(path, lines, chosen, poses=False):
    """The header and the chosen rows (0 is the first); without the measured columns for `poses`."""
    picked = [lines[0]] + [lines[1 + k] for k in chosen]
    if poses:
        keep = [i for i, name in enumerate(lines[0].split(",")) if name not in ("x_mm", "y_mm", "z_mm")]
        picked = [",".join(line.split(",")[i] for i in keep) for line in picked]
    with open(path, "w") as file:
        file.write("\n".join(picked) + "\n")


class Product:
    """The product on one split: tips, what it named, how many rows its radius holds."""

    def __init__(self, program, timeout_s):
        self.program, self.timeout_s = program, timeout_s

    def tips(self, data, real):
        place = data.place
        self.run("diagnose", data.cell, data.train, "--json", place("d.json"), "--write-model",
                 place("corrected.toml"))
        extra = ["--align", data.align] if data.align else []
        self.run("predict", place("corrected.toml"), data.test, *extra, "--out", place("p.csv"))
        predicted = np.genfromtxt(place("p.csv"), delimiter=",", names=True)
        with open(place("d.json")) as file:
            answer = json.load(file)
        self.named = answer["verdict"] + ": " + ", ".join(
            e["id"] + (" " + "+".join(e["scope"]) if e.get("scope") else "")
            for e in answer.get("effects", []))
        tips = np.column_stack([predicted[n] for n in ("x_mm", "y_mm", "z_mm")])
        self.inside = int(np.sum(np.linalg.norm(tips - real, axis=1) <= predicted["u_mm"]))
        self.extrapolated = int(np.sum(predicted["extrapolated"] > 0))
        return tips

    def run(self, *arguments):
        subprocess.run([self.program, *arguments], check=True, capture_output=True,
                       timeout=self.timeout_s)


def errors_of(data, truth, product, methods, timeout_s, noise=0.0):
    """One result: {method: RMS in mm} and what the product said of the `measured` truth."""
    result = {"errors": {}, "seconds": {}, "rows": len(truth)}
    for name in methods:
        begin = time.monotonic()
        try:
            if name == PRODUCT:
                asked = Product(product, timeout_s)
                tips = asked.tips(data, truth + noise)
                result.update(named=asked.named, inside=asked.inside, extrapolated=asked.extrapolated)
            else:
                tips = rivals.RIVALS[name](data)
            result["errors"][name] = evaluate.rms(tips, truth)
        except (subprocess.SubprocessError, OSError, ValueError, KeyError) as error:
            detail = getattr(error, "stderr", b"") or b""
            print(f"{name}: {type(error).__name__} {detail[-200:]!r}", file=sys.stderr)
        result["seconds"][name] = time.monotonic() - begin
    return result


def simulated(case, simulate, product, methods, timeout_s):
    group, family, seed, options = case
    with tempfile.TemporaryDirectory() as folder:
        place = lambda name: os.path.join(folder, name)
        subprocess.run([simulate, "--family", family, "--seed", str(seed), "--out", folder] + options,
                       check=True, capture_output=True)
        with open(place("truth.json")) as file:
            sigma_mm = 1e3 * json.load(file)["sigma"]
        truth = separability.points(place("test_truth.csv"))
        data = rivals.Set(simulate, folder, place("cell.toml"), place("measured.csv"), place("test_poses.csv"))
        noise = np.random.default_rng(seed).normal(0, sigma_mm, truth.shape)
        result = errors_of(data, truth, product, methods, timeout_s, noise)
        subprocess.run([simulate, "--fit", "--with", place("truth.json"), "--cell", place("cell.toml"),
                        "--measured", place("measured.csv"), "--poses", place("test_poses.csv"), "--out",
                        place("fit.csv")], check=True, capture_output=True)
        result["errors"][KNOWS] = evaluate.rms(separability.points(place("fit.csv")), truth)
        return result | {"group": group.name, "family": family}


def real(split, measured, simulate, product, methods, timeout_s):
    source = lambda name, file: os.path.join(measured, name, file)
    with tempfile.TemporaryDirectory() as folder:
        place = lambda n: os.path.join(folder, n)
        shutil.copy(source(split.train_set, "cell.toml"), place("cell.toml"))
        write_rows(place("train.csv"), lines_of(source(split.train_set, "measured.csv")), split.train)
        held_out = lines_of(source(split.test_set, "measured.csv"))
        write_rows(place("test.csv"), held_out, split.test, poses=True)
        write_rows(place("held_out.csv"), held_out, split.test)
        if split.align is not None:
            write_rows(place("align.csv"), held_out, split.align)
        data = rivals.Set(simulate, folder, place("cell.toml"), place("train.csv"), place("test.csv"),
                          place("align.csv") if split.align is not None else None, unknown=True)
        truth = np.array([[float(r[c]) for c in ("x_mm", "y_mm", "z_mm")]
                          for r in separability.table(place("held_out.csv"))])
        return errors_of(data, truth, product, methods, timeout_s) | {"split": split}


def line(cells):
    return "| " + " | ".join(cells) + " |\n"


def ratio(result, name):
    """Of the error over that of a fit that knows the form; the error itself where that is zero."""
    knows = result["errors"][KNOWS]
    return result["errors"][name] / knows if knows > 0 else result["errors"][name]


def within(results):
    """Share of the rows that the product's radius holds."""
    told = [r for r in results if "inside" in r]
    return goals.share(sum(r["inside"] for r in told), sum(r["rows"] for r in told))


def simulated_table(results, methods):
    """Medians over the runs of the held-out error over that of a fit that knows the form."""
    columns = methods + [KNOWS + ", mm", "measured points within u_mm"]
    text = line(["hidden", "runs"] + columns) + line(["---"] * (len(columns) + 2))
    for group in dict.fromkeys(r["group"] for r in results):
        families = list(dict.fromkeys(r["family"] for r in results if r["group"] == group))
        for family in ([None] if len(families) > 1 else []) + families:
            some = [r for r in results if r["group"] == group and family in (None, r["family"])]
            cells = [f"**{group}**" if family is None or len(families) == 1 else family, str(len(some))]
            for name in methods:
                values = [ratio(r, name) for r in some if name in r["errors"]]
                unit = "" if all(r["errors"][KNOWS] > 0 for r in some) else " mm"
                cells.append(f"{statistics.median(values):.3g}{unit}" if values else "-")
            cells.append(f"{statistics.median(r['errors'][KNOWS] for r in some):.4f}")
            text += line(cells + [within(some)])
    return text


def pooled(results, method):
    """RMS over all folds: every row held out once. None where the method failed on one."""
    if not all(method in r["errors"] for r in results):
        return None
    square = sum(r["errors"][method] ** 2 * r["rows"] for r in results)
    return (square / sum(r["rows"] for r in results)) ** 0.5


def real_table(results, methods):
    text = line(["set", "held out", "rows, train / held out"] + [m + ", mm" for m in methods] +
                ["goal, mm", "best plain method", "held-out rows within u_mm (goal 93 to 99 %)",
                 "extrapolated", "named"])
    text += line(["---"] * (len(methods) + 8))
    for name, words in dict.fromkeys((r["split"].name, r["split"].words) for r in results):
        some = [r for r in results if (r["split"].name, r["split"].words) == (name, words)]
        held = sum(r["rows"] for r in some)
        split = some[0]["split"]
        found = {m: pooled(some, m) for m in methods}
        plain = {m: e for m, e in found.items() if m != PRODUCT and e is not None}
        best = min(plain, key=plain.get) if plain else "-"
        if best in plain and found.get(PRODUCT) and plain[best] < found[PRODUCT]:
            best += ", BETTER"
        beyond = sum(r.get("extrapolated", 0) for r in some)
        cells = [name, words + (f", {len(some)} folds" if len(some) > 1 else ""),
                 f"{len(split.train)} / {held}"]
        cells += [f"{e:.3f}" if e is not None else "failed" for e in found.values()]
        cells += [f"{split.goal_mm}" if split.goal_mm else "-", best, within(some),
                  f"{100 * beyond / held:.0f} %",
                  "; ".join(dict.fromkeys(r["named"] for r in some if "named" in r))]
        text += line(cells)
    return text


def simulated_cases(o):
    """One run of every family per seed; nothing is named in them, all causes alike."""
    listed = subprocess.run([o.simulate, "--list"], check=True, capture_output=True, text=True)
    wanted = ("catalogue", "two effects", "three effects, 96 rows", "nothing", "outside the catalogue",
              "two drivers and their product", "temperature times payload, 3 K warmer")
    cases = [c for c in groups.plan(listed.stdout.split(), o.seeds, o.first_seed)
             if c[0].name in wanted and c[2] < o.first_seed + o.seeds]
    if o.group:
        cases = [c for c in cases if c[0].name.startswith(tuple(o.group))]
    return cases[::6] if o.quick else cases


def main():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(root, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(root, "build/bin/plumbline-simulate"))
    parser.add_argument("--measured", default=os.environ.get("PLUMBLINE_MEASURED", os.path.join(root, "../shared/measured")))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000)
    parser.add_argument("--folds", type=int, default=1, help="of real-ur10-random, at most 5")
    parser.add_argument("--set", action="append", help="only real sets whose name starts so")
    parser.add_argument("--group", action="append", help="only simulated groups whose name starts so")
    parser.add_argument("--timeout-s", type=float, default=1800, help="of one run of the product")
    parser.add_argument("--quick", action="store_true", help="a few simulated sets, one fold")
    parser.add_argument("--only", choices=["simulated", "real"])
    parser.add_argument("--no-product", action="store_true", help="the plain methods alone")
    parser.add_argument("--method", action="append", help="only these methods")
    parser.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) // 2))
    parser.add_argument("--out", help="write the tables here too")
    o = parser.parse_args()
    methods = o.method or list(rivals.RIVALS) + ([] if o.no_product else [PRODUCT])
    for program in [o.simulate] + ([o.product] if PRODUCT in methods else []):
        if not os.access(program, os.X_OK):
            sys.exit(f"compare.py: no program {program}; build it with ./dev build, or name it")
    if set(methods) & {"lasso", "Gaussian process", "boosted trees"} and not importlib.util.find_spec("sklearn"):
        sys.exit("compare.py: no scikit-learn; install python3-sklearn, or name other methods with --method")
    text = ""
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        asked = (o.simulate, o.product, methods, o.timeout_s)
        if o.only != "real":
            runs = [pool.submit(simulated, c, *asked) for c in simulated_cases(o)]
            text += (f"Simulated sets (seeds from {o.first_seed}): median of the held-out error over that of a "
                     "fit that knows the true form.\n\n" + simulated_table([r.result() for r in runs], methods))
        if o.only != "simulated":
            splits, skipped = real_sets.splits(o.measured, 1 if o.quick else o.folds)
            splits = [s for s in splits if not o.set or s.name.startswith(tuple(o.set))]
            if not splits:
                skipped.append(f"skipped: no real sets in {o.measured} (set PLUMBLINE_MEASURED)")
            runs = [pool.submit(real, s, o.measured, *asked) for s in splits]
            if splits:
                text += ("\nReal sets: RMS of the 3-D error at rows that took no part.\n\n" +
                         real_table([r.result() for r in runs], methods))
            text += "".join(f"\n{why}\n" for why in skipped)
    print(text)
    if o.out:
        with open(o.out, "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()
