#!/usr/bin/python3
"""How well does a model that was fitted to touched artefacts hold at a place that was left out?

For each set of the measured folder whose rows are on point artefacts: each place (artefacts at a known
distance from each other) is left out once, the model is fitted to the others, and the tip is predicted
at the rows of the place. Printed: the scatter of those tips about the mean of their socket, 3-D RMS over
all places, by the declared cell and by the corrected model, and the error of the known distances.
"""

import csv
import os
import subprocess
import sys
import tempfile
import tomllib

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import runs  # noqa: E402

# 3-D RMS and error of the 50 mm [mm] of the published method, leaving places out alike
# (Franzese et al., arXiv 2503.12584).
PUBLISHED = {"real-panda-2": (0.423, 0.178), "real-panda-3": (0.214, 0.043)}


def places_of(cell):
    """The place of each point artefact: a number shared by those at a known distance."""
    place = {a["name"]: number for number, a in enumerate(cell["artefact"]) if a["kind"] == "point"}
    for distance in cell.get("distance", []):
        first, second = (place[name] for name in distance["between"])
        place = {name: first if number == second else number for name, number in place.items()}
    return place


def write_rows(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)


def tips(product, cell, rows, folder, *more):
    """Predicted tips; the declared cell needs rows that determine its tip (--align)."""
    poses, out = os.path.join(folder, "poses.csv"), os.path.join(folder, "tips.csv")
    write_rows(poses, [{k: v for k, v in row.items() if k != "artefact"} for row in rows])
    subprocess.run([product, "predict", cell, poses, "--out", out, *more], check=True,
                   capture_output=True)
    found = np.genfromtxt(out, delimiter=",", names=True)
    return np.column_stack([found[name] for name in ("x_mm", "y_mm", "z_mm")])


def errors(points, rows, cell):
    """Squared distances from the mean of their socket, and the errors of the known distances."""
    names = np.array([row["artefact"] for row in rows])
    means = {name: points[names == name].mean(axis=0) for name in set(names)}
    squares = [float(np.sum((p - means[name]) ** 2)) for p, name in zip(points, names)]
    apart = [np.linalg.norm(means[d["between"][0]] - means[d["between"][1]]) - d["value_mm"]
             for d in cell.get("distance", []) if all(name in means for name in d["between"])]
    return squares, apart


def leave_out(case, product, root):
    name, place = case
    source = os.path.join(root, name)
    with open(os.path.join(source, "cell.toml"), "rb") as file:
        cell = tomllib.load(file)
    with open(os.path.join(source, "measured.csv")) as file:
        rows = list(csv.DictReader(file))
    place_of = places_of(cell)
    own = [row for row in rows if place_of[row["artefact"]] == place]
    with tempfile.TemporaryDirectory() as folder:
        measured, model = os.path.join(folder, "m.csv"), os.path.join(folder, "corrected.toml")
        write_rows(measured, [row for row in rows if place_of[row["artefact"]] != place])
        said = subprocess.run([product, "diagnose", os.path.join(source, "cell.toml"), measured,
                               "--json", os.path.join(folder, "d.json"), "--write-model", model],
                              check=True, capture_output=True, text=True).stdout
        before = errors(tips(product, os.path.join(source, "cell.toml"), own, folder, "--align",
                             measured), own, cell)
        after = errors(tips(product, model, own, folder), own, cell)
    return name, own[0]["artefact"], before, after, said.splitlines()[0] if said else ""


def rms(values):
    return float(np.sqrt(np.mean(values)))


def main():
    made = runs.parser(__doc__, seeds=1, jobs=2, quick="one place of each set")
    made.add_argument("--measured", default=os.environ.get(
        "PLUMBLINE_MEASURED", os.path.join(runs.ROOT, "../shared/measured")))
    options = made.parse_args()
    runs.limit(options)
    sets = [name for name in PUBLISHED if os.path.isdir(os.path.join(options.measured, name))]
    if not sets:
        print(f"skipped: no sets on artefacts in {options.measured}")
        return 77
    cases = []
    for name in sets:
        with open(os.path.join(options.measured, name, "cell.toml"), "rb") as file:
            numbers = sorted(set(places_of(tomllib.load(file)).values()))
        cases += [(name, place) for place in numbers[:1 if options.quick else None]]
    done = runs.run_all(options.jobs, leave_out, cases, options.product, options.measured)
    print("| set | places | declared, mm | corrected, mm | published, mm | ratio (goal 0.8) | "
          "known distance off, mm (goal 0.1) | published |\n|---|---|---|---|---|---|---|---|")
    for name in sets:
        of_set = [row for row in done if row[0] == name]
        before = rms(sum((row[2][0] for row in of_set), []))
        after = rms(sum((row[3][0] for row in of_set), []))
        apart = float(np.abs(np.mean(sum((row[3][1] for row in of_set), []))))
        each = float(np.mean(np.abs(sum((row[3][1] for row in of_set), []))))
        print(f"| {name} | {len(of_set)} | {before:.3f} | {after:.3f} | {PUBLISHED[name][0]:.3f} | "
              f"{after / PUBLISHED[name][0]:.2f} | {apart:.3f} (mean of sizes {each:.3f}) | "
              f"{PUBLISHED[name][1]:.3f} |")
        for row in of_set:
            print(f"  {row[1]}: {rms(row[2][0]):.3f} -> {rms(row[3][0]):.3f} mm; {row[4]}",
                  file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
