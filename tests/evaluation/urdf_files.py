#!/usr/bin/env python3
"""import-urdf over a folder of URDFs: each is converted exactly, or refused for a fault on its chain.

The forward kinematics of the URDF and of the written table are computed here, in NumPy, without
code of the product. Without a folder, arms are drawn, with faults on and off the chain.
"""
import argparse
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib
import xml.etree.ElementTree as xml

try:
    import numpy as np
except ImportError:
    sys.exit(77)

SAME_PLACE_M = 1e-6
SAME_ANGLE_RAD = 1e-6
POSTURES = 50


def rotation(axis, angle):
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + s * K + (1 - c) * K @ K


def pose(R=None, p=(0, 0, 0)):
    X = np.eye(4)
    if R is not None:
        X[:3, :3] = R
    X[:3, 3] = p
    return X


def numbers(text, default):
    return [float(v) for v in text.split()] if text else list(default)


class Joint:
    def __init__(self, node):
        self.name, self.type = node.get("name", ""), node.get("type", "")
        link = lambda end: (node.find(end).get("link", "") if node.find(end) is not None else "")
        self.parent, self.child = link("parent"), link("child")
        origin = node.find("origin")
        text = (lambda key: origin.get(key) if origin is not None else None)
        roll, pitch, yaw = numbers(text("rpy"), (0, 0, 0))
        self.X = pose(rotation((0, 0, 1), yaw) @ rotation((0, 1, 0), pitch) @
                      rotation((1, 0, 0), roll), numbers(text("xyz"), (0, 0, 0)))
        axis = node.find("axis")
        self.axis = np.array(numbers(axis.get("xyz") if axis is not None else None, (1, 0, 0)))
        limit = node.find("limit")
        self.limits = None
        if limit is not None and self.type != "continuous":
            if limit.get("lower") or limit.get("upper"):
                self.limits = (float(limit.get("lower", 0)), float(limit.get("upper", 0)))
        self.mimics = node.find("mimic") is not None

    def moves(self):
        return self.type != "fixed"


def read_urdf(path):
    """Joints by child, links by name, all joints, the root; None where the file is no URDF."""
    # Prefixes need not be declared here: they mark extensions that no arm needs.
    text = re.sub(rb"(</?|\s)([A-Za-z_][\w.-]*):(?=[A-Za-z_][\w.-]*[\s=>/])", rb"\1\2_",
                  pathlib.Path(path).read_bytes())
    try:
        root = xml.fromstring(text)
    except xml.ParseError:
        return None
    if root.tag != "robot":
        return None
    joints = [Joint(node) for node in root.findall("joint")]
    links = {node.get("name"): node for node in root.findall("link")}
    return {j.child: j for j in joints}, links, joints, root


def chain_of(above, base, tip):
    path, link = [], tip
    while link != base:
        if link not in above or len(path) > len(above):
            return None
        path.insert(0, above[link])
        link = above[link].parent
    return path


def urdf_flange(path, q):
    X, values = np.eye(4), iter(q)
    for joint in path:
        X = X @ joint.X
        if not joint.moves():
            continue
        axis, value = joint.axis / np.linalg.norm(joint.axis), next(values)
        X = X @ (pose(p=value * axis) if joint.type == "prismatic" else pose(rotation(axis, value)))
    return X


def cell_flange(cell, q):
    rad = math.radians
    robot = cell["robot"]
    roll, pitch, yaw = (rad(v) for v in robot["base_rpy_deg"])
    X = pose(rotation((0, 0, 1), yaw) @ rotation((0, 1, 0), pitch) @ rotation((1, 0, 0), roll),
             np.array(robot["base_xyz_mm"]) / 1e3)
    for row, value in zip(robot["joint"], q):
        slides = row.get("type") == "prismatic"
        moved = row.get("sign", 1) * value
        theta = rad(row.get("theta_offset_deg", 0)) + (0 if slides else moved)
        d = row["d_mm"] / 1e3 + (moved if slides else 0)
        Rz, Rx = pose(rotation((0, 0, 1), theta)), pose(rotation((1, 0, 0), rad(row["alpha_deg"])))
        Ry = pose(rotation((0, 1, 0), rad(row.get("beta_deg", 0))))
        Tz, Tx = pose(p=(0, 0, d)), pose(p=(row["a_mm"] / 1e3, 0, 0))
        if robot["convention"] == "dh":
            X = X @ Rz @ Tz @ Tx @ Rx @ Ry @ pose(rotation((0, 0, 1), rad(row.get("gamma_deg", 0))))
        else:
            X = X @ Rx @ Tx @ Ry @ Rz @ Tz
    return X


