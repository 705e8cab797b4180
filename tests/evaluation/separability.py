"""Whether a data set can tell its hidden effect from another, by the simulator's own columns.

The displacement of the hidden effect over the measured rows is projected on the columns of every
rival (frames that the cell calls unknown, and the other hidden effects, always refitted). What is
left, as a norm over sigma, is how far apart the two explanations lie:
below 3.3 no method can tell, above 6 every good one should. A rival that physics excludes is none:
one of a sign that no machine has, or a turn between axes that are not parallel, which is the offset
of the next joint by another name.
"""

import csv
import itertools
import json
import os
import subprocess

import numpy as np

TELLS_NOTHING, TELLS = 3.3, 6.0
MANY_ROWS = 1000  # where everything can be told apart, and the projections take minutes
CYCLES = [0.5, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24]
PER_JOINT = ["joint_offset", "gear_ratio", "joint_compliance", "joint_hardening", "backlash/load",
             "backlash/move", "approach_lag", "dynamic_inertia", "following_error",
             "arrival_friction", "bearing_tilt", "axis_bending", "compliance_asymmetry"]
BY_PARAMETER = ["link_geometry", "axis_coupling", "link_bending", "guide_play"]  # several columns a joint
# Several columns a joint, too many to be a rival in all of their choices.
TRUTH_ONLY = ["gravity_sag"]
WHOLE = ["base_frame", "tool_frame", "tool_stiffness", "tool_shear", "tool_root_compliance",
         "payload_mass", "payload_cog", "gravity_direction", "pedestal_compliance",
         "thermal_growth", "latency", "measurement_scale", "counterbalance",
         "camera_tag_size", "camera_zoom", "camera_lens", "base_tilt", "range_zero", "range_anchor"]
# No machine has a negative compliance, clearance, inertia or expansion: a rival that would need one
# is none.
NOT_NEGATIVE = {"tool_root_compliance", "pedestal_compliance", "thermal_growth", "joint_hardening",
                "link_bending", "bearing_tilt", "axis_bending", "guide_play", "dynamic_inertia"}
OF_TIME = ("thermal_drift", "step_event", "tilt_event", "offset_event")
BY_NAME = WHOLE + BY_PARAMETER + TRUTH_ONLY + ["gear_periodic", "tilt_event"]


def points(path):
    return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)


