"""Causes that are not in the catalogue of effects, for the cells of outside_cells.py.

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

from loaded_arm import G, dot, scaled

KINDS = {}


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


@kind("the sun shines on one side of a link, now and then, and no sensor records it", missing=("temp_C",))
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


@kind("the toothed belt of a wrist joint skips teeth now and then, and keeps its new place",
      accepts=("offset_event",))
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