def fault_on_arm(urdf, message):
    """Whether this script, too, finds what the message refuses on the arm or fixed to it."""
    if urdf is None:
        return "not a URDF"
    above, links, joints, root = urdf
    if "xacro" in message and any("xacro_" in node.tag for node in root.iter()):
        return "xacro left over"
    if not any(j.moves() for j in joints):
        return "no moving joint"
    if "--tip: is needed" in message or "moving joints; allowed" in message:
        return "no chain of 1 to 12 joints is named"
    named = re.findall(r"(joint|link) ([^\s:]+?)[.:]", message)
    for kind, name in named:
        for j in joints:
            if kind == "joint" and j.name == name:
                known = ("fixed", "revolute", "continuous", "prismatic")
                if j.type not in known or j.mimics:
                    return f"joint {name} is {j.type}{', mimics' if j.mimics else ''}"
                length = np.linalg.norm(j.axis)
                if j.moves() and abs(length - 1) > 1e-3:
                    return f"axis of {name} has the length {length:.4g}"
                if j.limits and (j.limits[0] >= j.limits[1] or max(map(abs, j.limits)) > 125):
                    return f"limits of {name}: {j.limits}"
                if j.parent not in links or j.child not in links:
                    return f"joint {name} refers to a link that is missing"
                if sum(o.name == name for o in joints) > 1:
                    return f"two joints {name}"
                if sum(o.child == j.child for o in joints) > 1:
                    return f"{j.child} has two parents"
        if kind == "link" and name in links:
            mass = links[name].find("inertial/mass")
            if mass is not None and not 0 <= float(mass.get("value")) <= 10000:
                return f"mass of {name}"
            if "ring" in message:
                return "a ring of links"
    return None


def run(product, path, folder, extra=()):
    out = folder / "cell.toml"
    out.unlink(missing_ok=True)
    done = subprocess.run([product, "import-urdf", str(path), "--out", str(out), *extra],
                          capture_output=True, text=True, errors="replace", timeout=60)
    return done.returncode, done.stderr, out if out.exists() else None


def judge(product, path, folder, random):
    """(kind, remark): converted, refused, WRONG, UNFOUNDED."""
    code, said, out = run(product, path, folder)
    choice = re.search(r"the chain may end in (.*?); choose", said)
    if code != 0 and choice:
        code, said, out = run(product, path, folder, ("--tip", choice.group(1).split(", ")[0]))
    first = next((l for l in said.splitlines() if "warning" not in l), said.strip()[:200])
    try:
        urdf = read_urdf(path)
    except ValueError:
        urdf = None
    if code != 0:
        if code not in (1, 2) or out or not said.strip():
            return "WRONG", f"exit code {code}, {'a cell, ' if out else ''}{said[-200:]}"
        why = fault_on_arm(urdf, said)
        lines = [l for l in said.splitlines() if "warning" not in l]
        return ("refused", why) if why else ("UNFOUNDED", f"{len(lines)} lines: {first[:300]}")
    ends = re.search(r"(\d+) joints from (.*?) to (.*?); over", said)
    if urdf is None or not ends or out is None:
        return "WRONG", said[-200:]
    chain = chain_of(urdf[0], ends.group(2), ends.group(3))
    cell = tomllib.loads(out.read_text())
    moving = [j for j in chain if j.moves()]
    if len(moving) != int(ends.group(1)) or len(moving) != len(cell["robot"]["joint"]):
        return "WRONG", "number of joints"
    place = angle = 0.0
    for _ in range(POSTURES):
        q = [random.uniform(*(j.limits or (-math.pi, math.pi))) for j in moving]
        A, B = urdf_flange(chain, q), cell_flange(cell, q)
        place = max(place, np.linalg.norm(A[:3, 3] - B[:3, 3]))
        turn = A[:3, :3].T @ B[:3, :3]
        angle = max(angle, np.linalg.norm(turn - turn.T) / math.sqrt(8), 0.0
                    if np.trace(turn) > 0 else math.pi)
    if place > SAME_PLACE_M or angle > SAME_ANGLE_RAD:
        return "WRONG", f"{1e6 * place:.3g} um, {angle:.3g} rad apart, exit code 0"
    note = "with a note on right angles" if "right angle" in said else ""
    return "converted", f"{len(moving)} joints, {1e6 * place:.2g} um {note}"


