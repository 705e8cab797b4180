#!/usr/bin/python3
"""Whether the product and the simulator mean the same by each effect: a corrected model that holds
the very effect that was hidden must predict the noise-free truth, to 4e-4 mm RMS or 1 % of what
the effect does where gravity turns, which the two take to different orders."""

import argparse
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
import evaluate  # noqa: E402
import groups  # noqa: E402
import separability  # noqa: E402


SLIDES = ["slide_compliance", "axis_bending", "guide_play"]  # of the prismatic axes of the ready lift


def effect_tables(effects):
    """The effects as a written model holds them."""
    text = ""
    for effect in effects:
        scope = ", ".join(f'"{q}"' for q in effect["scope"])
        rows = [f'{{ name = "{p["name"]}", value = {float(p["value"])!r}, sd = 0.0, unit = "{p["unit"]}" }}'
                for p in effect["parameters"]]
        rows += [f'{{ name = "{n}", value = "{effect[n]}" }}' for n in ("by", "frame") if n in effect]
        text += (f'\n[[effect]]\nid = "{effect["id"]}"\nscope = [{scope}]\n'
                 f'parameters = [ {", ".join(rows)} ]\n')
    return text


def difference(family, seed, robot, product, simulate, options=()):
    with tempfile.TemporaryDirectory() as folder:
        place = lambda name: os.path.join(folder, name)
        subprocess.run([simulate, "--family", family, "--seed", str(seed), "--robot", robot, "--out", folder,
                        *options], check=True, capture_output=True)
        with open(place("truth.json")) as file:
            truth = json.load(file)
        with open(place("cell.toml"), "a") as file:
            file.write(effect_tables(truth["effects"]))
        done = subprocess.run([product, "predict", place("cell.toml"), place("test_poses.csv"), "--out",
                               place("p.csv")], capture_output=True, text=True)
        if done.returncode != 0:
            return None, done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no answer"
        predicted = np.genfromtxt(place("p.csv"), delimiter=",", names=True)
        tips = np.column_stack([predicted[n] for n in ("x_mm", "y_mm", "z_mm")])
        return evaluate.rms(tips, separability.points(place("test_truth.csv"))), truth["before_test_rms_mm"]


def main():
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default=os.path.join(root, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(root, "build/bin/plumbline-simulate"))
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    listed = subprocess.run([options.simulate, "--list"], check=True, capture_output=True, text=True)
    failed = 0
    for family in listed.stdout.split() + SLIDES:
        if family in groups.OUTSIDE + groups.PLURAL + groups.RANGES:
            continue
        for robot in ("lift",) if family in SLIDES else ("kr210", "ur10", "arm6"):
            first_order = 1e-2 if family == "gravity_direction" else 0
            for seed in range(1, options.seeds + 1):
                rms, before = difference(family, seed, robot, options.product, options.simulate)
                if rms is None or rms > max(4e-4, first_order * before):
                    failed += 1
                    print(f"{family} on {robot}, seed {seed}: " +
                          (before if rms is None else f"{rms:.6f} mm RMS of {before:.3f} mm"))
    for family in groups.RANGES + ["measurement_scale"]:  # an instrument of ranges moves no tip
        rms, before = difference(family, 1, "ur10", options.product, options.simulate, ("--range",))
        if rms is None or rms > 4e-4 or before > 0:
            failed += 1
            print(f"{family}, ranges: {rms} mm RMS of {before} mm")
    print(f"{failed} do not agree" if failed else "all agree")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
