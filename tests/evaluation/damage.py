"""What happens to recorded files: values that are lost, and mistakes that no effect should be blamed
for. Each transforms the cell's text and the rows of measured.csv (dictionaries of texts)."""

import csv
import os
import re
import shutil

import numpy as np

MEASURED = ("x_mm", "y_mm", "z_mm")


def lose_values(share):
    def lose(cell, rows, draw):
        for row in rows:
            for name in MEASURED:
                if draw.random() < share:
                    row[name] = ""
        return cell, rows
    return lose


def lose_points(share):
    def lose(cell, rows, draw):
        for row in rows:
            if draw.random() < share:
                row.update(dict.fromkeys(MEASURED, ""))
        return cell, rows
    return lose


def joints(row):
    return [name for name in row if re.fullmatch(r"q\d+_deg", name)]


def change(*names, by):
    def changed(cell, rows, draw):
        for row in rows:
            for name in names:
                row[name] = f"{by(float(row[name])):.5f}"
        return cell, rows
    return changed


def swap(cell, rows, draw):
    for row in rows:
        row["x_mm"], row["y_mm"] = row["y_mm"], row["x_mm"]
    return cell, rows


def radians(cell, rows, draw):
    return change(*joints(rows[0]), by=np.radians)(cell, rows, draw)


def last_sign(cell, rows, draw):
    return change(joints(rows[0])[-1], by=lambda q: -q)(cell, rows, draw)


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def other_euler(cell, rows, draw):
    """A base turned by Rx(a) Ry(b) Rz(c), whose angles are written as roll, pitch and yaw."""
    angles = draw.uniform(10, 40, 3) * draw.choice([-1, 1], 3)
    base = turn(0, np.radians(angles[0])) @ turn(1, np.radians(angles[1])) @ turn(2, np.radians(angles[2]))
    for row in rows:
        turned = base @ [float(row[name]) for name in MEASURED]
        row.update({name: f"{value:.5f}" for name, value in zip(MEASURED, turned)})
    words = lambda v: "[" + ", ".join(f"{x:.6g}" for x in v) + "]"
    cell = re.sub(r"gravity_m_s2 = .*", f"gravity_m_s2 = {words(base @ [0, 0, -9.80665])}", cell)
    return re.sub(r"base_rpy_deg = .*", f"base_rpy_deg = {words(angles)}", cell), rows


def shuffle_clock(cell, rows, draw):
    times = draw.permutation([row["t_s"] for row in rows])
    for row, time in zip(rows, times):
        row["t_s"] = str(time)
    return cell, rows


def restart_clock(cell, rows, draw):
    first = len(rows) * 2 // 5 + int(draw.integers(0, len(rows) // 5))
    zero = float(rows[first]["t_s"])
    for row in rows[first:]:
        row["t_s"] = f"{float(row['t_s']) - zero:.5f}"
    return cell, rows


def sentinels(cell, rows, draw):
    for row in rows:
        if draw.random() < 0.05:
            row.update(dict.fromkeys(MEASURED, "-9999"))
    return cell, rows


def half_way(pick, by, form="{:.5f}"):
    """Columns that change their unit at a row between 30 and 70 % of the file: from there on, or up
    to there. The line is that of the first or the last number that differs."""
    def changed(cell, rows, draw):
        at = int(draw.integers(int(0.3 * len(rows)), int(0.7 * len(rows))))
        from_there = bool(draw.integers(0, 2))
        names = pick(rows[0], draw)
        other = [k for k in range(len(rows)) if (k >= at) == from_there
                 and any(float(rows[k][name]) != by(float(rows[k][name])) for name in names)]
        for k in other:
            for name in names:
                rows[k][name] = form.format(by(float(rows[k][name])))
        line = (other[0] if from_there else other[-1]) + 2
        columns = names[0] if len(names) == 1 else ".*"
        return cell, rows, rf"{columns}.*{'from' if from_there else 'up to'} line {line}\b"
    return changed


def one_joint(row, draw):
    return [str(draw.choice(joints(row)[:-1]))]


def every_joint(row, draw):
    return joints(row)


def columns(*names):
    return lambda row, draw: list(names)


