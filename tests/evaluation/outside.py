#!/usr/bin/python3
"""What does the diagnosis answer when the cause is none of its catalogue?

Fresh cells, each with a cause of outside_kinds.py, which no effect of the catalogue describes. A
quarter also hides a joint compliance, which is in the catalogue. Judged are the answer, and the
corrected model on held-out rows: inside the measured range, in a region of the joints that was not
measured, with a load that was not measured, and later and warmer.

Confidently wrong: `explained` without an effect that the kind accepts or with one beside those, or
`no_effect` although the cause moves the tip by more than half the noise. Of these, those are called
imitated whose corrected model is right inside the range nevertheless: the rows do not show the
difference. Worse than declared: by more than 5 % against measured points, RMS over five rows or more
of a group, apart for those that the model flags as extrapolated.
"""

import argparse
import csv
import json
import math
import os
import resource
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
import runs  # noqa: E402
from outside_cells import GROUPS, draw_set, table_text  # noqa: E402
from outside_kinds import KINDS  # noqa: E402

VISIBLE = 0.5   # displacement over noise, both RMS, from which on `no_effect` is wrong
IMITATED = 0.6  # RMS error of the corrected model over noise, inside the range
MEASURED = ("x_mm", "y_mm", "z_mm")


# ---- judging


def noise_mm(truth):
    """RMS length of the noise of a point."""
    return math.sqrt(3) * truth["sigma_mm"]


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if len(values) else float("nan")


def confidently_wrong(answer, truth):
    visible = truth["displacement_mm"]["measured"] > VISIBLE * noise_mm(truth)
    if answer["verdict"] == "no_effect":
        return visible or bool(truth["companion"])
    if answer["verdict"] != "explained":
        return False
    named = {effect["id"] for effect in answer["effects"]}
    companion = {truth["companion"]} - {None}
    if not named <= set(truth["accepts"]) | companion:
        return True
    return visible and not named & set(truth["accepts"])


def worse(rows, truth):
    """Error of the corrected over that of the declared model, both against points measured with the
    instrument's noise, where it is worse; else None."""
    if len(rows) < 5:
        return None
    corrected, declared = (math.hypot(rms([r[k] for r in rows]), noise_mm(truth))
                           for k in ("error_mm", "declared_mm"))
    return corrected / declared if corrected > 1.05 * declared else None


def judge(answer, truth, groups):
    """`groups`: for each group of held-out rows, rows with error_mm and declared_mm to the true point,
    measured_error_mm to a measured one, radius_mm (None: not stated) and extrapolated."""
    row = {"verdict": answer["verdict"], "named": [e["id"] for e in answer["effects"]],
           "wrong": confidently_wrong(answer, truth), "groups": {}}
    row["imitated"] = (row["wrong"] and
                       rms([r["error_mm"] for r in groups["inside"]]) < IMITATED * noise_mm(truth))
    for name, rows in groups.items():
        stated = [r for r in rows if r["radius_mm"] is not None]
        row["groups"][name] = {
            "rows": len(rows), "flagged": sum(r["extrapolated"] for r in rows), "stated": len(stated),
            "held": sum(r["measured_error_mm"] <= r["radius_mm"] for r in stated),
            "declared_mm": rms([r["declared_mm"] for r in rows]),
            "corrected_mm": rms([r["error_mm"] for r in rows]),
            "errors": [r["measured_error_mm"] for r in stated],
            "radii": [r["radius_mm"] for r in stated],
            "worse": worse([r for r in rows if not r["extrapolated"]], truth),
            "worse_flagged": worse([r for r in rows if r["extrapolated"]], truth)}
    return row


# ---- one set


def write(folder, name, text):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text)