def table(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def read_columns(prefix):
    with open(prefix + ".json") as file:
        heads = json.load(file)
    values = np.fromfile(prefix + ".bin").reshape(len(heads), -1)
    return heads, values


class Blocks:
    """Column blocks of the effects at one data set, in mm per unit, (3 rows, parameters)."""

    def __init__(self, heads, values, rows, seen=slice(None)):
        """seen: which of the rows' coordinates, three a row or one range, were measured"""
        axes = len(values[0]) // len(rows)
        self.columns = {}
        for head, value in zip(heads, values):
            name = head["id"]
            if name == "backlash":
                name += "/" + head["name"].split("_")[1]
            label = head["name"] if name in BY_NAME else head["scope"][0]
            self.columns[name, label] = value[seen]
        self.t = np.repeat([float(r.get("t_s") or 0.0) for r in rows], axes)[seen]
        self.session = np.repeat([r.get("session", "") for r in rows], axes)[seen]

    def of(self, name):
        return {k[1]: v for k, v in self.columns.items() if k[0] == name}

    def stack(self, name, labels=None):
        found = self.of(name)
        chosen = [found[l] for l in (labels or found) if l in found]
        return np.array(chosen).T if chosen else np.zeros((len(self.t), 0))

    def frames(self, of):
        return np.array([self.columns[of + "_frame", a] for a in "xyz"]).T

    def is_an_offset(self, name, label):
        """True of a turn about y that any joint's offset makes, too: the axes are not parallel."""
        if name != "link_geometry" or not label.startswith("beta"):
            return False
        turn, offsets = self.columns[name, label], self.stack("joint_offset")
        length = np.linalg.norm(turn)
        return length > 0 and left_over(turn / length, np.zeros((len(turn), 0)), offsets) < 1e-3

    def drift(self, tau):
        return self.frames("base") * (1 - np.exp(-self.t / tau))[:, None]

    def step(self, time, frame):
        return self.frames(frame) * (self.t >= time)[:, None]

    def zoom(self, time):
        return self.stack("camera_zoom") * (self.t >= time)[:, None]

    def tilt(self, time):
        return self.stack("tilt_event") * (self.t >= time)[:, None]

    def jump(self, time, joints):
        return self.stack("joint_offset", joints) * (self.t >= time)[:, None]

    def nuisances(self):
        both = np.hstack([self.stack("base_frame"), self.stack("tool_frame")])
        return np.hstack([both * (self.session == s)[:, None] for s in sorted(set(self.session))])

    def effect(self, effect, key):
        """The block of a hidden effect itself; for its sub-scopes, by joint."""
        values = {p["name"]: p["value"] for p in effect["parameters"]}
        name = key[0]
        if name in BY_PARAMETER + TRUTH_ONLY:
            return {p: self.columns[name, p][:, None] for p in values}
        if name in PER_JOINT:
            return {q: self.columns[name, q][:, None] for q in sorted(key[1])}
        if name == "gear_periodic":
            found = {}
            for q in sorted(key[1]):
                cycles = f"{values[q + '_cycles']:g}"
                found[q] = np.array([self.columns[name, f"{q}_{w}_{cycles}"] for w in ("sin", "cos")]).T
            return found
        if name == "thermal_drift":
            return {"": self.drift(values["time_constant"])}
        if name == "step_event":
            return {"": self.step(values["time"], effect["frame"])}
        if name == "tilt_event":
            return {"": self.tilt(values["time"])}
        if name == "offset_event":
            return {q: self.jump(values["time"], [q]) for q in sorted(key[1])}
        if name == "camera_zoom":
            return {"": self.zoom(values.get("time", 0.0))}
        return {"": self.stack(name)}


def rivals(blocks, joints, how_many):
    """(name, labels, parameters, columns) of everything that could stand for a hidden effect."""
    for name in WHOLE:
        block = blocks.stack(name)
        if block.shape[1]:
            yield name, (), block.shape[1], block
    for name in PER_JOINT + BY_PARAMETER:
        labels = [l for l in sorted(blocks.of(name)) if not blocks.is_an_offset(name, l)]
        for size in range(1, min(how_many, 3) + 1):
            for chosen in itertools.combinations(labels, size):
                yield name, chosen, size, blocks.stack(name, chosen)
    for joint in joints:
        for cycles in CYCLES:
            yield "gear_periodic", (joint,), 2 if cycles == 1 else 3, blocks.stack(
                "gear_periodic", [f"{joint}_sin_{cycles:g}", f"{joint}_cos_{cycles:g}"])
    for pair in itertools.combinations(joints, 2) if how_many > 1 else ():
        labels = [f"{q}_{w}_1" for q in pair for w in ("sin", "cos")]
        yield "gear_periodic", pair, 4, blocks.stack("gear_periodic", labels)
    for tau in (200, 600, 1200, 2400, 5000):
        yield "thermal_drift", (), 4, blocks.drift(tau)
    times = np.unique(blocks.t)
    for time in times[2:-1]:
        for frame in ("base", "tool"):
            yield "step_event", (frame,), 4, blocks.step(time, frame)
        yield "tilt_event", (), 3, blocks.tilt(time)
        for joint in joints:
            yield "offset_event", (joint,), 2, blocks.jump(time, [joint])
        if blocks.of("camera_zoom"):
            yield "camera_zoom", (), 2, blocks.zoom(time)


def joint_of(name, label):
    """The joint that a parameter of several a joint belongs to: q3 of beta3 and of q3_of_q2."""
    if name == "link_geometry":
        return "q" + label.lstrip("abdehlpt")
    return label.split("_")[0]


def left_over(field, fixed, block):
    """Norm of the field that neither the fixed columns nor the block can imitate."""
    basis = np.hstack([fixed, block])
    if basis.shape[1] == 0:
        return float(np.linalg.norm(field))
    scale = np.linalg.norm(basis, axis=0)
    basis = basis[:, scale > 0] / scale[scale > 0]
    u, s, _ = np.linalg.svd(basis, full_matrices=False)
    u = u[:, s > 1e-7 * s[0]] if s.size else u
    return float(np.linalg.norm(field - u @ (u.T @ field)))


def least_left_over(field, fixed, block):
    """left_over where no value of the block's columns may be negative."""
    best = left_over(field, fixed, block[:, :0])
    for size in range(1, block.shape[1] + 1):
        for chosen in itertools.combinations(range(block.shape[1]), size):
            columns = np.hstack([fixed, block[:, chosen]])
            scale = np.linalg.norm(columns, axis=0)
            scale[scale == 0] = 1
            values = np.linalg.lstsq(columns / scale, field, rcond=1e-7)[0]
            if (values[fixed.shape[1]:] >= 0).all():
                best = min(best, left_over(field, fixed, block[:, chosen]))
    return best


def rank(block):
    scale = np.linalg.norm(block, axis=0)
    if not (scale > 0).any():
        return 0
    s = np.linalg.svd(block[:, scale > 0] / scale[scale > 0], compute_uv=False)
    return int(np.sum(s > 1e-6 * s[0]))


def judge_blocks(truth, keys, blocks, fields, sigma_mm):
    """class, distance to the nearest rival and who that is; for each effect its joints too small to
    see and, for links, the joints of parameters that say the same; the ids of all confusable."""
    joints = sorted({k[1] for k in blocks.columns if k[0] == "joint_offset"})
    nuisances = blocks.nuisances() if truth.get("unaligned") else np.zeros((len(blocks.t), 0))
    own = [blocks.effect(e, k) if truth["in_catalogue"] else {"": f[:, None]}
           for e, k, f in zip(truth["effects"], keys, fields)]
    nearest_simple = nearest = (np.inf, "")
    optional, twins, unseen, confusable = [], [], False, set()
    for number, field in enumerate(fields):
        others = [np.hstack(list(b.values())) for i, b in enumerate(own) if i != number]
        fixed = np.hstack([nuisances] + others) / sigma_mm
        field = field / sigma_mm
        name, scope = keys[number]
        # Linearised frames reach only so far; a field that they cannot show is seen.
        if left_over(field, fixed, np.zeros((len(field), 0))) < TELLS_NOTHING:
            unseen = True
        parts = own[number]
        small = []
        if len(parts) > 1:
            for label in parts:
                rest = np.hstack([b for l, b in parts.items() if l != label]) / sigma_mm
                if left_over(field, fixed, rest) < TELLS:
                    small.append(label)
        labels = [q for q in scope if all(
            l in small for l in parts if l == q or joint_of(name, l) == q)]
        optional.append(labels if name in BY_PARAMETER + TRUTH_ONLY else small)
        needed = set(parts) - set(small)
        parameters = sum(b.shape[1] for l, b in parts.items() if l in needed or not l)
        if name in OF_TIME:
            parameters += 1
        if name == "gear_periodic":
            parameters += len(needed)
        if name == "camera_zoom" and any(p["name"] == "time" for p in truth["effects"][number]["parameters"]):
            parameters += 1
        twins.append([])
        for rival, chosen, count, block in rivals(blocks, joints, max(1, len(needed))):
            same = rival == name and (not chosen or needed <= set(chosen) or
                                      name in OF_TIME)
            if same or (rival == "counterbalance" and name == "gear_periodic" and scope == {"q2"}) or (
                    name == "counterbalance" and rival == "gear_periodic" and chosen == ("q2",)):
                continue
            if rival in ("base_frame", "tool_frame") and truth.get("unaligned"):
                continue
            distance = (least_left_over if rival in NOT_NEGATIVE else left_over)(
                field, fixed, block / sigma_mm)
            count -= block.shape[1] - rank(block)
            label = f"{rival}{list(chosen) if chosen else ''}"
            if distance < TELLS_NOTHING:
                confusable.add(rival)
            if distance < nearest[0]:
                nearest = (distance, label)
            if rival == name == "link_geometry" and distance < TELLS_NOTHING:
                # Another way to write the same link: d of parallel axes, for example.
                twins[-1].append(sorted({joint_of(name, c) for c in chosen}))
            elif count <= parameters and distance < nearest_simple[0]:
                nearest_simple = (distance, label)
    if unseen:
        kind = "unseen"
    elif nearest_simple[0] < TELLS_NOTHING:
        kind = "ambiguous"
    elif nearest[0] < TELLS:
        kind = "between"
    else:
        kind = "separable"
    return {"class": kind, "distance": nearest[0], "nearest": nearest[1], "optional": optional,
            "twins": twins, "confusable": sorted(confusable)}


def judge(folder, simulate, keys_of, measured=None):
    """Judges the data set in a folder that plumbline-simulate wrote, by the rows of `measured` (else of
    measured.csv): of a row that lacks coordinates only those that it has."""
    with open(os.path.join(folder, "truth.json")) as file:
        truth = json.load(file)
    if not truth["effects"]:
        return {"class": "none", "optional": []}
    if truth["n_train"] > MANY_ROWS:
        return {"class": "separable", "optional": [[] for _ in truth["effects"]]}
    place = lambda name: os.path.join(folder, name)
    measured = measured or place("measured.csv")
    rows = table(measured)
    # The cell with the masses of its links, where the product's file lacks them.
    cell = place("true_cell.toml") if os.path.exists(place("true_cell.toml")) else place("cell.toml")
    read = [c for c in ("x_mm", "y_mm", "z_mm", "range_mm") if c in rows[0]]
    seen = np.array([bool(row[c]) for row in rows for c in read])

    def tips(effects):
        with open(place("with.json"), "w") as file:
            json.dump({"effects": effects, "nuisances": truth["nuisances"]}, file)
        subprocess.run([simulate, "--predict", "--with", place("with.json"), "--cell", cell,
                        "--poses", measured, "--out", place("tips.csv")], check=True)
        return points(place("tips.csv")).ravel()[seen]

    still = tips([])
    cycles = set(CYCLES)
    for effect in truth["effects"]:
        cycles |= {p["value"] for p in effect["parameters"] if p["name"].endswith("_cycles")}
    fields = [tips([effect]) - still for effect in truth["effects"]]
    tips([])  # leaves with.json with the nuisances alone
    subprocess.run([simulate, "--columns", "--cell", cell, "--measured",
                    measured, "--with", place("with.json"), "--out", place("columns"),
                    "--cycles", ",".join(f"{c:g}" for c in sorted(cycles))], check=True)
    blocks = Blocks(*read_columns(place("columns")), rows, seen)
    keys = [keys_of(effect) for effect in truth["effects"]]
    # Nobody can see below the noise, nor claim to see below what it is declared to be.
    sigma_mm = 1e3 * max(truth["sigma"], truth.get("declared_sigma", 0.0))
    return judge_blocks(truth, keys, blocks, fields, sigma_mm)
