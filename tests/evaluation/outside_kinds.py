"""Causes that are not in the catalogue of effects, and cells that hide one of them (outside.py).

A kind is a function of the size of its cause, a random generator and the cell. It returns what the
cause changes, each a function of the rows `s`:
    joints   [rad or m] added to the joints, shape (rows, joints); `s.torques` are those of the moment
    torques  [N m] added to the joints' gravity torques, shape (rows, joints)
    cog      [m] place of the load's centre of gravity in the flange frame, shape (rows, 3)
    flange   [m] shift of the tip in the flange frame, shape (rows, 3)
    beyond   point and rotation vector [m, rad] of everything outboard of a link, each (rows, 3)
    base     rotation vector about the base origin and shift [rad, m] of the arm, each (rows, 3)
    reading  [m] what the instrument reads for the tips s.tip, shape (rows, 3)
The laws are first order in the size, which is scaled until the tip moves by the wanted distance.
"""

from types import SimpleNamespace

import numpy as np

import coverage
from loaded_arm import Arm, G, cell_text, dot, scaled, turned

KINDS = {}
GROUPS = ("inside", "region", "load", "later")


def kind(reason, accepts=(), sessions=1, levels=4, missing=(), rail=False, most=np.inf):
    """Registers a kind. `accepts`: effects of the catalogue that an `explained` answer may name.
    `levels`: number of different loads; `missing`: columns that are not recorded; `most`: largest
    plausible size."""
    def register(function):
        KINDS[function.__name__] = SimpleNamespace(
            hooks=function, reason=reason, accepts=accepts, sessions=sessions, levels=levels,
            missing=missing, rail=rail, most=most)
        return function
    return register


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def direction(random):
    return unit(random.normal(size=3))


def horizontal(random, cell):
    v = random.normal(size=3)
    return unit(v - cell.up * (v @ cell.up))


def on_joint(s, i, values):
    shift = np.zeros(s.q.shape)
    shift[:, i] = values
    return shift


def still(s):
    return np.zeros((len(s.q), 3))


@kind("the fingers of a gripper spread under the clamping force, which grows with the part's mass")
def gripper_spreads(size, random, cell):
    d = direction(random)
    return {"flange": lambda s: size * np.outer(s.load / (s.load + 0.5 * cell.rated), d)}


@kind("the same gripper, and nobody recorded which part it held", missing=("payload_kg",))
def gripper_spreads_unrecorded(size, random, cell):
    return gripper_spreads(size, random, cell)


@kind("beyond some twist of the wrist its cable pack is taut and turns the joint before it")
def cable_pack(size, random, cell):
    free = random.uniform(0.2, 0.5) * np.abs([cell.low[-1], cell.high[-1]]).max()
    taut = lambda s: np.maximum(0, np.abs(s.q[:, -1]) - free)
    return {"joints": lambda s: on_joint(s, -2, size * np.sign(s.q[:, -1]) * taut(s)**2)}


@kind("a worn tool changer falls to the lower side of its seat, by its clearance at any load")
def seat_play(size, random, cell):
    def flange(s):
        across = s.g_F * [1, 1, 0]
        return size * across / np.sqrt(dot(across, across) + (0.05 * G)**2)[:, None]
    return {"flange": flange}


@kind("one of the parts is gripped at another spot than the others", most=0.25)
def part_gripped_elsewhere(size, random, cell):
    level, d = cell.loads[random.integers(1, len(cell.loads))], direction(random)
    return {"cog": lambda s: cell.cog + size * np.outer(s.load == level, d)}


@kind("a flat, half-filled tank: the liquid runs to its lowest side", levels=3, most=0.2)
def sloshing_liquid(size, random, cell):
    return {"cog": lambda s: cell.cog + size * s.g_F / G * [1, 1, 0]}


@kind("fresh grout creeps under the robot, with the logarithm of time")
def settling_floor(size, random, cell):
    axis, tau = horizontal(random, cell), random.uniform(200, 1500)
    return {"base": lambda s: (size * np.outer(np.log1p(s.t / tau), axis), still(s))}


@kind("the rail is not straight: the carriage moves sideways and turns along it", rail=True)
def rail_straightness(size, random, cell):
    waves = [(random.uniform(0.8, 2.5), random.uniform(0, 2 * np.pi), direction(random) * [1, 1, 0])
             for _ in range(2)]
    along = lambda s: sum(np.outer(np.sin(2 * np.pi * s.q[:, 0] / w + ph), d) for w, ph, d in waves)
    return {"base": lambda s: (0.3 * size * np.outer(along(s)[:, 0], [0, 1.0, 0]), size * along(s))}


