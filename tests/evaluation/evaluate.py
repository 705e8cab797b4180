#!/usr/bin/python3
"""Scores `plumbline diagnose` on fresh simulated data: simulate, diagnose, predict, judge, count."""

import json
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
import runs  # noqa: E402
import scorer  # noqa: E402
import separability  # noqa: E402

OUTSIDE = ["creep", "slow_sine", "payload_squared", "temperature_squared", "two_bumps",
           "velocity_squared", "air_pressure"]
# An instrument fine enough that the asked signal needs no unbelievable size of the effect.
SIGMA_MM = {"tool_shear": 0.003, "gravity_direction": 0.01, "thermal_growth": 0.02,
            "payload_cog": 0.02}
CONFOUNDED = ["tool_stiffness", "tool_root_compliance", "payload_mass", "payload_cog",
              "joint_offset", "joint_compliance", "base_frame", "tool_frame", "thermal_growth",
              "backlash_load"]
ONE_PAYLOAD = ["tool_stiffness", "payload_mass", "payload_cog", "tool_root_compliance"]
CAMERA = ["camera_tag_size", "camera_zoom", "camera_lens"]
UNALIGNED = ["none", "joint_compliance", "joint_offset", "backlash_move", "gear_periodic",
             "link_geometry", "thermal_growth", "tool_stiffness"]


