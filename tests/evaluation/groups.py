"""Which runs the evaluation makes: the groups as a table, and the seeds and signals of their runs."""

import os
import zlib
from dataclasses import dataclass

import numpy as np

import damage

HERE = os.path.dirname(os.path.abspath(__file__))
OUTSIDE = ["creep", "link_warmup", "slow_sine", "payload_squared", "temperature_squared", "two_bumps",
           "velocity_squared", "air_pressure"]
# Outside the catalogue too, each in a group of its own.
PLURAL = ["two_drivers", "temperature_payload", "temperature_payload_joint"]
# An instrument fine enough that the asked signal needs no unbelievable size of the effect.
SIGMA_MM = {"tool_shear": 0.003, "gravity_direction": 0.01, "thermal_growth": 0.02,
            "payload_cog": 0.02, "arrival_friction": 0.01, "guide_play": 0.02}
CONFOUNDED = ["tool_stiffness", "tool_root_compliance", "payload_mass", "payload_cog",
              "joint_offset", "joint_compliance", "base_frame", "tool_frame", "thermal_growth",
              "backlash_load"]
ONE_PAYLOAD = ["tool_stiffness", "payload_mass", "payload_cog", "tool_root_compliance"]
CAMERA = ["camera_tag_size", "camera_zoom", "camera_lens"]
UNALIGNED = ["none", "joint_compliance", "joint_offset", "backlash_move", "gear_periodic",
             "link_geometry", "thermal_growth", "tool_stiffness"]
NOISE = ["none", "pair", "joint_compliance", "backlash_move", "thermal_growth", "gear_periodic",
         "link_geometry", "step_event"]
OF_MOVES = ["backlash_move", "approach_lag", "joint_compliance", "gear_periodic", "thermal_growth"]
COMBINED = ["joint_compliance@q2,q3+thermal_growth+backlash_move@q4"]
UNWEIGHED = ["gravity_sag", "joint_compliance", "none"]
SLIDES = ["slide_compliance", "axis_bending", "guide_play", "bearing_tilt",
          "link_bending", "none"]
RANGES = ["range_zero", "range_anchor"]
TILTS = ["base_tilt", "tilt_event", "none"]
ROBOTS = ["kr210", "kr210", "ur10", "arm6"]


@dataclass(frozen=True)
class Group:
    name: str
    families: list
    times: float = 1.0       # runs of each family, as a multiple of the seeds asked for
    options: tuple = ()      # of the simulator
    signal: tuple = (5, 30)  # even in its logarithm between these
    sigma_mm: float = 0.0    # 0: by family
    damage: str = ""         # what happens to the files (damage.py)
    diagnose: tuple = ()     # further options of `plumbline diagnose`
    robots: tuple = tuple(ROBOTS)
    separable: bool = False  # drawn again until the rows can tell each effect from every other

    def runs(self, seeds):
        return max(1, int(self.times * seeds)) if self.times else int(seeds > 1)