@kind("the beam bends in layers of warm air, which the hall's ventilation builds up and removes")
def refraction(size, random, cell):
    period, phase = random.uniform(2500, 6000), random.uniform(0, 2 * np.pi)
    def reading(s):
        away = s.tip - cell.instrument
        bend = dot(away, away) / 16 * np.sin(2 * np.pi * s.t / period + phase)
        return s.tip + size * np.outer(bend, cell.up)
    return {"reading": reading}


@kind("a gear mesh opens under load, so that its lost motion grows with the payload")
def lost_motion_with_load(size, random, cell):
    return {"joints": lambda s: on_joint(s, 2, size * np.sign(s.move[:, 2]) * s.load / cell.rated)}


@kind("one side of a link is warmer than the other, in proportion to the air's temperature")
def link_bows_with_temperature(size, random, cell):
    return bowed_link(size, lambda s: (s.temp - 21) / 8)


@kind("the sun shines on one side of a link, now and then, and no sensor tells", missing=("temp_C",))
def link_bows_in_the_sun(size, random, cell):
    periods, phases = random.uniform(1500, 5000, 2), random.uniform(0, 2 * np.pi, 2)
    wave = lambda s: sum(np.sin(2 * np.pi * s.t / p + ph) for p, ph in zip(periods, phases))
    return bowed_link(size, lambda s: np.maximum(0, wave(s)))


def bowed_link(size, warmth):
    across = lambda s: unit(np.cross(s.axes[1], s.points[2] - s.points[1] + 1e-6))
    return {"beyond": lambda s: (0.5 * (s.points[1] + s.points[2]),
                                 scaled(size * warmth(s), across(s)))}


@kind("midway a reflector of another radius is put on: every later reading is off along the beam")
def reflector_exchanged(size, random, cell):
    moment = random.uniform(0.3, 0.7) * cell.span
    return {"reading": lambda s: s.tip + size * scaled(s.t > moment, unit(cell.instrument - s.tip))}


@kind("a spindle heats while it runs and grows along its axis, then it is switched off and cools")
def spindle_heat(size, random, cell):
    off, tau = random.uniform(0.35, 0.6) * cell.span, random.uniform(400, 1200)
    def warmth(t):
        rise = 1 - np.exp(-np.minimum(t, off) / tau)
        return rise * np.exp(-np.maximum(0, t - off) / tau)
    return {"flange": lambda s: size * np.outer(warmth(s.t), [0, 0, 1])}


@kind("after a long wait the drives are off and the brake of the shoulder yields under its torque")
def brake_yields(size, random, cell):
    return {"joints": lambda s: on_joint(s, 1, size * s.torques[:, 1] / cell.torque[1]
                                         * (s.dwell > 90))}


@kind("a rubber mount of the tool stiffens: it yields with the square root of the moment")
def rubber_mount(size, random, cell):
    def flange(s):
        moment = np.cross(cell.cog, s.load[:, None] * s.g_F) * [1, 1, 0]
        most = cell.rated * G * cell.length
        root = np.sqrt(np.linalg.norm(moment, axis=1, keepdims=True) / most + 1e-12)
        return size * np.cross(moment / most / root, [0, 0, cell.length]) / cell.length
    return {"flange": flange}


@kind("a hose from the ceiling pulls at the tool once it is taut", most=600)
def hose_pulls(size, random, cell):
    anchor = 0.7 * cell.reach * (cell.up + horizontal(random, cell))
    def torques(s):
        away = anchor - s.nominal
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        force = size * np.maximum(0, distance - 0.6 * cell.reach) * away / distance
        return np.stack([dot(axis, np.cross(s.nominal - point, force))
                         for axis, point in zip(s.axes, s.points)], 1)
    return {"torques": torques}


@kind("the gas of a balancing cylinder gains pressure as it warms")
def gas_spring_warms(size, random, cell):
    phase = random.uniform(0, 2 * np.pi)
    return {"torques": lambda s: on_joint(s, 1, size * np.sin(s.q[:, 1] + phase) * (s.temp - 21) / 8)}


@kind("the encoder of the elbow picks up the magnet of the wrist's motor beside it")
def encoder_crosstalk(size, random, cell):
    cycles, phase = random.integers(2, 6), random.uniform(0, 2 * np.pi)
    return {"joints": lambda s: on_joint(s, 2, size * np.sin(cycles * s.q[:, 3] + phase))}


@kind("an eccentric pin in the parallelogram that drives the elbow from beside the shoulder")
def eccentric_parallelogram(size, random, cell):
    phase = random.uniform(0, 2 * np.pi)
    return {"joints": lambda s: on_joint(s, 2, size * np.sin(s.q[:, 1] - s.q[:, 2] + phase))}


