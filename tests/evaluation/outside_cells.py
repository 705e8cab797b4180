"""Cells that hide a cause of outside_kinds.py: the arm, its measured rows, and the held-out rows of
four groups. Truth is computed by loaded_arm.py and shares nothing with the product; units are SI."""

from types import SimpleNamespace

import numpy as np

import coverage
from loaded_arm import Arm, G, cell_text, turned
from outside_kinds import KINDS, horizontal

GROUPS = ("inside", "region", "load", "later")


def on_rail(joints):
    """Distal table: the rail along z of W, the arm's first axis along y."""
    carriage = {"a": 0.0, "alpha": -np.pi / 2, "d": 0.0, "offset": 0.0, "mass": 150.0,
                "com": np.zeros(3), "compliance": 0.0, "low": -1.5, "high": 1.5, "linear": True}
    return [carriage, *joints]


def draw_cell(seed, of_kind):
    for attempt in range(100):
        name, arm, rated, cog, random = coverage.draw_case(seed + 1000003 * attempt, "all compliance")
        if not of_kind.rail or arm.convention == "dh":
            break
    joints, gravity = arm.joints, arm.gravity
    if of_kind.rail:
        joints, gravity = on_rail(joints), [0, -G, 0]
    arm = Arm(joints, arm.convention, arm.tool, gravity)
    cell = SimpleNamespace(arm=arm, name=name, rated=rated, cog=cog, length=arm.tool["length"],
                           up=-arm.gravity / G)
    cell.low, cell.high = (np.clip([j[k] for j in joints], -2.8, 2.8) for k in ("low", "high"))
    cell.sigma_m = 1e-3 * random.uniform(0.03, 0.1)
    cell.loads = rated * np.linspace(0, 1, of_kind.levels)
    cell.new_load = rated * (1.3 if of_kind.levels < 3 or random.random() < 0.5 else
                             random.uniform(0.6, 0.9) / (of_kind.levels - 1) + 0.5)
    cell.instrument = 4 * (np.array([0, 0, 0.1]) + horizontal(random, cell)) + cell.up
    q = cell.low + random.random((300, len(joints))) * (cell.high - cell.low)
    load, cogs = np.full(300, rated), np.tile(cog, (300, 1))
    cell.torque = np.abs(arm.torques(q, load, cogs)).max(0) + 1e-6
    _, _, after = arm.frames(q)
    cell.moment = np.linalg.norm(arm.moment(after, load, cogs), axis=1).max()
    cell.reach = np.quantile(np.linalg.norm(after[-1][1], axis=1), 0.95)
    # One or two inner joints were measured in one part of their range only.
    cell.parts = {}
    for j in random.choice(3, random.integers(1, 3), replace=False):
        lower = random.random() < 0.5
        cell.parts[int(j)] = ((0, 0.6), (0.68, 1)) if lower else ((0.4, 1), (0, 0.32))
    return cell, random


def draw_poses(cell, count, other_region, random):
    """Poses whose flange is not far below the base, unless a region has hardly any."""
    kept, draws = [], 0
    while sum(map(len, kept)) < count:
        draws += 1
        share = random.random((4 * count, len(cell.low)))
        for j, (part, other) in cell.parts.items():
            low, high = other if other_region else part
            share[:, j] = low + share[:, j] * (high - low)
        q = np.radians(np.round(np.degrees(cell.low + share * (cell.high - cell.low)), 5))
        above = cell.arm.frames(q)[2][-1][1] @ cell.up > -0.2
        kept.append(q[above | (np.abs(cell.arm.gravity[2]) < 1) | (draws > 50)])
    return np.concatenate(kept)[:count]


def gaps(count, random):
    long = random.random(count) < 0.25
    return np.where(long, random.uniform(120, 300, count), random.uniform(15, 60, count))


def execution(cell, count, begin, session, random, other_region=False, load=None, warmer=0.0):
    """Rows in the order of execution; the first one's last move is not in the file."""
    q = draw_poses(cell, count + 1, other_region, random)
    dwell = gaps(count, random)
    t = begin + np.cumsum(dwell)
    own = t - (session - 1) * 80000.0
    temp = (21 + 6 * (1 - np.exp(-own / 3000)) + 1.5 * np.sin(own / 700 + session) + warmer
            + random.normal(0, 0.1, count))
    return {"q": q[1:], "move": np.diff(q, axis=0), "t": np.round(t, 2), "dwell": dwell,
            "temp": np.round(temp, 2), "session": np.full(count, session),
            "load": random.choice(cell.loads, count) if load is None else np.full(count, load)}


def joined(parts):
    return {k: np.concatenate([part[k] for part in parts]) for k in parts[0]}


