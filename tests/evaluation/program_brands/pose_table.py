"""Tables of poses: one pose a line, in the ways in which off-line programming systems export them."""

import csv
import io
import re

import numpy as np

from .common import (Motion, Robot, Tool, from_quaternion, from_vector, from_zyx, pose, shift, to_quaternion,
                     to_vector, to_zyx)

NAME = "table of poses"
ARM = "abb"
TOOLS = [Tool(1, shift(0, 0, 0.25)), Tool(2, shift(0.05, 0.02, 0.2))]  # a cell's tool is not turned
RAD = np.pi / 180
START = np.array([5, 15, 10, 5, 55, 10]) * RAD  # tables do not state postures
LOAD = (12.0, (0.02, -0.01, 0.15))
SEEDS = np.array([[10, 15, 10, 5, 60, 20], [12, 18, 8, 8, 62, 15], [-20, 10, 5, -15, 50, 40],
                  [-22, 12, 8, -12, 52, 42], [30, 5, 20, 10, 45, -60]]) * RAD
_LOAD = "%g,%s" % (LOAD[0], ",".join("%g" % (1e3 * c) for c in LOAD[1]))
OPTIONS = {name: ["--load", _LOAD] + (["--tool", "1"] if name != "columns" else [])
           for name in ("euler", "quaternions", "vectors", "kuka", "columns", "blanks")}


def _numbers(X, form):
    z, y, x = to_zyx(X[:3, :3])
    return {"rpy": (x, y, z), "abc": (z, y, x), "q": to_quaternion(X[:3, :3]), "v": to_vector(X[:3, :3])}[form]


def programs():
    robot = Robot(ARM)
    at = [robot.flange(q) @ TOOLS[0].tcp for q in SEEDS]
    rows = lambda form, mm, angle, text, separator=",": [
        separator.join([*(text % (v * mm) for v in X[:3, 3]), *(text % (v * angle) for v in _numbers(X, form))])
        for X in at]
    made = {
        "euler": "\r\n".join(["x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg", *rows("rpy", 1e3, 1 / RAD, "%.4f")]) + "\r\n",
        "quaternions": "\n".join(["x_m;y_m;z_m;qw;qx;qy;qz", *rows("q", 1, 1, "%.9f", ";")]),
        "vectors": "\n".join(["x_mm\ty_mm\tz_mm\trotvec_x_rad\trotvec_y_rad\trotvec_z_rad",
                              *rows("v", 1e3, 1, "%.7f", "\t")]) + "\n",
        "kuka": "\n".join(["# path of the nozzle, \u00b5m are not meant", "X [mm],Y [mm],Z [mm],A [deg],B [deg],C [deg]",
                           *rows("abc", 1e3, 1 / RAD, "\"%.5f\"")]) + "\n",
        "blanks": "\n".join(["  x_mm   y_mm   z_mm   roll_rad   pitch_rad   yaw_rad", "",
                             *("  " + r for r in rows("rpy", 1e3, 1, "%.7f", "   "))]) + "\n",
    }
    lines = ["name,x_mm,y_mm,z_mm,w_deg,p_deg,r_deg,tool"]
    for i, q in enumerate(SEEDS):
        tool = TOOLS[i % 2]
        X = robot.flange(q) @ tool.tcp
        lines.append("p%d,%s,%d" % (i, ",".join("%.4f" % v for v in (
            *(1e3 * X[:3, 3]), *(v / RAD for v in _numbers(X, "rpy")))), tool.number))
    made["columns"] = "\n".join(lines) + "\n"
    return {name: {name + (".txt" if name == "blanks" else ".csv"): text.encode()} for name, text in made.items()}


def execute(files):
    (file, data), = files.items()
    lines = re.split(r"\r?\n", data.decode())
    header, motions = None, []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        separator = next((s for s in ";\t," if s in line), None)
        fields = next(csv.reader(io.StringIO(line), delimiter=separator)) if separator else line.split()
        if header is None:
            header = [re.sub(r"[^a-z0-9]+", "_", f.lower()).strip("_") for f in fields]
            continue
        row = dict(zip(header, fields))
        metre = 1.0 if "x_m" in row else 1e-3
        unit = "_m" if metre == 1.0 else "_mm"
        p = np.array([float(row[axis + unit]) for axis in "xyz"]) * metre

        def angles(*names):
            degrees = names[0] + "_deg" in row
            return [float(row[n + ("_deg" if degrees else "_rad")]) * (RAD if degrees else 1) for n in names]
        if "qw" in row:
            R = from_quaternion([float(row["q" + c]) for c in "wxyz"])
        elif "rotvec_x_rad" in row:
            R = from_vector(angles("rotvec_x", "rotvec_y", "rotvec_z"))
        elif "a_deg" in row:
            R = from_zyx(*angles("a", "b", "c"))
        elif "w_deg" in row:
            R = from_zyx(*angles("r", "p", "w"))
        else:
            R = from_zyx(*angles("yaw", "pitch", "roll"))
        tool = TOOLS[int(row.get("tool", 1)) - 1].tcp
        motions.append(Motion("linear", pose(R, p), tool, file, number, LOAD[0], np.array(LOAD[1])))
    return motions