def plan(families, seeds, first_seed):
    """(group, family, seed, options of the simulator) of every run."""
    robots = ["kr210", "kr210", "ur10", "arm6"]
    catalogue = [f for f in families if f not in OUTSIDE + CAMERA + ["none", "pair"]]

    def cases(group, names, count, extra, weak=False):
        for name in names:
            for k in range(count):
                seed = first_seed + k
                draw = np.random.default_rng([seed, zlib.crc32(f"{group} {name}".encode())])
                low, high = (1, 4) if weak else (5, 30)
                signal = float(np.exp(draw.uniform(np.log(low), np.log(high))))
                robot = robots[k % len(robots)]
                sigma = SIGMA_MM.get(name, 0.05) * (1.0 if robot == "kr210" else 0.5)
                yield group, name, seed, ["--signal", f"{signal:.3f}", "--robot", robot,
                                          "--sigma-mm", str(sigma)] + extra

    yield from cases("catalogue", catalogue, seeds, [])
    yield from cases("catalogue, 5 % outliers", catalogue[::3], max(1, seeds // 3), ["--outliers", "0.05"])
    yield from cases("catalogue, camera", CAMERA, seeds, [])
    yield from cases("weak (signal 1 to 4)", catalogue[1::3], max(1, seeds // 3), [], weak=True)
    yield from cases("two effects", ["pair"], 5 * seeds, [])
    yield from cases("nothing", ["none"], 5 * seeds, [])
    yield from cases("nothing, 5 % outliers", ["none"], 5 * seeds, ["--outliers", "0.05"])
    yield from cases("nothing, heavy tails", ["none"], 5 * seeds, ["--heavy-tails"])
    yield from cases("nothing, camera", ["none"], seeds, ["--camera"])
    yield from cases("outside the catalogue", OUTSIDE, seeds, [])
    yield from cases("vertical tool, one payload", CONFOUNDED, max(1, seeds // 2), ["--vertical"])
    yield from cases("one payload, rigid joints", ONE_PAYLOAD, seeds, ["--one-payload", "--rigid-joints"])
    yield from cases("12,000 rows", ["joint_compliance", "none", "creep"], 1 if seeds > 1 else 0,
                     ["--rows", "11000", "--repeats", "1000"])
    yield from cases("unaligned, camera", CAMERA + ["measurement_scale"], max(1, seeds // 3),
                     ["--camera", "--unaligned"])
    yield from cases("unaligned, two sessions", UNALIGNED, max(1, seeds // 3),
                     ["--unaligned", "--sessions", "2"])


def rms(a, b):
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


def run_case(case, product, simulate, timeout_s, keep):
    group, family, seed, options = case
    parent = keep or tempfile.gettempdir()
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=parent)
    place = lambda name: os.path.join(folder, name)
    row = {"group": group, "family": family, "seed": seed, "options": options}
    subprocess.run([simulate, "--family", family, "--seed", str(seed), "--out", folder] + options,
                   check=True, capture_output=True, text=True)
    with open(place("truth.json")) as file:
        truth = json.load(file)
    row["signal"] = truth["signal"]
    judged = separability.judge(folder, simulate, scorer.key)
    row.update({k: judged.get(k) for k in ("distance", "nearest", "confusable")})
    real = separability.points(place("test_truth.csv"))
    if truth["effects"] or truth["nuisances"]:
        subprocess.run([simulate, "--fit", "--with", place("truth.json"), "--cell", place("cell.toml"),
                        "--measured", place("measured.csv"), "--poses", place("test_poses.csv"),
                        "--out", place("fit.csv")], check=True, capture_output=True)
        row["fit_mm"] = rms(separability.points(place("fit.csv")), real)
    try:
        begin = time.monotonic()
        done = subprocess.run([product, "diagnose", place("cell.toml"), place("measured.csv"), "--json",
                               place("diagnosis.json"), "--write-model", place("corrected.toml")],
                              capture_output=True, text=True, timeout=timeout_s)
        row["seconds"] = time.monotonic() - begin
        if done.returncode != 0:
            raise RuntimeError(f"diagnose ends with {done.returncode}: {done.stderr.strip()[-300:]}")
        with open(place("diagnosis.json")) as file:
            row.update(scorer.judge_answer(json.load(file), truth, judged))
        predict = [product, "predict", place("corrected.toml"), place("test_poses.csv"), "--out",
                   place("predicted.csv")]
        done = subprocess.run(predict, capture_output=True, text=True, timeout=timeout_s)
        if done.returncode != 0:
            raise RuntimeError(f"predict ends with {done.returncode}: {done.stderr.strip()[-300:]}")
        predicted = np.genfromtxt(place("predicted.csv"), delimiter=",", names=True)
        tips = np.column_stack([predicted[n] for n in ("x_mm", "y_mm", "z_mm")])
        row["rms_mm"] = rms(tips, real)
        row["rms_over_sigma"] = row["rms_mm"] / (np.sqrt(3) * truth["sigma"] * 1e3)
        row["before_mm"] = truth["before_test_rms_mm"]
        if "u_mm" in predicted.dtype.names:
            off = np.linalg.norm(tips - real, axis=1)
            row["inside_u"], row["points"] = int(np.sum(off <= predicted["u_mm"])), len(off)
            noise = np.random.default_rng(seed).normal(0, 1e3 * truth["sigma"], tips.shape)
            off = np.linalg.norm(tips - real - noise, axis=1)
            row["measured_inside_u"] = int(np.sum(off <= predicted["u_mm"]))
    except subprocess.TimeoutExpired:
        row["error"] = f"no answer within {timeout_s} s"
    except (RuntimeError, OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        row["error"] = f"{type(error).__name__}: {error}"
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    return row


def share(hits, count):
    if count == 0:
        return "-"
    low, high = scorer.wilson(hits, count)
    return f"{100 * hits / count:.1f} % ({hits}/{count}; {100 * low:.1f} to {100 * high:.1f})"


def quotient(row):
    if row.get("fit_mm") and "rms_mm" in row:
        return row["rms_mm"] / row["fit_mm"]
    return None


def median(values, form="{:.2f}"):
    values = [v for v in values if v is not None]
    return form.format(statistics.median(values)) if values else "-"


def count(rows, what):
    return sum(bool(r.get(what)) for r in rows), len(rows)


def summary(rows):
    """The required rates: (what, wanted, reached). A run without an answer counts as a failure."""
    group = lambda start: [r for r in rows if r["group"].startswith(start)]
    told = [r for r in rows if "signal" in r]
    catalogued = group("catalogue") + group("two effects") + group("unaligned")
    catalogued = [r for r in catalogued if r["family"] != "none" and r.get("signal", 5) >= 5]
    separable = [r for r in catalogued if r.get("kind", "separable") == "separable"]
    between = [r for r in catalogued if r.get("kind") == "between"]
    ambiguous = [r for r in rows if r.get("kind") == "ambiguous"]
    outside = [r for r in group("outside") if r.get("kind", "outside") == "outside"]
    ratios = [quotient(r) for r in separable]
    # 1.05: a refusal to correct leaves exactly the error before, which rounds either way.
    harmed = [r for r in told if "rms_mm" in r and r["before_mm"] > 0
              and r["rms_mm"] > 1.05 * r["before_mm"]]
    intervals = sum(r.get("intervals", 0) for r in rows)
    seconds = sorted(r["seconds"] for r in rows if "seconds" in r and not r["group"].startswith("12,000"))
    long = sorted(r["seconds"] for r in group("12,000") if "seconds" in r)
    lines = [
        ("separable effect, signal at least 5: named exactly", ">= 95 %", share(*count(separable, "named"))),
        ("a richer effect imitates it: named, or ambiguous with it among the named", "-",
         share(*count(between, "right"))),
        ("confidently wrong, all runs", "<= 1 %", share(*count(rows, "wrong")))]
    for name in ("nothing", "nothing, 5 % outliers", "nothing, heavy tails", "nothing, camera"):
        chosen = [r for r in rows if r["group"] == name]
        lines.append((f"{name}: no_effect", ">= 95 %", share(*count(chosen, "right"))))
    better = [r for r in outside if "rms_mm" in r and r["rms_mm"] <= 0.5 * r["before_mm"]]
    lines += [
        ("not separable: ambiguous, the true one among the named", ">= 95 %",
         share(*count(ambiguous, "right"))),
        ("outside: unknown, the driver among the first three", ">= 90 %", share(*count(outside, "right"))),
        ("outside: unknown, the driver first", "-",
         share(sum(r.get("verdict") == "unknown" and bool(r.get("driver_first")) for r in outside),
               len(outside))),
        ("outside: held-out error at most half of before", "-", share(len(better), len(outside))),
        ("held-out error over that of a fit that knows the form, median", "<= 1.5", median(ratios)),
        ("worse than before by more than 5 %", "0", share(len(harmed), len(told))),
        ("95 % intervals of parameters cover", "92 to 98 %",
         share(sum(r.get("covered", 0) for r in rows), intervals)),
        ("new measured points within u_mm, and their noise-free truth", "95 %",
         " and ".join(share(sum(r.get(k, 0) for r in rows), sum(r.get("points", 0) for r in rows))
                      for k in ("measured_inside_u", "inside_u"))),
        ("seconds for 96 rows, median and longest", "<= 3",
         f"{median(seconds)} and {seconds[-1]:.2f}" if seconds else "-"),
        ("seconds for 12,000 rows, longest", "<= 60", f"{long[-1]:.1f}" if long else "-"),
        ("runs that ended without an answer", "0", share(*count(rows, "error")))]
    return lines


def markdown(rows):
    text = "| what | wanted | reached (count; 95 % bounds) |\n|---|---|---|\n"
    text += "".join(f"| {a} | {b} | {c} |\n" for a, b, c in summary(rows))
    text += ("\n| group | family | runs | right | confidently wrong | verdicts | error over fit that "
             "knows | before, mm | after, mm | s |\n|" + "---|" * 10 + "\n")
    for group, family in dict.fromkeys((r["group"], r["family"]) for r in rows):
        some = [r for r in rows if (r["group"], r["family"]) == (group, family)]
        verdicts = [r.get("verdict") or "none" for r in some]
        told = ", ".join(f"{v} {verdicts.count(v)}" for v in sorted(set(verdicts)))
        text += (f"| {group} | {family} | {len(some)} | {count(some, 'right')[0]} | "
                 f"{count(some, 'wrong')[0]} | {told} | {median(map(quotient, some))} | "
                 f"{median([r.get('before_mm') for r in some], '{:.3f}')} | "
                 f"{median([r.get('rms_mm') for r in some], '{:.4f}')} | "
                 f"{median([r.get('seconds') for r in some])} |\n")
    return text


def complaints(rows, limit):
    """What went wrong, to look into: the case as a command that makes it again."""
    text = ""
    for r in [r for r in rows if r.get("error") or r.get("wrong") or not r.get("right")][:limit]:
        told = r.get("error") or f"{r['verdict']} {r['answer']}; hidden {r['truth']}"
        text += (f"- {r.get('kind', '?')}{', WRONG' if r.get('wrong') else ''}: --family {r['family']} "
                 f"--seed {r['seed']} {' '.join(r['options'])}: {told}")
        if r.get("nearest"):
            text += f"; nearest rival {r['nearest']} at {r['distance']:.1f}"
        text += "\n"
    return text


def main():
    # Half the cores, so that each run has two.
    parser = runs.parser(__doc__, 12, max(1, (os.cpu_count() or 2) // 2), "one run of each family")
    parser.add_argument("--group", action="append", help="only groups that start so")
    parser.add_argument("--timeout-s", type=float, default=120)
    parser.add_argument("--out", help="write the tables here too")
    parser.add_argument("--show", type=int, default=30, help="cases to tell that were not right")
    options = runs.parse(parser)
    listed = subprocess.run([options.simulate, "--list"], check=True, capture_output=True, text=True)
    cases = list(plan(listed.stdout.split(), 1 if options.quick else options.seeds,
                      options.first_seed))
    if options.family:
        cases = [c for c in cases if c[1] in options.family]
    if options.group:
        cases = [c for c in cases if c[0].startswith(tuple(options.group))]
    rows = runs.run_all(options.jobs, run_case, cases, options.product, options.simulate,
                        options.timeout_s, options.keep)
    text = f"{len(rows)} runs, seeds from {options.first_seed}.\n\n" + markdown(rows)
    print(text)
    not_right = complaints(rows, options.show)
    if not_right:
        print("Not right:\n\n" + not_right)
    if options.out:
        with open(options.out, "w") as file:
            file.write(text)
    if options.json:
        with open(options.json, "w") as file:
            json.dump({"first_seed": options.first_seed, "summary": summary(rows), "runs": rows}, file,
                      indent=1)


if __name__ == "__main__":
    main()