def predicted(product, folder, model, group):
    place = lambda name: os.path.join(folder, name)
    out = place(f"{model}_{group}.csv")
    done = subprocess.run([product, "predict", place(model + ".toml"), place(f"test_{group}.csv"), "--out",
                           out], capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise RuntimeError(f"predict {model} {group}: {done.stderr.strip()[-300:]}")
    with open(out) as file:
        return list(csv.DictReader(file))


def run_set(case, product, keep):
    name, seed = case
    text, rows, points, noisy, truth = draw_set(name, seed)
    linear = {0} if KINDS[name].rail else set()
    with tempfile.TemporaryDirectory() as scratch:
        folder = os.path.join(keep, f"{name}-{seed}") if keep else scratch
        os.makedirs(folder, exist_ok=True)
        write(folder, "cell.toml", text)
        write(folder, "truth.json", json.dumps(truth, indent=1) + "\n")
        write(folder, "measured.csv", table_text(rows["measured"], noisy["measured"], name, linear))
        for group in GROUPS:
            write(folder, f"test_{group}.csv", table_text(rows[group], None, name, linear))
            write(folder, f"truth_{group}.csv", table_text(rows[group], points[group], name, linear))
        try:
            found = ask(product, folder, points, noisy)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            found = {"failed": str(error)}
    return {"kind": name, "seed": seed, "truth": truth} | found


def judged(run):
    if "failed" in run:
        return run["truth"] | {"verdict": "none", "failed": run["failed"]}
    return (run["truth"] | judge(run["answer"], run["truth"], run["groups"])
            | {"seconds": run["seconds"]})


def ask(product, folder, points, noisy):
    """The answer, and what the corrected and the declared model predict for the held-out rows."""
    place = lambda name: os.path.join(folder, name)
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([product, "diagnose", place("cell.toml"), place("measured.csv"), "--json",
                           place("diagnosis.json"), "--write-model", place("corrected.toml"), "--quiet",
                           "--threads", "1"], capture_output=True, text=True, timeout=600)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"diagnose: {done.stderr.strip()[-300:]}")
    with open(place("diagnosis.json")) as file:
        answer = json.load(file)
    groups = {}
    for group in GROUPS:
        tables = {model: predicted(product, folder, model, group) for model in ("cell", "corrected")}
        tip = {model: np.array([[float(r[n]) for n in MEASURED] for r in table])
               for model, table in tables.items()}
        off = lambda model, points: np.linalg.norm(tip[model] - 1e3 * points[group], axis=1).tolist()
        groups[group] = [
            {"error_mm": round(error, 6), "declared_mm": round(declared, 6),
             "measured_error_mm": round(measured, 6), "radius_mm": float(r["u_mm"]) if r["u_mm"] else None,
             "extrapolated": r["extrapolated"] == "1"}
            for error, declared, measured, r in zip(off("corrected", points), off("cell", points),
                                                    off("corrected", noisy), tables["corrected"])
        ][1:]  # the move before a file's first row is not in the file
    return {"answer": answer, "groups": groups,
            "seconds": end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime}


# ---- tables


def worst(rows, what, groups=GROUPS):
    """Sets that are worse in one of the groups, and the largest ratio."""
    ratios = [max((r["groups"][g][what] or 0 for g in groups), default=0) for r in rows]
    return sum(ratio > 0 for ratio in ratios), max(ratios, default=0)


def held(rows, group):
    stated = sum(r["groups"][group]["stated"] for r in rows)
    return 100 * sum(r["groups"][group]["held"] for r in rows) / stated if stated else float("nan")


def width(rows, groups):
    """Median radius over median error."""
    median = lambda what: np.median([v for r in rows for g in groups for v in r["groups"][g][what]] or
                                    [float("nan")])
    return median("radii") / median("errors")


def flagged(rows, group="inside"):
    count = sum(r["groups"][group]["rows"] for r in rows)
    return 100 * sum(r["groups"][group]["flagged"] for r in rows) / count if count else float("nan")


def cell_of_worse(rows, what):
    count, ratio = worst(rows, what)
    return f"{count} ({ratio:.2f})" if count else "0"


def line(title, rows):
    good = [r for r in rows if "failed" not in r]
    verdicts = [r["verdict"] for r in rows]
    said = ", ".join(f"{v} {verdicts.count(v)}" for v in sorted(set(verdicts)))
    wrong = f"{sum(r['wrong'] for r in good)} ({sum(r['imitated'] for r in good)})"
    seconds = [r["seconds"] for r in good] or [float("nan")]
    shares = " | ".join(f"{held(good, g):.0f}" for g in GROUPS)
    return (f"| {title} | {len(rows)} | {said} | {wrong} | {cell_of_worse(good, 'worse')} | "
            f"{cell_of_worse(good, 'worse_flagged')} | {shares} | {width(good, ('inside',)):.1f} | "
            f"{width(good, GROUPS[1:]):.1f} | {flagged(good):.0f} | {np.median(seconds):.1f} |")


