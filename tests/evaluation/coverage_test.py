#!/usr/bin/python3
"""The arm of loaded_arm.py is the product's arm when everything is declared; and on a few fixed cells
that leave parameters open the stated radius holds most of the true landings.

    coverage_test.py PLUMBLINE"""

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
import coverage  # noqa: E402
from loaded_arm import Arm, cell_text  # noqa: E402

PRODUCT = sys.argv[1]


def both_arms_agree():
    for seed in range(6):
        name, arm, payload, cog, random = coverage.draw_case(seed, "all compliance")
        arm = Arm(arm.joints, arm.convention, arm.tool, arm.gravity, root=arm.root or 1e-7)
        every = set(range(len(arm.joints)))
        declared = {"compliance": every, "mass": every, "cog": True, "payload": True,
                    "root": float(arm.root)}
        low = np.array([j["low"] for j in arm.joints])
        high = np.array([j["high"] for j in arm.joints])
        poses = low + random.random((8, len(low))) * (high - low)
        with tempfile.TemporaryDirectory() as folder:
            cell, table, out = (os.path.join(folder, f) for f in ("cell.toml", "poses.csv", "out.csv"))
            with open(cell, "w") as file:
                file.write(cell_text(arm, name, cog, declared))
            with open(table, "w") as file:
                file.write(",".join(f"q{i + 1}_deg" for i in range(len(low))) + ",payload_kg\n")
                for q in poses:
                    file.write(",".join(repr(float(x)) for x in np.degrees(q)) + f",{payload!r}\n")
            subprocess.run([PRODUCT, "predict", cell, table, "--out", out], check=True,
                           capture_output=True)
            predicted = np.genfromtxt(out, delimiter=",", names=True, usecols=range(5))
        tips = np.column_stack([predicted[c] for c in ("x_mm", "y_mm", "z_mm")])
        truth = np.array([1e3 * arm.tip(q, payload, cog) for q in poses])
        off = np.linalg.norm(tips - truth, axis=1).max()
        assert off < 0.01, (seed, name, off)


def the_radius_holds():
    held, points, bases = 0, 0, set()
    for group in coverage.GROUPS:
        for seed in range(70, 73):
            run = coverage.run_case(seed, group, PRODUCT, 12)
            assert "failed" not in run, run
            held += int(np.sum(run["error_mm"] <= run["radius_mm"]))
            points += len(run["error_mm"])
            bases.update(run["basis"])
    assert bases == {"assumed"}, bases
    # coverage.py counts it with its goal of 93 to 99 %; here a gross fault must show.
    assert held > 0.85 * points, (held, points)


both_arms_agree()
the_radius_holds()
