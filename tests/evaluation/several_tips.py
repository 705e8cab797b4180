#!/usr/bin/python3
"""Are the tips of several reflectors fitted together with the effects?

An arm whose second and third joints yield and whose fourth has an offset is measured at 46 postures by
a tracker that stands somewhere; three reflectors on the flange are read in each. The cell declares
their places only roughly, with one [[tool]] each and tool = "unknown". The corrected model is
compared at new postures with the truth of an independent arm (loaded_arm.py), and so is what a
customary geometric calibration makes of the same rows: base, tips, lengths, twists and offsets by
least squares. Goal: every cell corrected, and the error below that of the peer.
"""

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
import loaded_arm  # noqa: E402
import runs  # noqa: E402

POSTURES, SIGMA_M = 46, 3e-5
DEG = np.pi / 180


def arm_of(random, compliant):
    """A six-axis arm of 1 to 2 m reach with masses."""
    size = random.uniform(0.7, 1.4)
    table = [(0.15, -90, 0.4, 0, 60), (0.7, 0, 0, -90, 40), (0.1, -90, 0, 0, 25),
             (0, 90, 0.7, 0, 8), (0, -90, 0, 0, 5), (0, 0, 0.1, 0, 2)]
    joints = [{"a": a * size, "alpha": alpha * DEG, "d": d * size, "offset": offset * DEG, "mass": mass,
               "com": np.array([-0.4 * a * size, 0, 0.02]), "compliance": 0.0,
               "low": low * DEG, "high": high * DEG}
              for (a, alpha, d, offset, mass), (low, high) in
              zip(table, [(-120, 120), (-50, 60), (-70, 60), (-150, 150), (-100, 100), (-170, 170)])]
    if compliant:
        joints[1]["compliance"], joints[2]["compliance"] = random.uniform(2e-6, 6e-6, 2)
        joints[3]["offset"] += random.uniform(-1, 1) * 3e-3
    tool = {"length": 0.0, "weight": 0.0}
    return loaded_arm.Arm(joints, "dh", tool, [0, 0, -9.80665])


def points_of(arm, q, tips):
    """Places of all reflectors in the base frame, shape (postures, reflectors, 3)."""
    none, centre = np.zeros(len(q)), np.zeros((len(q), 3))
    compliance = np.array([j["compliance"] for j in arm.joints])
    _, _, after = arm.frames(arm.sagged(q, none, centre, compliance))
    R, p = after[-1]
    return p[:, None] + np.einsum("kij,tj->kti", R, tips)


def rotation(vector):
    angle = np.linalg.norm(vector)
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def rigid_fit(a, b):
    """R, t with R a + t nearest to b."""
    U, _, Vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    return R, b.mean(0) - R @ a.mean(0)


def geometric_fit(arm, q, tips, measured, passes=12):
    """The peer: Gauss-Newton on base, tips and all DH parameters, a trace of ridge for what is free."""
    tools = len(tips)
    R, t = rigid_fit(points_of(arm, q, tips).reshape(-1, 3), measured.reshape(-1, 3))
    state = np.zeros(6 + 3 * tools + 4 * len(arm.joints))

    def predicted(x):
        moved = [dict(j, a=j["a"] + dx[0], d=j["d"] + dx[1], alpha=j["alpha"] + dx[2],
                      offset=j["offset"] + dx[3])
                 for j, dx in zip(arm.joints, x[6 + 3 * tools:].reshape(-1, 4))]
        own = loaded_arm.Arm(moved, "dh", arm.tool, arm.gravity)
        return lambda joints: points_of(own, joints, tips + x[6:6 + 3 * tools].reshape(-1, 3)) \
            @ (rotation(x[:3]) @ R).T + t + x[3:6]

    for _ in range(passes):
        base = predicted(state)(q).ravel()
        J = np.stack([(predicted(state + 1e-6 * e)(q).ravel() - base) / 1e-6
                      for e in np.eye(len(state))], 1)
        H = J.T @ J
        step = np.linalg.solve(H + 1e-9 * np.trace(H) / len(H) * np.eye(len(H)),
                               J.T @ (measured.ravel() - base))
        state = state + step
    return predicted(state)


def csv_of(q, points=None):
    """Rows of all postures and reflectors; tools are numbered from 1."""
    lines = [",".join(["session", *(f"q{i + 1}_deg" for i in range(6)), "tool"]
                      + (["x_mm", "y_mm", "z_mm"] if points is not None else []))]
    for k, posture in enumerate(q):
        for tool in range(3):
            values = ["1", *(f"{value / DEG:.7f}" for value in posture), str(tool + 1)]
            if points is not None:
                values += [f"{1e3 * value:.5f}" for value in points[k, tool]]
            lines.append(",".join(values))
    return "\n".join(lines) + "\n"


