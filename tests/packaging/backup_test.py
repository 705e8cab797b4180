"""The backup and the restore of docs/run.md, by its own commands, with the daemon before and after.

    backup_test.py BUILD_BIN"""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

from station import Station

BIN = sys.argv[1]


def told(*words):
    return subprocess.run([BIN + "/plumbline", *words], capture_output=True, text=True, check=True).stdout


def by_manual(what, root, archive):
    """The manual's tar command, below `root` in place of /."""
    line = re.search(r"^ {4}(tar -C / -%s\S* .*)$" % what, open("docs/run.md").read(), re.M).group(1)
    assert "cell-7.tar.gz" in line and " / " in line, line
    words = line.replace(" / ", " %s " % root).replace("cell-7.tar.gz", archive)
    subprocess.run(words, shell=True, check=True)


def computer(root):
    os.makedirs(root + "/etc/plumbline")
    return Station(BIN, root + "/etc/plumbline", "../../var/lib/plumbline")


def told_of(state):
    return told("model", "list", "--state", state), told("journal", "show", "--json", "--state", state)


with tempfile.TemporaryDirectory() as scratch:
    before, after, archive = scratch + "/before", scratch + "/after", scratch + "/cell.tar.gz"
    station = computer(before)
    state = before + "/var/lib/plumbline"
    station.start()
    try:
        station.until(lambda v: v["MayInsert"])
        station.give_probe()
        corrected = scratch + "/corrected.toml"
        text = open(station.folder + "/cell.toml").read()
        found = re.search(r"compliance_rad_per_Nm = ([0-9.e-]+)", text)
        open(corrected, "w").write(text[:found.start(1)] + "%g" % (1.1 * float(found.group(1))) + text[found.end(1):])
        told("model", "propose", corrected, "--state", state)
        told("model", "apply", "2", "--state", state)
        station.until(lambda v: station.bus and station.bus.read(401, 1) == [2])
        station.until(lambda v: v["MayInsert"])
        target = [station.cell.values["Target" + name] for name in "XYZ"]
    finally:
        station.end(signal.SIGTERM)
    os.makedirs(state + "/fleet")
    open(state + "/fleet/queue.sqlite", "w").write("what waits for the broker")
    kept = told_of(state)
    assert "APPLIED" in kept[0] and kept[1].count("\n") == 1, kept

    by_manual("c", before, archive)
    shutil.rmtree(before)  # the disk is gone
    station = computer(after)
    by_manual("x", after, archive)
    state = after + "/var/lib/plumbline"
    assert told_of(state) == kept, (told_of(state), kept)
    assert not os.path.exists(state + "/fleet")
    station.start()
    try:
        station.until(lambda v: v["MayInsert"])
        assert station.bus.read(401, 1) == [2], "another model is in force"
        again = [station.cell.values["Target" + name] for name in "XYZ"]
        assert all(abs(a - b) < 1e-3 for a, b in zip(again, target)), (again, target)
        station.give_probe()
    finally:
        station.end(signal.SIGTERM)
    assert told("journal", "show", "--json", "--state", state).count("\n") == 2
print("backup and restore: the model in force, its target and the probes are back, and it goes on")
