#!/usr/bin/python3
"""Held-out error of `plumbline diagnose` beside plain methods, on the same splits: simulated sets
against their truth without noise, real sets against measured rows that took no part."""

import argparse
import concurrent.futures
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


def by_product(product, cell, train, test, align, folder, truth):
    """(tips, verdict, effects and the share of rows within u_mm in words)"""
    place = lambda name: os.path.join(folder, name)
    subprocess.run([product, "diagnose", cell, train, "--json", place("d.json"), "--write-model",
                    place("corrected.toml")], check=True, capture_output=True, timeout=600)
    extra = ["--align", align] if align else []
    subprocess.run([product, "predict", place("corrected.toml"), test, *extra, "--out", place("p.csv")],
                   check=True, capture_output=True, timeout=600)
    predicted = np.genfromtxt(place("p.csv"), delimiter=",", names=True)
    with open(place("d.json")) as file:
        answer = json.load(file)
    words = answer["verdict"] + ": " + ", ".join(
        e["id"] + (" " + "+".join(e.get("scope") or []) if e.get("scope") else "")
        for e in answer.get("effects", []))
    tips = np.column_stack([predicted[n] for n in ("x_mm", "y_mm", "z_mm")])
    inside = np.mean(np.linalg.norm(tips - truth, axis=1) <= predicted["u_mm"])
    return tips, f"{words}; u_mm holds {100 * inside:.0f} %"


def errors_of(data, truth, product, methods):
    """{method: RMS in mm}, {method: seconds}, what the product said"""
    found, seconds, words = {}, {}, ""
    for name in methods:
        begin = time.monotonic()
        try:
            if name == PRODUCT:
                tips, words = by_product(product, data.cell, data.train, data.test, data.align, data.folder, truth)
            else:
                tips = rivals.RIVALS[name](data)
            found[name] = evaluate.rms(tips, truth)
        except (subprocess.SubprocessError, OSError, ValueError, KeyError) as error:
            detail = getattr(error, "stderr", b"") or b""
            print(f"{name}: {type(error).__name__} {detail[-200:]!r}", file=sys.stderr)
        seconds[name] = time.monotonic() - begin
    return found, seconds, words


def simulated(case, simulate, product, methods):
    group, family, seed, options = case
    with tempfile.TemporaryDirectory() as folder:
        place = lambda name: os.path.join(folder, name)
        subprocess.run([simulate, "--family", family, "--seed", str(seed), "--out", folder] + options,
                       check=True, capture_output=True)
        truth = separability.points(place("test_truth.csv"))
        data = rivals.Set(simulate, folder, place("cell.toml"), place("measured.csv"), place("test_poses.csv"))
        found, _, _ = errors_of(data, truth, product, methods)
        subprocess.run([simulate, "--fit", "--with", place("truth.json"), "--cell", place("cell.toml"),
                        "--measured", place("measured.csv"), "--poses", place("test_poses.csv"), "--out",
                        place("fit.csv")], check=True, capture_output=True)
        found[KNOWS] = evaluate.rms(separability.points(place("fit.csv")), truth)
        return group, family, found


def splits(measured):
    """(set, name of the split, training rows, alignment rows or None, held-out rows)"""
    folder = lambda name: os.path.join(measured, name)
    if os.path.isdir(folder("real-ur10-random")):
        count = len(lines_of(folder("real-ur10-random/measured.csv"))) - 1
        block = np.arange(count) // 60
        for fold in range(5):
            yield ("real-ur10-random", f"every fifth block of 60, from block {fold}",
                   np.flatnonzero(block % 5 != fold), None, np.flatnonzero(block % 5 == fold))
    if os.path.isdir(folder("real-irb120")):
        count = len(lines_of(folder("real-irb120/measured.csv"))) - 1
        first = round(0.7 * count)
        yield "real-irb120", "last 30 % in time", np.arange(first), None, np.arange(first, count)
    if os.path.isdir(folder("real-iiwa7")):
        session = np.array([line.split(",")[0] for line in lines_of(folder("real-iiwa7/measured.csv"))[1:]])
        second = np.flatnonzero(session == "2")
        align = second[::5]
        yield ("real-iiwa7", "session 2 from session 1, aligned on every fifth row",
               np.flatnonzero(session == "1"), align, np.setdiff1d(second, align))


