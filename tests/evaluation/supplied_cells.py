#!/usr/bin/python3
"""The supplied cells: whether each is accepted, has a source, and puts the flange where others do.

    supplied_cells.py --product build/bin/plumbline    every cell: `plumbline check` has no fault or warning,
                                                       its comment has a source, `plumbline predict` agrees
                                                       with kinematics in NumPy, it reaches as far as its
                                                       maker says, and config/README.md has its row
    supplied_cells.py --urdf FOLDER                    the flange over random postures against the file that
                                                       the cell names: NAME.urdf, or NAME.py with a table of
                                                       robotkinematicscatalogue, below FOLDER/OWNER/REPOSITORY
    supplied_cells.py --table                          the rows for config/README.md

The files are public but not ours to distribute: clone the repositories, and expand xacro files to NAME.urdf.
"""

import argparse
import glob
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import xml.etree.ElementTree

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CHECKED = r"Checked against: (\S+), (\S+), (\S+) to (\S+): largest difference ([\d.]+) mm, ([\d.]+) deg"
PLAIN_TOOL = "tcp_mm = [0.0, 0.0, 0.0]"
TIP_MM = (37.0, -53.0, 211.0)  # away from all axes, so that an error of the orientation shows


def turn(axis, angles):
    """Rotations about an axis, (N, 4, 4)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angles = np.atleast_1d(angles)[:, None, None]
    X = np.broadcast_to(np.eye(4), (len(angles), 4, 4)).copy()
    X[:, :3, :3] += np.sin(angles) * cross + (1 - np.cos(angles)) * (cross @ cross)
    return X


def shift(xyz):
    X = np.eye(4)
    X[:3, 3] = xyz
    return X


class Cell:
    def __init__(self, path):
        self.path, self.file = path, os.path.basename(path)
        self.text = open(path).read()
        robot = tomllib.loads(self.text)["robot"]
        self.joints, self.proximal = robot["joint"], robot["convention"] == "mdh"
        self.coupling = robot.get("coupling", [])
        comment = self.text.partition("\nschema")[0]
        self.title = re.match(r"# (.*?), nominal", comment).group(1)
        self.comment = re.sub(r"\n#? *", " ", comment)
        self.checked = re.search(CHECKED, self.comment)

    def limits(self):
        """Of the axes; a coupled one turns freely, since its limits are those of the reading."""
        limits = np.array([(j.get("min_deg", -180.0), j.get("max_deg", 180.0)) for j in self.joints])
        for pair in self.coupling:
            limits[pair["joint"] - 1] = -180.0, 180.0
        return limits

    def readings(self, q_deg):
        """What the controller reports when the axes are at q_deg."""
        read = q_deg.copy()
        for pair in self.coupling:
            read[:, pair["joint"] - 1] -= pair["ratio"] * q_deg[:, pair["of"] - 1]
        return read

    def frames(self, q_deg):
        """The frame after each joint, [m], for the axes at q_deg (N, n)."""
        X, frames = np.eye(4), []
        for joint, q in zip(self.joints, np.radians(q_deg).T):
            z = shift([0, 0, joint["d_mm"] / 1e3]) @ turn(
                [0, 0, 1], joint.get("sign", 1) * q + np.radians(joint.get("theta_offset_deg", 0.0)))
            x = shift([joint["a_mm"] / 1e3, 0, 0]) @ turn([1, 0, 0], np.radians(joint["alpha_deg"]))[0]
            X = X @ x @ z if self.proximal else X @ z @ x
            frames.append(X)
        return frames

    def reach_mm(self):
        """How far the wrist centre and, at most, the flange come from the first axis."""
        low, high = self.limits()[1:3].T
        second, third = np.meshgrid(*[np.linspace(a, b, 361) for a, b in zip(low, high)])
        q = np.zeros((second.size, len(self.joints)))
        q[:, 1], q[:, 2] = second.ravel(), third.ravel()
        wrist = np.linalg.norm(self.frames(q)[3][:, :2, 3], axis=1).max() * 1e3
        return wrist, wrist + sum(abs(j["a_mm"]) + abs(j["d_mm"]) for j in self.joints[4:])

    def row(self):
        source = re.search(r"Source: ([^,:;]+)", self.comment).group(1)
        agreement = f"{self.checked[1]}: {self.checked[5]} mm, {self.checked[6]} deg" if self.checked else "-"
        return f"| `{self.file}` | {self.title} | {source} | {agreement} |"


class Urdf:
    def __init__(self, path):
        numbers = lambda item, name, default: [float(v) for v in (
            item.get(name, default) if item is not None else default).split()]
        self.parent = {}
        for joint in xml.etree.ElementTree.parse(path).getroot().findall("joint"):
            if joint.find("parent") is None:
                continue
            place, axis = joint.find("origin"), joint.find("axis")
            roll, pitch, yaw = numbers(place, "rpy", "0 0 0")
            X = (shift(numbers(place, "xyz", "0 0 0")) @ turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch)
                 @ turn([1, 0, 0], roll))
            self.parent[joint.find("child").get("link")] = (
                joint.find("parent").get("link"), X, joint.get("type"), numbers(axis, "xyz", "1 0 0"))

    def chain(self, link):
        joints = []
        while link in self.parent:
            joints.insert(0, self.parent[link])
            link = joints[0][0]
        return joints

    def pose(self, link, q_deg):
        X, columns = np.eye(4), iter(np.radians(q_deg).T)
        for _, origin, kind, axis in self.chain(link):
            X = X @ origin
            if kind in ("revolute", "continuous"):
                X = X @ turn(axis, next(columns))
        return X

    def flange(self, base, tip, q_deg):
        return np.linalg.inv(self.pose(base, q_deg)) @ self.pose(tip, q_deg)


class Table(Cell):
    """A table of robotkinematicscatalogue: alpha, a, d and theta of each joint, and its sign."""

    def __init__(self, path):
        def numbers(pattern):
            found = re.search(pattern, text, re.S)[1].replace("np.pi", "180.0")
            assert re.fullmatch(r"[\d.\s+*/()\[\],-]*", found), found
            return eval(found)

        with open(path) as file:
            text = re.sub("#.*", "", file.read())
        rows, signs = numbers(r"DHM = np\.array\((\[\[.*?\]\])\)"), numbers(r"inv_joint = ([^\n]*)")
        self.proximal = True
        self.joints = [dict(alpha_deg=alpha, a_mm=a, d_mm=d, theta_offset_deg=theta, sign=sign)
                       for (alpha, a, d, theta), sign in zip(rows, signs)]

    def flange(self, _base, _tip, q_deg):
        return self.frames(q_deg)[-1]


def difference(first, second):
    """Largest difference of two arrays of poses: mm, degrees."""
    turned = np.linalg.norm(first[:, :3, :3] - second[:, :3, :3], axis=(1, 2)) / np.sqrt(8)
    return (1e3 * np.linalg.norm(first[:, :3, 3] - second[:, :3, 3], axis=1).max(),
            2 * np.degrees(np.arcsin(np.minimum(turned, 1))).max())


def urdf_of(cell):
    """The cell as a URDF: each joint between two fixed ones that carry its lengths and offset."""
    text = '<robot name="cell">'
    for i, joint in enumerate(cell.joints):
        x = f'xyz="{joint["a_mm"] / 1e3} 0 0" rpy="{np.radians(joint["alpha_deg"])} 0 0"'
        z = f'xyz="0 0 {joint["d_mm"] / 1e3}" rpy="0 0 {np.radians(joint.get("theta_offset_deg", 0.0))}"'
        before, after = (x, z) if cell.proximal else (z, x)
        for k, (kind, origin) in enumerate([("fixed", before), ("revolute", ""), ("fixed", after)]):
            parent, child = f"link{3 * i + k}", f"link{3 * i + k + 1}"
            text += (f'<joint name="{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
                     f'<origin {origin}/><axis xyz="0 0 {joint.get("sign", 1)}"/></joint>')
    return text + "</robot>", f"link{3 * len(cell.joints)}"


def postures(cell, count):
    low, high = cell.limits().T
    return np.random.default_rng(1).uniform(low, high, (count, len(cell.joints)))


def faults_of(cell, product, folder, readme):
    done = subprocess.run([product, "check", cell.path], capture_output=True, text=True)
    if done.returncode != 0 or "warning" in done.stdout + done.stderr:
        yield "check: " + (done.stdout + done.stderr).strip()
    if "Source: " not in cell.comment:
        yield "its comment names no source"
        return
    if cell.row() not in readme:
        yield "config/README.md lacks the row " + cell.row()
    q = postures(cell, 50).round(5)
    written, tip = urdf_of(cell)
    with open(os.path.join(folder, "cell.urdf"), "w") as file:
        file.write(written)
    flange = cell.frames(q)[-1]
    apart = difference(flange, Urdf(os.path.join(folder, "cell.urdf")).flange("link0", tip, q))
    if max(apart) > 1e-6:
        yield "the same table as a URDF is %.3g mm and %.3g deg off" % apart
    if PLAIN_TOOL in cell.text:
        copy, poses, out = (os.path.join(folder, name) for name in ("cell.toml", "poses.csv", "out.csv"))
        with open(copy, "w") as file:
            file.write(cell.text.replace(PLAIN_TOOL, "tcp_mm = [%s, %s, %s]" % TIP_MM))
        np.savetxt(poses, cell.readings(q), "%.5f", ",", comments="",
                   header=",".join(f"q{i + 1}_deg" for i in range(q.shape[1])))
        subprocess.run([product, "predict", copy, poses, "--out", out], check=True, capture_output=True)
        found = np.genfromtxt(out, delimiter=",", names=True)
        tips = 1e3 * (flange @ np.append(np.array(TIP_MM) / 1e3, 1))[:, :3]
        off = max(np.abs(found[name] - tips[:, i]).max() for i, name in enumerate(("x_mm", "y_mm", "z_mm")))
        if off > 1e-4:
            yield "`plumbline predict` and NumPy are %.3g mm apart" % off
    reach = re.search(r"Reach: (\d+) mm( to the wrist centre)?", cell.comment)
    if reach:
        wrist, flange_mm = cell.reach_mm()
        far = wrist if reach[2] else flange_mm
        if not wrist * 0.975 < float(reach[1]) < far * 1.025:  # makers round: 1225 mm is called 1.2 m
            yield "reaches %.0f mm (wrist centre) to %.0f mm, not %s mm" % (wrist, far, reach[1])


def compare(cells, folder, count):
    wrong = 0
    print("%-24s %-40s %12s %10s  %s" % ("cell", "file", "mm", "deg", "stated"))
    for cell in cells:
        if not cell.checked:
            print("%-24s no second source" % cell.file)
            continue
        repository, name, base, tip = cell.checked.group(1, 2, 3, 4)
        paths = [path for ending in (".urdf", ".py") for path in sorted(
            glob.glob(os.path.join(folder, repository, "**", name + ending), recursive=True))]
        if not paths:
            print("%-24s %-40s not in the folder" % (cell.file, name))
            continue
        q = postures(cell, count)
        other = (Table if paths[0].endswith(".py") else Urdf)(paths[0])
        apart = difference(cell.frames(q)[-1], other.flange(base, tip, q))
        stated = tuple(float(v) for v in cell.checked.group(5, 6))
        good = all(a < s + 0.0015 for a, s in zip(apart, stated))
        wrong += not good
        print("%-24s %-40s %12.4f %10.4f  %.3f mm, %.3f deg%s" % (cell.file, name, *apart, *stated,
                                                                 "" if good else "  WRONG"))
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    parser.add_argument("--urdf", metavar="FOLDER", help="compare with the files of this folder instead")
    parser.add_argument("--postures", type=int, default=1000)
    parser.add_argument("--table", action="store_true", help="print the rows for config/README.md")
    options = parser.parse_args()
    cells = [Cell(path) for path in sorted(glob.glob(os.path.join(ROOT, "config/cells/*.toml")))]
    if options.table:
        print("\n".join(cell.row() for cell in cells))
        return 0
    if options.urdf:
        return 1 if compare(cells, options.urdf, options.postures) else 0
    with open(os.path.join(ROOT, "config/README.md")) as file:
        readme = file.read().split("\n")
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        for cell in cells:
            faults += ["%s: %s" % (cell.file, fault) for fault in faults_of(cell, options.product, folder, readme)]
    print("\n".join(faults) or "%d cells, %d compared with a second source" % (
        len(cells), sum(cell.checked is not None for cell in cells)))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