def drawn_urdf(random, kind):
    """An arm of 3 to 9 joints; returns its text and whether it must be converted."""
    n = int(random.integers(3, 10))
    links = "".join(f'<link name="l{i}"/>' for i in range(n + 1)) + '<link name="side"/>'
    joints = []
    for i in range(n):
        angles = [random.choice([0, 1.5708, -math.pi / 2, 3.14159, random.uniform(-3, 3)])
                  for _ in range(3)]
        axis = random.choice(["0 0 1", "0 1 0", "-1 0 0", "0 0 -1", "0.6 0 0.8"])
        joints.append([f"j{i}", random.choice(["revolute", "continuous", "prismatic", "revolute"]),
                       " ".join(f"{random.uniform(-0.5, 0.5):.5f}" for _ in range(3)),
                       " ".join(f"{a:.6g}" for a in angles), axis, "-1.5", "2.5", ""])
    k = int(random.integers(n))
    beside = ["side_joint", "fixed", "0 0 0", "0 0 0", "0 0 1", "-1", "1", ""]
    good = True
    if kind == "mimic":
        joints[k][7], good = '<mimic joint="j0"/>', False
    elif kind == "planar":
        joints[k][1], good = "planar", False
    elif kind == "ball beside":
        beside[1] = "ball"
    elif kind == "planar beside":
        beside[1] = "planar"
    elif kind == "mimic beside":
        beside[1], beside[7] = "revolute", '<mimic joint="not there"/>'
    elif kind == "long axis":
        joints[k][1], joints[k][4], good = "revolute", "0 0 2", False
    elif kind == "limits":
        joints[k][1], joints[k][5], good = "revolute", "3.5", False
    text = "".join(
        f'<joint name="{name}" type="{sort}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{low}" upper="{high}" effort="1" velocity="1"/>{more}</joint>'
        for (name, sort, xyz, rpy, axis, low, high, more), (parent, child) in
        zip(joints + [beside], [(f"l{i}", f"l{i + 1}") for i in range(n)] + [("l0", "side")]))
    if kind == "ring beside":
        links += '<link name="a"/><link name="b"/>'
        text += "".join(f'<joint name="{a}{b}" type="fixed"><parent link="{a}"/><child link="{b}"/>'
                        "</joint>" for a, b in ("ab", "ba"))
    return f'<robot name="drawn">{links}{text}</robot>', good


KINDS = ("plain", "mimic", "planar", "ball beside", "mimic beside", "long axis", "limits",
         "planar beside", "ring beside")


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", nargs="?", help="searched for *.urdf; none: arms are drawn")
    options.add_argument("--product", default="build/bin/plumbline")
    options.add_argument("--drawn", type=int, default=90, help="number of arms to draw")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--verbose", action="store_true", help="one line per file")
    given = options.parse_args()
    random = np.random.default_rng(given.seed)
    counts, listed = {}, []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if given.folder:
            files = [p for p in sorted(pathlib.Path(given.folder).rglob("*"))
                     if p.suffix.lower() == ".urdf"]
            expected = {}
        else:
            files, expected = [], {}
            for k in range(given.drawn):
                kind = KINDS[k % len(KINDS)]
                path = folder / f"{kind.replace(' ', '_')}_{k}.urdf"
                text, expected[path] = drawn_urdf(random, kind)
                path.write_text(text)
                files.append(path)
        for path in files:
            kind, remark = judge(given.product, path, folder, random)
            if path in expected and (kind == "converted") != expected[path] and kind != "WRONG":
                kind = "WRONG"
            counts[kind] = counts.get(kind, 0) + 1
            if given.verbose or kind in ("WRONG", "UNFOUNDED"):
                listed.append(f"{kind:10} {path.name}: {remark}")
    print("\n".join(listed))
    print(f"{len(files)} files: " + ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())))
    print(f"converted: within {1e6 * SAME_PLACE_M:g} um and {SAME_ANGLE_RAD:g} rad over {POSTURES} "
          "postures by an independent calculation; UNFOUNDED: refused, and this script finds no "
          "fault on the arm")
    return 1 if counts.get("WRONG") or counts.get("UNFOUNDED") else 0


if __name__ == "__main__":
    sys.exit(main())
