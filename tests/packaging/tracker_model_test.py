"""From a tracker's CSV to an applied model: import, diagnose, model apply; then the daemon moves the point by
what the arm does, wherever the tracker stood.

The arm is that of tests/simulator, which shares no code with the product: two of its joints are softer than
declared. The tracker is set up 3 m from the base, turned by 115 degrees.

    tracker_model_test.py BUILD_BIN"""

import csv
import json
import math
import os
import re
import struct
import subprocess
import sys
import tempfile
import time

from station import Modbus

BIN = os.path.abspath(sys.argv[1])
RUN_LIMIT_S = 120  # then subprocess.run() kills the program
LIMIT_MM = 0.25  # of the point's shift against the truth
FAMILY = "joint_compliance@q2,q3"
FRAMES = ("base", "measurement")  # the same in the declared cell


def run(*words, code=0):
    done = subprocess.run([BIN + "/" + words[0], *words[1:]], capture_output=True, text=True, timeout=RUN_LIMIT_S)
    assert done.returncode == code, "%s: exit %d\n%s%s" % (words, done.returncode, done.stdout, done.stderr)
    return done.stdout + done.stderr


def rows_of(file):
    return list(csv.DictReader(open(file)))


def seen_by_tracker(row):
    """Level, since the tracker's z is vertical."""
    x, y, z = (float(row[axis]) for axis in ("x_mm", "y_mm", "z_mm"))
    turn = math.radians(115)
    return (math.cos(turn) * x - math.sin(turn) * y + 2500, math.sin(turn) * x + math.cos(turn) * y - 1700, z - 640)


def export(measured, folder):
    joints = ["q%d_deg" % k for k in range(1, 7)]
    with open(folder + "/tracker.csv", "w") as out:
        out.write("Point;X [mm];Y [mm];Z [mm]\n")
        for k, row in enumerate(measured):
            out.write("P%d;%.4f;%.4f;%.4f\n" % (k + 1, *seen_by_tracker(row)))
    with open(folder + "/joints.csv", "w") as out:
        out.write("Point;" + ";".join(joints) + ";payload_kg;temp_C;t_s\n")
        for k, row in enumerate(measured):
            out.write(";".join(["P%d" % (k + 1)] + [row[name] for name in joints + ["payload_kg", "temp_C", "t_s"]]) + "\n")


def tip(folder, effects):
    """Of the first pose, by the simulator's arm with these effects."""
    name = folder + "/effects.json"
    json.dump({"effects": effects, "nuisances": []}, open(name, "w"))
    run("plumbline-simulate", "--predict", "--cell", folder + "/aligned.toml", "--poses", folder + "/pose.csv",
        "--with", name, "--out", folder + "/tip.csv")
    return [float(rows_of(folder + "/tip.csv")[0][axis]) for axis in ("x_mm", "y_mm", "z_mm")]


def configuration(folder, pose, target):
    open(folder + "/standing.csv", "w").write(
        ",".join("q%d_deg" % k for k in range(1, 7)) + "\n" + ",".join(pose["q%d_deg" % k] for k in range(1, 7)) + "\n")
    open(folder + "/plumbline.toml", "w").write("""cell = "cell.toml"
state_directory = "state"
[robot]
profile = "%s/config/profiles/generic.toml"
transport = "replay"
replay_file = "standing.csv"
replay_rows_per_s = 100.0
[payload]
source = "fixed"
mass_kg = %s
[plc]
listen = "127.0.0.1"
port = 0
""" % (os.getcwd(), pose["payload_kg"]) + "".join("""[[point]]
id = %d
frame = "%s"
xyz_mm = [%s]
rpy_deg = [0.0, 0.0, 0.0]
orientation = "free"
near_deg = [%s]
""" % (k + 1, frame, ", ".join("%.4f" % c for c in target), ", ".join(pose["q%d_deg" % k] for k in range(1, 7)))
        for k, frame in enumerate(FRAMES)))