def draw_rows(cell, of_kind, random, tested=24):
    """The measured rows and those of each group of held-out rows."""
    count = int(random.integers(60, 201))
    each = [count // of_kind.sessions] * of_kind.sessions
    measured = joined([execution(cell, n, 80000.0 * k, k + 1, random) for k, n in enumerate(each)])
    last = of_kind.sessions
    begin, end = 80000.0 * (last - 1), measured["t"][-1]
    cell.span = end
    short = 70.0 * tested
    within = lambda: begin + random.uniform(0, max(1.0, end - begin - short))
    more = {"inside": {}, "region": {"other_region": True}, "load": {"load": cell.new_load}}
    groups = {name: execution(cell, tested + 1, within(), last, random, **options)
              for name, options in more.items()}
    late = end + random.uniform(0.5, 1.5) * (end - begin)
    groups["later"] = execution(cell, tested + 1, late, last, random, warmer=random.uniform(3, 8))
    return measured, groups


def tips(cell, compliance, rows, hooks):
    """The measured point of each row, without noise [m]."""
    arm = cell.arm
    s = SimpleNamespace(**rows)
    s.axes, s.points, after = arm.frames(s.q)
    R, p = after[-1]
    s.g_F = turned(np.swapaxes(R, 1, 2), arm.gravity)
    s.nominal = p + R[..., 2] * cell.length
    cog = hooks["cog"](s) if "cog" in hooks else np.tile(cell.cog, (len(s.q), 1))
    s.moment = arm.moment(after, s.load, cog)

    def more(torques):
        s.torques = torques
        shift = hooks["joints"](s) if "joints" in hooks else 0.0
        return shift + (compliance * hooks["torques"](s) if "torques" in hooks else 0.0)
    q = arm.sagged(s.q, s.load, cog, compliance, more)
    R, p = arm.frames(q)[2][-1]
    tool = arm.tool_tip(R, s.load, cog) + (hooks["flange"](s) if "flange" in hooks else 0.0)
    tip = p + turned(R, tool)
    if "beyond" in hooks:
        point, rotation = hooks["beyond"](s)
        tip = tip + np.cross(rotation, tip - point)
    if "base" in hooks:
        rotation, shift = hooks["base"](s)
        tip = tip + np.cross(rotation, tip) + shift
    s.tip = tip
    return hooks["reading"](s) if "reading" in hooks else tip


def rms(errors):
    """Root mean square length of vectors."""
    return float(np.sqrt(np.mean(np.sum(np.square(errors), axis=-1)))) if len(errors) else 0.0


def draw_set(name, seed):
    """A cell with a hidden cause: the text of its cell.toml, its rows with their points [m], the truth."""
    of_kind = KINDS[name]
    cell, random = draw_cell(seed, of_kind)
    declared = np.array([j["compliance"] for j in cell.arm.joints])
    compliance, companion = declared.copy(), None
    if random.random() < 0.25:
        companion = "joint_compliance"
        compliance[1 + of_kind.rail:3 + of_kind.rail] *= random.uniform(1.3, 1.8)
    measured, groups = draw_rows(cell, of_kind, random)
    wanted = 1e-3 * np.exp(random.uniform(np.log(0.12), np.log(1.2)))
    hidden = seed * 7919 + 1
    hooks = lambda size: of_kind.hooks(size, np.random.default_rng(hidden), cell)
    without = tips(cell, compliance, measured, {})
    size = 1e-4
    for _ in range(4):
        moved = rms(tips(cell, compliance, measured, hooks(size)) - without)
        size = min(size * wanted / max(moved, 1e-12), of_kind.most)
    files = {"measured": measured, **groups}
    points = {n: tips(cell, compliance, rows, hooks(size)) for n, rows in files.items()}
    moved = {n: 1e3 * rms(points[n] - tips(cell, compliance, rows, {})) for n, rows in files.items()}
    every = set(range(len(cell.arm.joints)))
    loads_recorded = "payload_kg" not in of_kind.missing
    text = cell_text(cell.arm, f"{cell.name} {name}", cell.cog,
                     {"compliance": every - ({0} if of_kind.rail else set()), "mass": every,
                      "cog": loads_recorded},
                     [f"sigma_mm = {1e3 * cell.sigma_m:.4f}", "reference_temperature_C = 21.0"])
    truth = {"kind": name, "seed": seed, "reason": of_kind.reason, "accepts": list(of_kind.accepts),
             "companion": companion, "arm": cell.name, "rows": len(measured["t"]),
             "sigma_mm": 1e3 * cell.sigma_m, "size": float(size), "displacement_mm": moved}
    noisy = {n: p + random.normal(0, cell.sigma_m, p.shape) for n, p in points.items()}
    return text, files, points, noisy, truth


def table_text(rows, points, name, linear):
    """CSV text of rows; with points [m] or, if None, without."""
    of_kind = KINDS[name]
    columns = {"session": (rows["session"], "d")} if of_kind.sessions > 1 else {}
    columns["t_s"] = (rows["t"], ".2f")
    for j, values in enumerate(rows["q"].T, 1):
        if j - 1 in linear:
            columns[f"q{j}_mm"] = (1e3 * values, ".5f")
        else:
            columns[f"q{j}_deg"] = (np.degrees(values), ".5f")
    columns["payload_kg"], columns["temp_C"] = (rows["load"], ".4f"), (rows["temp"], ".2f")
    for column in of_kind.missing:
        del columns[column]
    if points is not None:
        columns |= {n: (1e3 * points[:, k], ".5f") for k, n in enumerate(("x_mm", "y_mm", "z_mm"))}
    lines = [",".join(columns)]
    for k in range(len(rows["t"])):
        lines.append(",".join(format(values[k], form) for values, form in columns.values()))
    return "\n".join(lines) + "\n"