def run_case(seed, product, _simulate):
    random = np.random.default_rng([seed, 4711])
    truth = arm_of(random, True)
    nominal = loaded_arm.Arm([dict(j, compliance=0.0) for j in truth.joints], "dh", truth.tool,
                             truth.gravity)
    nominal.joints[3]["offset"] = 0.0
    tips = random.uniform(-0.12, 0.12, (3, 3)) + [0, 0, 0.15]
    declared = tips + random.normal(0, 3e-3, tips.shape)
    draw = lambda count: np.stack([random.uniform(j["low"], j["high"], count) for j in truth.joints], 1)
    q, fresh = np.round(draw(POSTURES) / DEG, 7) * DEG, np.round(draw(200) / DEG, 7) * DEG
    R, t = rotation(np.array([0, 0, random.uniform(-3, 3)])), random.uniform(-3, 3, 3)
    seen = lambda joints: points_of(truth, joints, tips) @ R.T + t
    measured = seen(q) + random.normal(0, SIGMA_M, (POSTURES, 3, 3))
    everything = set(range(6))
    text = loaded_arm.cell_text(nominal, "three reflectors", np.zeros(3),
                                {"compliance": set(), "mass": everything, "cog": False},
                                (f"sigma_mm = {1e3 * SIGMA_M}", 'frame = "unaligned"',
                                 'tool = "unknown"'))
    head, rest = text.split("[tool]\n")
    rest = rest[rest.index("[measurement]"):]
    tools = "".join(f'[[tool]]\nnumber = {k + 1}\nmodel = "rigid"\n'
                    f"tcp_mm = {[float(1e3 * value) for value in tip]}\n"
                    for k, tip in enumerate(declared))
    with tempfile.TemporaryDirectory() as folder:
        place = lambda name: os.path.join(folder, name)
        for name, content in (("cell.toml", head + tools + rest), ("measured.csv", csv_of(q, measured)),
                              ("fresh.csv", csv_of(fresh))):
            with open(place(name), "w") as out:
                out.write(content)

        def run(*arguments):
            done = subprocess.run([product, *arguments], capture_output=True, text=True, timeout=600)
            if done.returncode != 0:
                raise RuntimeError(f"seed {seed}: {' '.join(arguments[:1])}: {done.stderr}")
        run("diagnose", place("cell.toml"), place("measured.csv"), "--json", place("d.json"),
            "--write-model", place("corrected.toml"))
        run("predict", place("corrected.toml"), place("fresh.csv"), "--out", place("p.csv"))
        with open(place("d.json")) as answer:
            diagnosis = json.load(answer)
        rows = np.genfromtxt(place("p.csv"), delimiter=",", names=True, dtype=None, encoding=None)
    predicted = np.column_stack([rows[name] for name in ("x_mm", "y_mm", "z_mm")])
    wanted = 1e3 * seen(fresh).reshape(-1, 3)
    rms = lambda points: float(np.sqrt(np.mean(np.sum((points - wanted)**2, 1))))
    peer = geometric_fit(nominal, q, declared, measured)
    return {"seed": seed, "verdict": diagnosis["verdict"],
            "effects": sorted(e["id"] for e in diagnosis["effects"]),
            "before_mm": diagnosis["rms_mm"]["before"], "error_mm": rms(predicted),
            "peer_mm": rms(1e3 * peer(fresh).reshape(-1, 3)),
            "within": float(np.mean(np.linalg.norm(predicted - wanted, axis=1) <= rows["u_mm"]))}


def main():
    options = runs.parse(runs.parser(__doc__, seeds=20, jobs=2, quick="two cells"))
    seeds = range(options.first_seed, options.first_seed + (2 if options.quick else options.seeds))
    done = runs.run_all(options.jobs, run_case, list(seeds), options.product, options.simulate)
    print("| seed | verdict | effects | before mm | error at new postures mm | geometric fit mm | "
          "within the radius |\n|---|---|---|---|---|---|---|")
    for c in done:
        print(f"| {c['seed']} | {c['verdict']} | {', '.join(c['effects'])} | {c['before_mm']:.3f} | "
              f"{c['error_mm']:.3f} | {c['peer_mm']:.3f} | {100 * c['within']:.0f} % |")
    right = sum(c["verdict"] == "explained" and
                set(c["effects"]) == {"joint_compliance", "joint_offset"} for c in done)
    ratio = np.median([c["error_mm"] / c["peer_mm"] for c in done])
    print(f"\nexplained with both effects: {right} of {len(done)}; median error "
          f"{np.median([c['error_mm'] for c in done]):.3f} mm, {ratio:.2f} of the geometric fit's")
    return 0


if __name__ == "__main__":
    sys.exit(main())
