"""The structured text of packaging/examples/plc: its numbers are those of the register map, and run
as a controller would run it, beside the real daemon, it does what it says.

    plc_examples_test.py BUILD_BIN"""

import json
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time

import structured_text
from station import LIBRARY, TEXTS, Modbus, Station

BIN = sys.argv[1]


def numbers_are_those_of_the_map():
    listed = subprocess.run([BIN + "/plumbline", "registers", "--json"], capture_output=True, check=True)
    addresses = {entry["name"]: entry["address"] for entry in json.loads(listed.stdout)}
    checked = 0
    for unit, bases in (("PL_Alive", {"": 0}), ("PL_Point", {"": 2000}),
                        ("PL_Command", {"result": 100, "": 1000})):
        for name, (_, constant, _, start) in LIBRARY[unit]["variables"].items():
            if not constant:
                continue
            register = name.lower().removesuffix("_word")
            base = next(at for begins, at in bases.items() if register.startswith(begins))
            assert addresses[register] == base + start[1], (unit, name)
            checked += 1
    assert checked == 48, checked
    # What the text tells the fieldbus to read and write.
    for block, first, count in re.findall(r"(\w+) +[<-]+[->]* FC\d+ +(\d+), (\d+) registers", TEXTS["pl_cell.st"]):
        array = LIBRARY["PL_Cell"]["variables"][block][2]
        assert array[1] == int(count), block
        assert int(first) in (0, 100, 1000, 2000), block


def real_numbers():
    random.seed(1)
    words = [0, 0x80000000, 0x7FC00000, 0xFFC00000, 0x7F800000, 0xFF800000, 0x3F800000, 0xC479C000, 0x00800000, 0x7F7FFFFF]
    words += [random.getrandbits(32) for _ in range(2000)]
    for word in words:
        wanted = struct.unpack(">f", struct.pack(">I", word))[0]
        if (word >> 23) & 0xFF == 0:
            wanted = 0.0
        if (word >> 23) & 0xFF == 255:  # no limit shall take it for small
            wanted = 2.0**127
        called = structured_text.Instance("PL_Real", LIBRARY, None)
        called.call({"High": word >> 16, "Low": word & 0xFFFF})
        assert called.values["PL_Real"] == wanted, (hex(word), called.values["PL_Real"], wanted)


def a_point_is_used_while_it_is_fresh():
    now = [0.0]
    point = structured_text.Instance("PL_Point", LIBRARY, lambda: now[0])
    block = [7, 0x31, 0] + [0] * 17  # valid, its radius measured

    def step(sequence, seconds=0.1):
        now[0] += seconds
        block[19] = sequence
        point.call({"Block": block, "Id": 7, "Alive": True, "MostUncertain": 0.5})
        return point.values["Valid"]

    assert not step(65500), "one look shows no refresh"
    for sequence in range(65510, 65610, 7):  # through the wrap
        assert step(sequence % 65536), sequence
    last = block[19]
    assert step(last) and step(last, 0.3)
    assert not step(last, 0.3), "it stands still"
    assert step(last + 1)
    block[1] = 0
    assert not step(last + 2), "withdrawn"
    block[1], block[2] = 0x31, 8
    assert not step(last + 3), "a code"
    block[2], block[0] = 0, 9
    assert not step(last + 4), "another point"
    block[0] = 7
    block[17:19] = struct.unpack(">2H", struct.pack(">f", 0.6))
    assert not step(last + 5), "less certain than asked for"


def a_point_is_refused_whose_radius_is_only_assumed():
    now = [0.0]
    point = structured_text.Instance("PL_Point", LIBRARY, lambda: now[0])
    block = [7, 0, 0] + [0] * 17

    def used(basis, allow):
        for _ in range(2):
            now[0] += 0.1
            block[1], block[19] = 1 | basis << 4, (block[19] + 1) % 65536
            point.call({"Block": block, "Id": 7, "Alive": True, "MostUncertain": 0.5, "AllowAssumed": allow})
        assert point.values["Basis"] == basis
        return point.values["Valid"]

    assert [used(basis, False) for basis in range(4)] == [False, False, True, True]
    assert [used(basis, True) for basis in range(4)] == [False, True, True, True]


class Commander:
    """A controller with one PL_Command; its fieldbus reads and writes only when told to."""

    def __init__(self, bus):
        self.bus, self.now = bus, 0.0
        self.block = structured_text.Instance("PL_Command", LIBRARY, lambda: self.now)
        self.result = [0] * 40
        self.values = self.block.values

    def step(self, read=True, write=True, **inputs):
        if read:
            self.result = self.bus.read(100, 40)
        self.block.call({"Result": self.result, "Alive": True, **inputs})
        if write:
            self.bus.write(1000, self.values["Window"])
        self.now += 0.05
        time.sleep(0.02)
        return self.values

    def give(self, point, read=True):
        """Gives a command before the next read, and steps until it is answered or failed."""
        self.step(read=False, write=False, Execute=False)
        self.step(read=False, Execute=True, Command=1, Point=point)
        while self.values["Busy"]:
            self.step(read)
        return self.values