def table(rows):
    text = ("| kind | sets | verdicts | confidently wrong (imitated) | worse, not flagged (largest ratio) "
            "| worse, flagged | within: inside % | region % | load % | later % | radius over error inside "
            "| outside | flagged inside % | s |\n|" + "---|" * 14 + "\n")
    for name in KINDS:
        of_kind = [r for r in rows if r["kind"] == name]
        if of_kind:
            text += line(name, of_kind) + "\n"
    return text + line("all", rows) + "\n"


def goals(rows):
    """What is wanted and what was reached: (what, wanted, reached, met)."""
    good = [r for r in rows if "failed" not in r]
    count = len(good)
    wrong, imitated = (sum(r[k] for r in good) for k in ("wrong", "imitated"))
    share = 100 * wrong / count
    unflagged, (marked, ratio) = worst(good, "worse"), worst(good, "worse_flagged")
    lines = [("confidently wrong", "<= 1 %", f"{share:.1f} % ({wrong}/{count}; {imitated} imitated)",
              share <= 1),
             ("worse than declared, not flagged", "0", f"{unflagged[0]}, at most {unflagged[1]:.2f} times",
              unflagged[0] == 0),
             ("worse than declared, flagged", "<= 2 % of the sets, at most 1.2 times",
              f"{100 * marked / count:.1f} % ({marked}), at most {ratio:.2f} times",
              marked <= 0.02 * count and ratio <= 1.2)]
    for group in GROUPS:
        reached, most = held(good, group), 99 if group == "inside" else 100
        lines.append((f"within the radius: {group}", "93 to 99 %" if group == "inside" else ">= 93 %",
                      f"{reached:.1f} %", 93 <= reached <= most))
    for title, groups, most in (("inside", ("inside",), 3), ("outside", GROUPS[1:], 6)):
        reached = width(good, groups)
        lines.append((f"median radius over median error: {title}", f"<= {most}", f"{reached:.1f}",
                      reached <= most))
    lines.append(("poses inside flagged as extrapolated", "<= 10 %", f"{flagged(good):.1f} %",
                  flagged(good) <= 10))
    seconds = [r["seconds"] for r in good]
    lines.append(("processor seconds, median and most", "-",
                  f"{np.median(seconds):.1f} and {max(seconds):.1f}", True))
    lines.append(("sets without an answer", "0", str(len(rows) - count), count == len(rows)))
    return lines


def goals_text(rows):
    text = "| what | wanted | reached |\n|---|---|---|\n"
    for what, wanted, reached, met in goals(rows):
        text += f"| {what} | {wanted} | {reached if met else '**' + reached + '**'} |\n"
    return text


def complaints(rows):
    """The sets that missed something, each with the options that draw it again."""
    for r in rows:
        told = []
        if "failed" in r:
            told.append(r["failed"])
        elif r["wrong"]:
            told.append(f"{r['verdict']} {', '.join(r['named'])}{' (imitated)' if r['imitated'] else ''}")
        for group, of_group in r.get("groups", {}).items():
            for what in ("worse", "worse_flagged"):
                if of_group[what]:
                    told.append(f"{group} {what.replace('_', ', ')} {of_group[what]:.2f} "
                                f"({of_group['corrected_mm']:.2f} of {of_group['declared_mm']:.2f} mm)")
        if told:
            yield f"- --kind {r['kind']} --first-seed {r['seed']} --sets 1: {'; '.join(told)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(runs.ROOT, "build/bin/plumbline"))
    parser.add_argument("--sets", type=int, default=4 * len(KINDS))
    parser.add_argument("--kind", action="append", choices=list(KINDS), help="only these kinds")
    parser.add_argument("--first-seed", type=int, default=int(time.time()) % 1000000,
                        help="fresh by default")
    parser.add_argument("--quick", action="store_true", help="two sets")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", help="store each set here, and go on from those stored")
    parser.add_argument("--keep", help="keep the sets in this folder")
    options = parser.parse_args()
    kinds, count = options.kind or list(KINDS), 2 if options.quick else options.sets
    cases = [(kinds[k % len(kinds)], options.first_seed + k) for k in range(count)]
    results = runs.Results(options.json, {"first_seed": options.first_seed})
    done = {(r["kind"], r["seed"]) for r in results.rows}
    left = (case for case in cases if case not in done)
    for row in runs.run_each(options.jobs, run_set, left, options.product, options.keep):
        results.add(row)
    rows = [judged(run) for run in results.rows]
    print(f"{len(rows)} sets, --first-seed {options.first_seed}\n")
    print(goals_text(rows) + "\n" + table(rows))
    print("\n".join(complaints(rows)))
    return 1 if any("failed" in r for r in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
