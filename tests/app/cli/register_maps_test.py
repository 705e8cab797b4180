"""The doctor's words about controllers that people have had trouble with, and what a scan makes of them.

    register_maps_test.py BUILD_BIN

The devices are those of files-register-maps in the folder of measured data (PLUMBLINE_MEASURED,
default ../shared/measured); skipped where that is missing."""

import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

BIN = sys.argv[1]
MAPS = pathlib.Path(os.environ.get("PLUMBLINE_MEASURED", "../shared/measured")) / "files-register-maps"
if not (MAPS / "modbus_device.py").exists():
    print("SKIPPED: %s is not there (set PLUMBLINE_MEASURED)" % MAPS)
    sys.exit(77)

PROFILE = """schema = 1
name = "p"
source = "test"
port = 502
unit_id = 1
[[read]]
table = "holding"
first = 0
count = %d
[[joints]]
table = "holding"
address = [0, 2, 4, 6, 8, 10]
type = "float32"
unit = "deg"
"""
CONFIG = """cell = "%s/config/cells/ur10.toml"
state_directory = "state"
[robot]
profile = "p.toml"
host = "127.0.0.1"
port = %d
timeout_ms = 1000
[payload]
source = "fixed"
mass_kg = 1.0
"""
JOINTS = "12.5,-95.25,88,-61.75,-90.5,170.125"

# device: registers that the profile reads, what the doctor must say, what the scan must find with --joints
CASES = {
    "cdab": (12, ["too small", "e-41", "word order CDAB gives plausible joints", "12.5, -95.25, 88, -61.75"], "float32 CDAB in deg at holding 0, 2,"),
    "one_late": (12, ["not trusted", "address + 1 gives plausible joints", "12.5, -95.25, 88"], "float32 ABCD in deg at holding 1, 3,"),
    "nan": (12, ["joint 3 is not a number", "the controller itself may hold no number there"], None),
    "gap": (42, ["exception 0x02 at 0 x 42", "first missing register is 12", "shorten [[read]]"], "float32 ABCD in deg at holding 0, 2,"),
    "eight": (12, ["request of 12 registers is refused", "8 are answered", "split [[read]]"], "float32 ABCD in deg at holding 0, 2,"),
    "input_only": (12, ["function 3 is unknown", 'table = "input"'], "float32 ABCD in deg at input 0, 2,"),
    "unit_255": (12, ["exception 0x0B", "from unit 1: unit 255 answers", "unit_id = 255"], "float32 ABCD in deg at holding 0, 2,"),
    "zero": (12, ["all joints exactly zero", "never referenced", "q1 0 deg"], None),
}
RAW_WORDS = ["Illegal", "Target device failed", "Slave device"]  # of libmodbus


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def start(name):
    port = free_port()
    device = subprocess.Popen([sys.executable, "-B", str(MAPS / "modbus_device.py"), str(MAPS / (name + ".json")), str(port)])
    for _ in range(200):
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return device, port
        except OSError:
            time.sleep(0.05)
    raise SystemExit("the device %s does not start" % name)


faults = []
for name, (count, words, decoding) in CASES.items():
    device, port = start(name)
    try:
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "p.toml").write_text(PROFILE % count)
            (folder / "plumbline.toml").write_text(CONFIG % (os.getcwd(), port))
            told = subprocess.run([BIN + "/plumbline", "doctor", str(folder / "plumbline.toml"), "--json"],
                                  capture_output=True, text=True, timeout=60)
            robot = [one for one in json.loads(told.stdout) if one["what"] == "robot"][0]
            text = robot["detail"] + " | " + robot["do"]
            if robot["health"] != "FAULT":
                faults.append("%s: the doctor says %s: %s" % (name, robot["health"], text))
            faults += ["%s: the doctor does not say %r: %s" % (name, word, text) for word in words if word not in text]
            faults += ["%s: %r of the library: %s" % (name, word, text) for word in RAW_WORDS if word in text]
            profile = folder / "found.toml"
            scan = subprocess.run([BIN + "/plumbline", "registers", "scan", "127.0.0.1:%d" % port, "--cell", "config/cells/ur10.toml",
                                   "--joints=" + JOINTS, "--output", str(profile), "--json"], capture_output=True, text=True, timeout=120)
            found = json.loads(scan.stdout)
            if decoding is None and (scan.returncode != 1 or profile.exists()):
                faults.append("%s: a scan writes a profile: %s" % (name, scan.stdout))
            if decoding is not None and (scan.returncode != 0 or not profile.exists() or not found["candidates"][0]["text"].startswith(decoding)):
                faults.append("%s: a scan does not find %r: %s %s" % (name, decoding, scan.stdout, scan.stderr))
            if decoding is not None and profile.exists():
                (folder / "p.toml").write_text(profile.read_text())
                again = subprocess.run([BIN + "/plumbline", "doctor", str(folder / "plumbline.toml"), "--json"],
                                       capture_output=True, text=True, timeout=60)
                robot = [one for one in json.loads(again.stdout) if one["what"] == "robot"][0]
                if robot["health"] != "good":
                    faults.append("%s: the doctor does not trust the profile found: %s" % (name, robot))
    finally:
        device.kill()
        device.wait()
print("\n".join(faults) if faults else "%d devices" % len(CASES))
sys.exit(1 if faults else 0)
