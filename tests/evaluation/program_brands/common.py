"""What the brands of programs.py share: the arms, their inverse kinematics, rotations, a motion.

A brand is a module beside this one:

    NAME = "KUKA KRL"            as the product calls it
    ARM = "kuka"                 its arm, a key of ARMS
    TOOLS = [Tool(1, tcp), ..]   the tools of the cell; programs use no other tool points
    OPTIONS = {program: [..]}    further options of `plumbline program`; may be absent
    START = joints [rad]         where the robot stands at first, stated to the product; may be absent

    def programs():              {program: {file name: bytes}}: each construct of the language in at
        ...                      least one of them. Write the points from joints,
                                 Robot(ARM).flange(q) @ tool, so that each is in reach, and state
                                 the posture of these joints.
    def execute(files):          [Motion] in the order in which a controller runs them, from
        ...                      {file name: bytes}: an interpreter of the module's own, that knows
                                 the language and not the product.

`execute` is called for the original and for the corrected files. In the original, `Motion.target` is
where the loaded tool shall be; in the corrected files it is what the controller is asked for. The
harness solves the posture, loads the arm and measures the distance between the two.
Lengths are in m, angles in rad, masses in kg; poses are 4 x 4 matrices.
"""

import dataclasses
import os
import sys
import tomllib
from typing import Callable

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from loaded_arm import Arm  # noqa: E402

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../.."))


@dataclasses.dataclass
class Tool:
    """A tool of the cell: a rigid body whose tip is at `tcp`, mass in `mass` and `cog` (in F)."""
    number: int
    tcp: np.ndarray  # X_FT
    mass: float = 0.0
    cog: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))


@dataclasses.dataclass
class Motion:
    kind: str                 # "joint", "linear", "circular", or "spline", whose path is not checked
    target: np.ndarray        # X_BT asked for; for joints that of the unloaded arm
    tool: np.ndarray          # X_FT in force
    file: str
    line: int
    mass: float = 0.0         # load at the flange without what `tool_mass` counts
    cog: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    tool_mass: float = 0.0    # where the language states the tool's own load apart
    tool_cog: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    via: np.ndarray | None = None             # of a circle
    joints: np.ndarray | None = None          # a target in joints, as the controller reads them [rad]
    # Whether readings q [rad] have the posture that the point states; None: it states none, and the
    # nearest posture to the previous one is taken (or to `near`, if that is stated).
    agrees: Callable[[np.ndarray], bool] | None = None
    near: np.ndarray | None = None
    # Why the product leaves the target as it is: computed, joints. Not measured, but not changed.
    left: str = ""
    # The point is also used with another offset, so that it has the correction of one of them.
    shared: bool = False
    instruction: int = 0  # line of the motion, where the point stands elsewhere


# Supplied cell, then what its maker does not publish, chosen for this evaluation alone: mass [kg]
# and compliance [rad/(N m)] of each joint.
ARMS = {
    "ur": ("ur10-typical", None, None),
    "kuka": ("kr210-r2700-2", (300, 232, 180, 60, 40, 15),
             (4e-7, 5e-7, 6e-7, 3e-6, 4e-6, 6e-6)),
    "abb": ("irb4600-60-205", (110, 100, 90, 25, 15, 6), (1.5e-6, 1.8e-6, 2.5e-6, 9e-6, 1e-5, 2e-5)),
    "fanuc": ("m20ia", (60, 55, 45, 12, 8, 3), (4e-6, 5e-6, 7e-6, 2e-5, 2.5e-5, 4e-5)),
    "yaskawa": ("gp25", (70, 60, 50, 14, 9, 3), (4e-6, 5e-6, 7e-6, 2e-5, 2.5e-5, 4e-5)),
}

FOLLOWED = 40  # steps of a path


def pose(R, p):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def shift(x, y, z):
    return pose(np.eye(3), (x, y, z))