def as_it_is(cell, rows, draw):
    return cell, rows


LOST = {f"{share} % {what}": lose(share / 100) for share in (15, 30)
        for what, lose in (("measured values empty", lose_values), ("rows unmeasured", lose_points),
                           ("lines lost", lose_points))}
MISTAKES = {
    "y axis mirrored": change("y_mm", by=lambda v: -v), "x and y swapped": swap,
    "inches": change(*MEASURED, by=lambda v: v / 25.4), "radians": radians,
    "other Euler convention": other_euler, "last joint's sign": last_sign,
    "shuffled clock": shuffle_clock, "restarted clock": restart_clock, "sentinels": sentinels,
    "kelvin": change("temp_C", by=lambda v: v + 273.15),
    "pounds": change("payload_kg", by=lambda v: v / 0.45359237), "TCP 30 mm off": as_it_is}
HALF_WAY = {
    "one joint's degrees, then radians": half_way(one_joint, np.radians, "{:.7f}"),
    "degrees, then radians": half_way(every_joint, np.radians, "{:.7f}"),
    "millimetres, then metres": half_way(columns(*MEASURED), lambda v: v / 1000, "{:.8f}"),
    "millimetres, then inches": half_way(columns(*MEASURED), lambda v: v / 25.4, "{:.7f}"),
    "kilograms, then grams": half_way(columns("payload_kg"), lambda v: 1000 * v),
    "kilograms, then pounds": half_way(columns("payload_kg"), lambda v: v / 0.45359237),
    "degrees Celsius, then kelvin": half_way(columns("temp_C"), lambda v: v + 273.15)}
MISTAKES |= HALF_WAY
# What a message must say to have named the mistake.
WORDS = {
    "y axis mirrored": r"mirror|left-handed|handedness|y_mm.*(sign|negat|other way)",
    "x and y swapped": r"swap|exchanged|interchanged|permut|x_mm and y_mm",
    "inches": r"\binch", "radians": r"\bradian",
    "other Euler convention": r"euler|rpy|roll.*pitch.*yaw|rotation convention|order of rotation",
    "last joint's sign": r"\bq6\b.*(\bsign\b|other way|revers)|\bsign of (joint )?q?6",
    "shuffled clock": r"\bclock|t_s (falls|decreases|goes back|runs back|jumps)|t_s.*\border\b",
    "restarted clock": r"\bclock|t_s (falls|decreases|goes back|runs back|jumps)|restart",
    "sentinels": r"-9999|sentinel|placeholder|stand-in", "kelvin": r"kelvin",
    "pounds": r"\bpound|\blb\b", "TCP 30 mm off": r"\bTCP\b|\btool_frame\b|\btool (frame|tip|point)"}
UNITS = {"radians": "radian", "metres": "metre", "inches": "inch", "grams": r"\bgram",
         "pounds": "pound", "kelvin": "kelvin"}


def apply(name, folder, seed):
    """Rewrites cell.toml and measured.csv of a folder. as_executed.csv keeps every row that the robot
    went to, without the values that were lost: what the truth is judged on.

    @return  what a message must say to have named a mistake, as a pattern; "" where values are lost"""
    place = lambda file: os.path.join(folder, file)
    with open(place("cell.toml")) as file:
        cell = file.read()
    with open(place("measured.csv")) as file:
        rows = list(csv.DictReader(file))
    columns = list(rows[0])
    transform = LOST.get(name) or MISTAKES[name]
    cell, rows, *change = transform(cell, rows, np.random.default_rng(seed))
    shutil.copy(place("measured.csv"), place("as_executed.csv"))
    if name in LOST:
        write(place("as_executed.csv"), rows, columns)
    if name.endswith("lines lost"):
        rows = [row for row in rows if row["x_mm"]]
    write(place("measured.csv"), rows, columns)
    with open(place("cell.toml"), "w") as file:
        file.write(cell)
    if change:
        # Column and line, and the unit, in either order.
        return rf"(?=.*{UNITS[name.split()[-1]]}).*{change[0]}"
    return WORDS.get(name, "")


def write(path, rows, columns):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