class Daemon:
    def __init__(self, folder):
        self.log, self.ports = folder + "/log", folder + "/ports"
        if os.path.exists(self.ports):
            os.remove(self.ports)
        self.process = subprocess.Popen([BIN + "/plumblined", "--config", folder + "/plumbline.toml", "--port-file", self.ports],
                                        stderr=open(self.log, "w"))

    def read(self):
        """The corrected points, as a PLC reads them; None for one without a correction."""
        give_up = time.monotonic() + 60
        while time.monotonic() < give_up:
            assert self.process.poll() is None, open(self.log).read()
            if os.path.exists(self.ports):
                plc = Modbus(int(open(self.ports).read().split()[1]))
                blocks = [plc.read(2000 + 20 * k, 20) for k in range(len(FRAMES))]
                pending = any(block[2] in (8, 11) for block in blocks)  # no robot yet, not computed yet
                if not pending and any(block[1] & 1 for block in blocks):
                    return [[self.real(block[k : k + 2]) for k in (3, 5, 7)] if block[1] & 1 else None
                            for block in blocks]
            time.sleep(0.05)
        raise AssertionError(open(self.log).read())

    @staticmethod
    def real(words):
        return struct.unpack(">f", struct.pack(">HH", *words))[0]

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(60)
        finally:
            self.process.kill()
            self.process.wait()


def points_of(folder):
    daemon = Daemon(folder)
    try:
        return daemon.read()
    finally:
        daemon.end()


def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


with tempfile.TemporaryDirectory() as folder:
    run("plumbline-simulate", "--family", FAMILY, "--seed", "7", "--rows", "60", "--signal", "20", "--out", folder + "/made")
    measured = rows_of(folder + "/made/measured.csv")
    cell = open(folder + "/made/cell.toml").read()
    open(folder + "/aligned.toml", "w").write(cell)
    assert "[measurement]" in cell
    open(folder + "/cell.toml", "w").write(cell.replace("[measurement]", '[measurement]\nframe = "unaligned"'))
    export(measured, folder)

    # The pose of the point: one that was measured with the largest load, so that much bends.
    pose = max(measured, key=lambda row: (float(row["payload_kg"]), float(row["x_mm"]) ** 2 + float(row["y_mm"]) ** 2))
    names = [name for name in pose if name not in ("x_mm", "y_mm", "z_mm")]
    open(folder + "/pose.csv", "w").write(",".join(names) + "\n" + ",".join(pose[name] for name in names) + "\n")
    hidden = json.load(open(folder + "/made/truth.json"))["effects"]
    declared, real = tip(folder, []), tip(folder, hidden)
    truth = [a - b for a, b in zip(real, declared)]  # what the arm does and the cell file does not know
    assert distance(truth, (0, 0, 0)) > 1, truth

    configuration(folder, pose, declared)
    before = points_of(folder)
    run("plumbline", "import", folder + "/tracker.csv", "--joints", folder + "/joints.csv", "--output", folder + "/measured.csv")
    run("plumbline", "diagnose", folder + "/cell.toml", folder + "/measured.csv", "--write-model", folder + "/corrected.toml")
    assert 'id = "joint_compliance"' in open(folder + "/corrected.toml").read()
    run("plumbline", "model", "propose", folder + "/corrected.toml", "--state", folder + "/state")
    version = re.findall(r"^ *(\d+) ", run("plumbline", "model", "list", "--state", folder + "/state"), re.M)[-1]
    run("plumbline", "model", "apply", version, "--state", folder + "/state")
    after = points_of(folder)

    # Each command moves against what the arm does, wherever the tracker stood.
    for frame, old, new in zip(FRAMES, before, after):
        assert old and new, "the point in the frame %s: before %s, after %s" % (frame, old, new)
        moved = [a - b for a, b in zip(new, old)]
        missed = distance(moved, [-value for value in truth])
        print("frame %s: the arm does %.2f mm; the point moved by %.2f mm; they differ by %.3f mm" %
              (frame, distance(truth, (0, 0, 0)), distance(moved, (0, 0, 0)), missed))
        assert missed < LIMIT_MM, (frame, moved, truth)