def an_answer_belongs_to_its_command(folder):
    station = Station(BIN, folder)
    station.start()
    try:
        bus = Modbus(station.port)
        give_up = time.monotonic() + 20
        while not (bus.read(2001, 1)[0] & bus.read(2021, 1)[0] & 1):
            assert time.monotonic() < give_up, open(folder + "/log").read()
            time.sleep(0.02)
        y = {point: struct.unpack(">f", struct.pack(">2H", *bus.read(2005 + 20 * k, 2)))[0]
             for k, point in enumerate((1, 2))}
        assert abs(y[1] - y[2]) > 1, y

        def answers(values, point):
            assert values["Done"] and values["Valid"] and values["Code"] == 0, (point, values)
            assert abs(values["Y"] - y[point]) < 0.1, "the answer of another command"

        # The controller's first command; it restarts, and Execute rises before the answer was read.
        first = Commander(bus)
        answers(first.give(1), 1)
        second = Commander(bus)
        answers(second.give(2), 2)

        # A command arrives, its answer is not read in time; the next one is another.
        answers(second.give(1), 1)
        values = second.give(1, read=False)
        assert values["Failed"] and not values["Done"] and not values["Valid"]
        lost = values["Window"][39]
        assert bus.read(101, 1) == [lost], "it arrived"
        answers(second.give(2), 2)
        assert second.values["Window"][39] == lost + 1

        # Nothing is ever read: nothing is given.
        blind = Commander(bus)
        values = blind.give(1, read=False)
        assert values["Failed"] and values["Window"][39] == 0

        # The sequence wraps past 0.
        answers(second.give(1), 1)
        second.values["Sequence"] = 65534
        answers(second.give(2), 2)
        assert second.values["Window"][39] == 65535
        answers(second.give(1), 1)
        assert second.values["Window"][39] == 1

        # The same number, but the answer of another command or point.
        for register, other in ((30, 2), (31, 7)):
            answers(second.give(1), 1)
            true, second.result[register] = second.result[register], other
            assert not second.step(read=False)["Valid"], register
            second.result[register] = true
            assert second.step(read=False)["Valid"], register

        # Plumbline or the network is gone: what was read stands still.
        assert not second.step(read=False, Alive=False)["Valid"], "an answer of before"
        assert second.values["Done"]
        answers(second.step(), 1)
        second.step(Execute=False)
        assert second.step(read=False, write=False, Execute=True)["Busy"]
        values = second.step(read=False, write=False, Alive=False)
        assert values["Failed"] and not values["Busy"] and values["Window"][0] == 0
        answers(second.give(2), 2)
    finally:
        station.end(signal.SIGTERM)


def beside_the_daemon(folder):
    station = Station(BIN, folder)
    values = station.cell.values
    station.start()
    try:
        station.until(lambda v: v["MayInsert"])
        x, y, z = struct.unpack(">3f", struct.pack(">6H", *values["Block1"][3:9]))
        assert (values["TargetX"], values["TargetY"], values["TargetZ"]) == (x, y, z)
        assert abs(x - 2683) < 60 and abs(y + 424) < 60, (x, y, z)
        assert values["Alive"].values["RobotLink"] and not values["Alive"].values["Manual"]

        station.give_probe()
        assert values["Probe"].values["Valid"]
        measured = [values["Probe"].values[name] + values["Probe"].values["D" + name] for name in "XYZ"]
        assert all(abs(a - b) < 0.01 for a, b in zip(measured, (2740, 0, 1545))), measured
        station.until(lambda v: station.bus and station.bus.read(404, 2) == [0, 1])
        station.until(lambda v: v["General"][11] & 0x0400)  # the controller's heartbeat is seen

        # A power cut of the computer: the target is withdrawn, and comes back by itself. The probe that
        # still stands in the window is not one a second time.
        station.end(signal.SIGKILL)
        station.until(lambda v: not v["MayInsert"], 5)
        station.until(lambda v: not v["Alive"].values["Alive"], 5)
        assert not values["Probe"].values["Valid"], "an answer of before"
        station.start()
        station.until(lambda v: v["MayInsert"])
        for _ in range(25):
            station.cycle()
        station.until(lambda v: station.bus)  # which a slow computer may have lost
        assert station.bus.read(404, 2) == [0, 0], "recorded twice"
        assert values["ProbeTaken"], "an answer stays"

        station.give_probe()
        station.until(lambda v: station.bus and station.bus.read(404, 2) == [0, 1])
    finally:
        station.end(signal.SIGTERM)
    shown = subprocess.run([BIN + "/plumbline", "journal", "show", "--state", folder + "/state"],
                           capture_output=True, text=True)
    assert shown.stdout.count("plc") == 2, shown.stdout + shown.stderr


numbers_are_those_of_the_map()
real_numbers()
a_point_is_used_while_it_is_fresh()
a_point_is_refused_whose_radius_is_only_assumed()
with tempfile.TemporaryDirectory() as scratch:
    an_answer_belongs_to_its_command(scratch)
with tempfile.TemporaryDirectory() as scratch:
    beside_the_daemon(scratch)
print("structured text: 48 addresses, 2010 numbers, a point's freshness, commands with lost answers, "
      "and a controller beside the daemon")