def rows(count):
    """A sixth of them second visits, as among the 96 of the default."""
    return "--rows", str(count - count // 6), "--repeats", str(count // 6)


def table(families):
    several = ["none", "pair", "three", "four"]
    catalogue = [f for f in families if f not in OUTSIDE + PLURAL + CAMERA + RANGES + several]
    yield Group("catalogue", catalogue)
    yield Group("catalogue, 5 % outliers", catalogue[::3], 1 / 3, ("--outliers", "0.05"))
    yield Group("catalogue, camera", CAMERA)
    yield Group("link masses unknown", UNWEIGHED, 1, ("--masses-unknown",))
    yield Group("prismatic axes", SLIDES, 1, robots=("lift",))
    yield Group("ranges", RANGES + ["measurement_scale", "joint_compliance", "none"], 1, (*rows(300), "--range"))
    yield Group("inclinometer", TILTS, 1, ("--inclinometer",))
    yield Group("weak (signal 1 to 4)", catalogue[1::3], 1 / 3, signal=(1, 4))
    yield Group("two effects", ["pair"], 5)
    for number in ("three", "four"):
        for count in (60, 96, 150, 300):
            yield Group(f"{number} effects, {count} rows", [number], 2, rows(count), sigma_mm=0.02,
                        separable=True)
    for count in (96, 288):
        yield Group(f"compliance, growth and backlash, {count} rows", COMBINED, 2, rows(count),
                    sigma_mm=0.02, robots=("kr210",), separable=True)
    yield Group("nothing", ["none"], 5)
    yield Group("nothing, 5 % outliers", ["none"], 5, ("--outliers", "0.05"))
    yield Group("nothing, heavy tails", ["none"], 5, ("--heavy-tails",))
    yield Group("nothing, camera", ["none"], 1, ("--camera",))
    yield from noise()
    yield Group("outside the catalogue", OUTSIDE)
    yield Group("two drivers and their product", ["two_drivers"], 2)
    yield Group("time or temperature", ["temperature_squared"], 2, ("--steady-rise",))
    yield Group("temperature times payload, 3 K warmer", PLURAL[1:], 1,
                ("--tests-warmer-K", "3"))
    yield Group("vertical tool, one payload", CONFOUNDED, 1 / 2, ("--vertical",))
    yield Group("one payload, rigid joints", ONE_PAYLOAD, 1, ("--one-payload", "--rigid-joints"))
    yield Group("12,000 rows", ["joint_compliance", "none", "creep"], 0,
                ("--rows", "11000", "--repeats", "1000"))
    yield Group("unaligned, camera", CAMERA + ["measurement_scale"], 1 / 3, ("--camera", "--unaligned"))
    yield Group("unaligned, two sessions", UNALIGNED, 1 / 3, ("--unaligned", "--sessions", "2"))
    yield from probing_cell()
    yield from damaged()


def noise():
    for name, options in [
            ("AR(1), 0.7 from row to row", ("--ar1", "0.7")),
            ("of a tracker, by distance and direction", ("--tracker-noise",)),
            ("declared sigma a third of the true", ("--declared-sigma", "0.333333")),
            ("declared sigma three times the true", ("--declared-sigma", "3")),
            ("5 % outliers in runs", ("--outliers", "0.05", "--outlier-runs")),
            ("10 % outliers in runs", ("--outliers", "0.1", "--outlier-runs")),
            ("15 % outliers in runs", ("--outliers", "0.15", "--outlier-runs")),
            ("15 % outliers, scattered", ("--outliers", "0.15"))]:
        yield Group("noise: " + name, NOISE, 1, options)


def probing_cell():
    """The design of the closed loop's test: its 16 probing poses with the module and without."""
    cell = os.path.join(HERE, "../virtual_cell/demo/cockpit-cell.toml")
    options = ("--declared-cell", cell, "--design-poses", os.path.join(HERE, "probing_poses.csv"))
    for name, family in (("the closed loop's probes", "joint_compliance@q2,q3"),
                         ("the closed loop's probes, nothing", "none")):
        yield Group(name, [family], 5, options, (20, 40), 0.05, diagnose=("--order-unknown",),
                    robots=("kr210",))


def damaged():
    for share in (15, 30):
        for what in ("measured values empty", "rows unmeasured", "lines lost"):
            yield Group(f"lost: {share} % of {what}" if what != "lines lost" else
                        f"lost: {share} % of the lines", OF_MOVES, 1 / 2, damage=f"{share} % {what}")
    for mistake in ("y axis mirrored", "x and y swapped", "inches", "radians", "other Euler convention",
                    "last joint's sign", "shuffled clock", "restarted clock", "sentinels", "kelvin",
                    "pounds"):
        yield Group("mistake: " + mistake, ["none", "joint_compliance", "backlash_move"], 1 / 3,
                    damage=mistake)
    for mistake in damage.HALF_WAY:
        yield Group("mistake: " + mistake, ["none", "joint_compliance", "backlash_move"], 1 / 3,
                    damage=mistake)
    # 30 mm RMS with a sigma of 0.05 mm.
    yield Group("mistake: TCP 30 mm off", ["tool_frame"], 1, signal=(346, 346), sigma_mm=0.05,
                damage="TCP 30 mm off", robots=("kr210",))


def plan(families, seeds, first_seed):
    """(group, family, seed, options of the simulator) of every run."""
    for group in table(families):
        for family in group.families:
            for k in range(group.runs(seeds)):
                seed = first_seed + k
                draw = np.random.default_rng([seed, zlib.crc32(f"{group.name} {family}".encode())])
                signal = float(np.exp(draw.uniform(*np.log(group.signal))))
                robot = group.robots[k % len(group.robots)]
                sigma = group.sigma_mm or SIGMA_MM.get(family, 0.05)
                yield group, family, seed, [
                    "--signal", f"{signal:.3f}", "--robot", robot,
                    "--sigma-mm", str(sigma * (1.0 if robot == "kr210" else 0.5)), *group.options]