def real(split, measured, simulate, product, methods):
    name, words, train, align, test = split
    source = os.path.join(measured, name)
    lines = lines_of(os.path.join(source, "measured.csv"))
    with tempfile.TemporaryDirectory() as folder:
        place = lambda n: os.path.join(folder, n)
        shutil.copy(os.path.join(source, "cell.toml"), place("cell.toml"))
        write_rows(place("train.csv"), lines, train)
        write_rows(place("test.csv"), lines, test, poses=True)
        write_rows(place("held_out.csv"), lines, test)
        if align is not None:
            write_rows(place("align.csv"), lines, align)
        data = rivals.Set(simulate, folder, place("cell.toml"), place("train.csv"), place("test.csv"),
                          place("align.csv") if align is not None else None, unknown=True)
        truth = np.array([[float(r[c]) for c in ("x_mm", "y_mm", "z_mm")]
                          for r in separability.table(place("held_out.csv"))])
        found, seconds, said = errors_of(data, truth, product, methods)
        return name, words, len(train), len(test), found, seconds, said


def line(cells):
    return "| " + " | ".join(cells) + " |\n"


def simulated_table(results, methods):
    """Medians over the runs of the held-out error over that of a fit that knows the form."""
    columns = methods + [KNOWS + ", mm"]
    text = line(["hidden", "runs"] + columns) + line(["---"] * (len(columns) + 2))
    for group in dict.fromkeys(r[0] for r in results):
        for family in [None] + list(dict.fromkeys(r[1] for r in results if r[0] == group)):
            some = [r[2] for r in results if r[0] == group and family in (None, r[1])]
            if family is None and group.startswith("nothing"):
                continue
            cells = [f"**{group}**" if family is None else family, str(len(some))]
            for name in methods:
                values = [f[name] / f[KNOWS] if f[KNOWS] > 0 else f[name] for f in some if name in f]
                unit = "" if all(f[KNOWS] > 0 for f in some) else " mm"
                cells.append(f"{statistics.median(values):.3g}{unit}" if values else "-")
            cells.append(f"{statistics.median(f[KNOWS] for f in some):.4f}")
            text += line(cells)
    return text


def real_table(results, methods):
    text = line(["set", "split", "rows, train / held out"] + [m + ", mm" for m in methods] + ["named"])
    text += line(["---"] * (len(methods) + 4))
    for name in dict.fromkeys(r[0] for r in results):
        some = [r for r in results if r[0] == name]
        held = sum(r[3] for r in some)
        # Over all folds: every row held out once.
        cells = [name, some[0][1] if len(some) == 1 else f"blocks of 60, {len(some)} folds",
                 f"{some[0][2]} / {held}"]
        for method in methods:
            found = [(r[4][method], r[3]) for r in some if method in r[4]]
            square = sum(e * e * n for e, n in found)
            cells.append(f"{(square / sum(n for _, n in found)) ** 0.5:.3f}" if found else "-")
        text += line(cells + ["; ".join(dict.fromkeys(r[6] for r in some if r[6]))])
    return text


def main():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(root, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(root, "build/bin/plumbline-simulate"))
    parser.add_argument("--measured", default=os.environ.get("PLUMBLINE_MEASURED", os.path.join(root, "../shared/measured")))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000)
    parser.add_argument("--folds", type=int, default=1, help="of real-ur10-random, at most 5")
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
    text = ""
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        if o.only != "real":
            listed = subprocess.run([o.simulate, "--list"], check=True, capture_output=True, text=True)
            cases = [c for c in evaluate.plan(listed.stdout.split(), o.seeds, o.first_seed)
                     if c[0] in ("catalogue", "two effects", "nothing", "outside the catalogue")]
            cases = [c for c in cases if c[2] < o.first_seed + o.seeds]
            if o.quick:
                cases = cases[::6]
            runs = [pool.submit(simulated, c, o.simulate, o.product, methods) for c in cases]
            text += (f"Simulated sets (seeds from {o.first_seed}): median of the held-out error over that of a "
                     "fit that knows the true form.\n\n" + simulated_table([r.result() for r in runs], methods))
        if o.only != "simulated":
            chosen = [s for s in splits(o.measured) if s[0] != "real-ur10-random" or
                      int(s[1].split()[-1]) < (1 if o.quick else o.folds)]
            if not chosen:
                print(f"skipped: no real sets in {o.measured} (set PLUMBLINE_MEASURED)", file=sys.stderr)
            runs = [pool.submit(real, s, o.measured, o.simulate, o.product, methods) for s in chosen]
            if chosen:
                text += ("\nReal sets: RMS of the 3-D error at rows that took no part.\n\n" +
                         real_table([r.result() for r in runs], methods))
    print(text)
    if o.out:
        with open(o.out, "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()