@kind("the raceway of the first axis is oval: the column wobbles twice a turn")
def raceway_wobble(size, random, cell):
    a, b, phase = horizontal(random, cell), horizontal(random, cell), random.uniform(0, 2 * np.pi)
    def beyond(s):
        angle = 2 * s.q[:, 0] + phase
        return s.points[0], size * (np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b))
    return {"beyond": beyond}


@kind("the toothed belt of a wrist joint skips teeth now and then, and keeps its new place")
def belt_skips(size, random, cell):
    moments = np.sort(random.uniform(0.15, 0.95, 3)) * cell.span
    steps = random.choice([-1, 1, 2], 3)
    return {"joints": lambda s: on_joint(s, -2, size * ((s.t[:, None] > moments) @ steps))}


@kind("the instrument's tripod turns slowly until the operator aligns it again, several times")
def tripod_turns(size, random, cell):
    period = cell.span / random.uniform(1.6, 3.2)
    return {"reading": lambda s: s.tip + np.cross(
        size * np.outer(s.t % period / period, cell.up), s.tip - cell.instrument)}


@kind("an electrode's cap wears and is exchanged at intervals")
def cap_wears(size, random, cell):
    period = cell.span / random.uniform(2.2, 4.5)
    return {"flange": lambda s: -size * np.outer(s.t % period / period, [0, 0, 1])}


@kind("a fork-lift parks beside the cell three times and bends the floor",
      accepts=("tilt_event", "step_event"))
def forklift_visits(size, random, cell):
    start = (np.arange(3) + random.uniform(0.1, 0.4, 3)) * cell.span / 3
    end = start + random.uniform(0.08, 0.2, 3) * cell.span
    axis = horizontal(random, cell)
    there = lambda s: ((s.t[:, None] > start) & (s.t[:, None] < end)).any(1)
    return {"base": lambda s: (size * np.outer(there(s), axis), -size * np.outer(there(s), cell.up))}


@kind("the controller switches to another compensation table above half the rated load", levels=2)
def load_class_table(size, random, cell):
    return {"joints": lambda s: on_joint(s, 1, size * np.cos(s.q[:, 1] - 0.4)
                                         * (s.load > 0.5 * cell.rated))}


@kind("in the second session the tracker corrects for the wrong air pressure", sessions=2)
def scale_of_one_session(size, random, cell):
    return {"reading": lambda s: s.tip + size * scaled(s.session == 2, s.tip - cell.instrument)}


@kind("between the sessions a softer gear was built into the shoulder", sessions=2, levels=3)
def gear_exchanged(size, random, cell):
    return {"joints": lambda s: on_joint(s, 1, size * s.torques[:, 1] / cell.torque[1]
                                         * (s.session == 2))}


@kind("the base plate slides in the clearance of its bolts, pushed by the last turn of the first axis",
      levels=2)
def plate_slides(size, random, cell):
    def base(s):
        sideways = np.cross(cell.up, s.nominal)
        sideways /= np.linalg.norm(sideways, axis=1, keepdims=True) + 1e-9
        return still(s), scaled(size * np.sign(s.move[:, 0]), sideways)
    return {"base": base}


@kind("the base plate lifts off the floor on one side beyond the preload of its bolts")
def plate_lifts(size, random, cell):
    axis, preload = horizontal(random, cell), random.uniform(0.1, 0.5)
    return {"base": lambda s: (size * np.outer(np.maximum(
        0, s.moment @ axis / cell.moment - preload), axis), still(s))}


@kind("the tool is docked anew at intervals, each time seated a little differently",
      accepts=("step_event",))
def docking_scatter(size, random, cell):
    starts = np.sort(random.uniform(0.05, 1.0, 7)) * cell.span
    seats = random.normal(size=(8, 3))
    return {"flange": lambda s: size * seats[np.searchsorted(starts, s.t)]}


@kind("fast work between the measurements heats the motors, which bends the forearm; nothing records it",
      missing=("temp_C",), levels=3)
def motor_heat(size, random, cell):
    period = cell.span / random.uniform(1.5, 3)
    busy = lambda s: np.abs(((s.t / period) % 1) - 0.5) * 2
    return {"beyond": lambda s: (s.points[2], scaled(size * busy(s), unit(
        np.cross(s.axes[2], s.points[3] - s.points[2] + 1e-6))))}


# ---- cells and rows


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
    kept = []
    while sum(map(len, kept)) < count:
        share = random.random((4 * count, len(cell.low)))
        for j, (part, other) in cell.parts.items():
            low, high = other if other_region else part
            share[:, j] = low + share[:, j] * (high - low)
        q = np.radians(np.round(np.degrees(cell.low + share * (cell.high - cell.low)), 5))
        above = cell.arm.frames(q)[2][-1][1] @ cell.up > -0.2
        kept.append(q[above | (np.abs(cell.arm.gravity[2]) < 1)])
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