def about(axis, angle):
    """Rotation by `angle` about the base axis 0, 1 or 2."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


def from_zyx(z, y, x):
    """Rz(z) Ry(y) Rx(x): A, B, C of KUKA, R, P, W of FANUC, Rz, Ry, Rx of Yaskawa."""
    return about(2, z) @ about(1, y) @ about(0, x)


def to_zyx(R):
    """(z, y, x), y in -90..90 deg."""
    y = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if abs(R[2, 0]) > 1 - 1e-12:
        return np.arctan2(-R[0, 1], R[1, 1]), y, 0.0
    return np.arctan2(R[1, 0], R[0, 0]), y, np.arctan2(R[2, 1], R[2, 2])


def from_quaternion(q):
    """Of (w, x, y, z), of any length."""
    w, x, y, z = np.asarray(q, float) / np.linalg.norm(q)
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) * (w * w - v @ v) + 2 * np.outer(v, v) + 2 * w * cross


def to_quaternion(R):
    """(w, x, y, z) with w >= 0."""
    w, v = np.linalg.eigh(np.array([
        [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
        [0, R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
        [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
        [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]]]), UPLO="U")
    q = v[:, -1]
    return q if q[0] >= 0 else -q


def from_vector(v):
    """Rotation about v by its length."""
    v = np.asarray(v, float)
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.eye(3) + np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return from_quaternion(np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * v / angle]))


def to_vector(R):
    q = to_quaternion(R)
    length = np.linalg.norm(q[1:])
    return 2 * q[1:] if length < 1e-12 else 2 * np.arctan2(length, q[0]) * q[1:] / length


def apart(A, B):
    """Distance [m] and angle [rad] between two poses."""
    return np.linalg.norm(A[:3, 3] - B[:3, 3]), np.linalg.norm(to_vector(A[:3, :3].T @ B[:3, :3]))


def turned(A, B, s):
    """Rotation from A to B at the part s of the way."""
    return A @ from_vector(s * to_vector(A.T @ B))


def on_path(kind, start, via, end, s):
    """Pose at the part s of a linear or circular motion; orientations turn evenly."""
    R = turned(start[:3, :3], end[:3, :3], s)
    a, c = start[:3, 3], end[:3, 3]
    if kind != "circular" or via is None:  # of an arc through three points, its chord
        return pose(R, a + s * (c - a))
    b = via[:3, 3]
    u, v = b - a, c - a
    n = np.cross(u, v)
    centre = a + (np.cross(n, u) * (v @ v) + np.cross(v, n) * (u @ u)) / (2 * (n @ n))
    x = a - centre
    y = np.cross(n / np.linalg.norm(n), x)
    angle = np.arctan2((c - centre) @ y, (c - centre) @ x) % (2 * np.pi)
    return pose(R, centre + np.cos(s * angle) * x + np.sin(s * angle) * y)


class Robot:
    """An arm with compliant joints, in the readings of its controller [rad]."""

    def __init__(self, arm, stiff=False):
        name, masses, compliances = ARMS[arm]
        with open(os.path.join(ROOT, "config/cells", name + ".toml"), "rb") as file:
            self.cell = tomllib.load(file)
        robot = self.cell["robot"]
        rad, joints = np.pi / 180, robot["joint"]
        for i, j in enumerate(joints):
            if masses:
                j["link_mass_kg"] = float(masses[i])
                # Half of the link, in the frame after its joint (distal Denavit-Hartenberg).
                j["link_com_mm"] = [-j["a_mm"] / 2, -np.sin(j["alpha_deg"] * rad) * j["d_mm"] / 2,
                                    -np.cos(j["alpha_deg"] * rad) * j["d_mm"] / 2]
                j["compliance_rad_per_Nm"] = compliances[i]
            j["compliance_rad_per_Nm"] *= not stiff
        n = len(joints)
        # The angles of the axes are self.axes @ readings.
        self.axes = np.eye(n)
        for c in robot.get("coupling", []):
            self.axes[c["joint"] - 1] += c["ratio"] * self.axes[c["of"] - 1]
        self.axes = np.diag([j.get("sign", 1.0) for j in joints]) @ self.axes
        self.low = np.array([j.get("min_deg", -180.0) for j in joints]) * rad
        self.high = np.array([j.get("max_deg", 180.0) for j in joints]) * rad
        self.arm = Arm([{"a": j["a_mm"] / 1e3, "alpha": j["alpha_deg"] * rad, "d": j["d_mm"] / 1e3,
                         "offset": j["theta_offset_deg"] * rad, "mass": j["link_mass_kg"],
                         "com": np.array(j["link_com_mm"]) / 1e3,
                         "compliance": j["compliance_rad_per_Nm"]} for j in joints],
                       robot["convention"], {"length": 0.0}, robot["gravity_m_s2"])

    def flange(self, q):
        """X_BF of the unloaded arm at the readings q."""
        _, _, after = self.arm.frames(self.axes @ np.asarray(q, float))
        return pose(*after[-1])

    def landed(self, q, tool, mass, cog):
        """X_BT of the loaded arm commanded to q."""
        compliance = np.array([j["compliance"] for j in self.arm.joints])
        sagged = self.arm.sagged(self.axes @ np.asarray(q, float), mass, np.asarray(cog, float),
                                 compliance)
        return pose(*self.arm.frames(sagged)[2][-1]) @ tool

    def inverse(self, X_BF, near, turns=60):
        """Readings with the flange at X_BF, by Newton from `near`; None if they are not found."""
        q = np.array(near, float)
        for _ in range(turns):
            axes, points, after = self.arm.frames(self.axes @ q)
            X = pose(*after[-1])
            error = np.concatenate([X_BF[:3, 3] - X[:3, 3], to_vector(X_BF[:3, :3] @ X[:3, :3].T)])
            J = np.array([np.concatenate([np.cross(a, X[:3, 3] - p), a])
                          for a, p in zip(axes, points)]).T @ self.axes
            if np.abs(error).max() < 1e-13:
                return q
            step = J.T @ np.linalg.solve(J @ J.T + 1e-12 * np.eye(6), error)
            q += step * min(1.0, 0.5 / np.abs(step).max())
        return q if np.abs(error).max() < 1e-10 else None

    def postures(self, X_BF, seed=0, tries=80):
        """Every posture within the limits that some start leads to, with its whole turns."""
        random, found = np.random.default_rng(seed), []
        for _ in range(tries):
            q = self.inverse(X_BF, self.low + random.random(len(self.low)) * (self.high - self.low))
            if q is None:
                continue
            q = (q + np.pi) % (2 * np.pi) - np.pi
            if not any(np.abs(q - other).max() < 1e-6 for other in found):
                found.append(q)
        turned = [q + 2 * np.pi * np.array(turns) for q in found
                  for turns in np.ndindex(*(3,) * len(q))
                  for turns in [np.array(turns) - 1]]
        return [q for q in turned if (q >= self.low - 1e-9).all() and (q <= self.high + 1e-9).all()]

    def solve(self, motion, previous, target=None, followed=True):
        """Readings of a motion's target, or of `target`, after the readings `previous`.
        followed: a linear or circular motion keeps the posture of `previous` on its path."""
        if motion.joints is not None and target is None:
            return motion.joints
        X_BF = (motion.target if target is None else target) @ np.linalg.inv(motion.tool)
        near = motion.near if motion.near is not None else previous
        if target is not None:
            return self.inverse(X_BF, near)
        if motion.kind == "joint" or not followed:
            if motion.agrees is None:
                return self.inverse(X_BF, near)
            fitting = [q for q in self.postures(X_BF) if motion.agrees(q)]
            return min(fitting, key=lambda q: np.abs(q - near).max(), default=None)
        if motion.near is not None:
            return self.inverse(X_BF, near)
        return self.followed(motion, near)

    def followed(self, motion, q):
        """Readings at the end of a linear or circular motion from the readings `q`: the path is followed
        in steps, on which an arm keeps its posture. None if a step is out of reach."""
        X_BT = self.flange(q) @ motion.tool
        back = np.linalg.inv(motion.tool)
        for s in np.linspace(0, 1, FOLLOWED + 1)[1:]:
            q = self.inverse(on_path(motion.kind, X_BT, motion.via, motion.target, s) @ back, q)
            if q is None:
                return None
        return q

    def cell_text(self, tools, stiff=False):
        """cell.toml of this arm with these tools, and loads at any place."""
        robot = self.cell["robot"]
        value = lambda v: ("true" if v else "false") if isinstance(v, bool) else (
            f'"{v}"' if isinstance(v, str) else
            "[" + ", ".join(map(value, v)) + "]" if isinstance(v, (list, np.ndarray)) else
            "{ " + ", ".join(f"{k} = {value(w)}" for k, w in v.items()) + " }"
            if isinstance(v, dict) else repr(float(v)) if isinstance(v, (float, np.floating))
            else str(v))
        lines = ["schema = 1", "[robot]"]
        lines += [f"{key} = {value(robot[key])}" for key in robot if key != "joint"]
        for joint in robot["joint"]:
            lines += ["[[robot.joint]]"] + [f"{k} = {value(v)}" for k, v in joint.items()]
        for tool in tools:
            lines += ["[[tool]]" if len(tools) > 1 else "[tool]"]
            lines += [f"number = {tool.number}"] if len(tools) > 1 else []
            lines += ['model = "rigid"', f"tcp_mm = {value(tool.tcp[:3, 3] * 1e3)}"]
        lines += ["[payload]", "cog_mm = [0.0, 0.0, 0.0]"]
        lines += ["[measurement]", 'kind = "pose"', "sigma_mm = 0.01", "sigma_deg = 0.001"]
        return "\n".join(lines) + "\n"
