"""A controller with its fieldbus, its program the structured text of packaging/examples/plc, beside the
real daemon. The robot is a replayed one that stands still."""

import os
import socket
import struct
import subprocess
import time

import structured_text

HERE = os.getcwd()  # the repository's root
EXAMPLES = "packaging/examples/plc"
TEXTS = {name: open(os.path.join(EXAMPLES, name)).read() for name in sorted(os.listdir(EXAMPLES))}
LIBRARY = structured_text.load(TEXTS.values())


class Modbus:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), 2)

    def ask(self, pdu):
        self.socket.sendall(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
        head = self.exactly(7)
        answer = self.exactly(struct.unpack(">H", head[4:6])[0] - 1)
        assert answer[0] == pdu[0], "exception %d" % answer[1]
        return answer

    def exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            if not more:
                raise OSError("closed")
            data += more
        return data

    def read(self, first, count):
        answer = self.ask(struct.pack(">BHH", 3, first, count))
        return list(struct.unpack(">%dH" % count, answer[2:]))

    def write(self, first, words):
        self.ask(struct.pack(">BHHB%dH" % len(words), 16, first, len(words), 2 * len(words), *words))


class Station:
    """The controller with its fieldbus, and the daemon beside it."""

    def __init__(self, programs, folder, state="state"):
        self.programs, self.folder, self.state = programs, folder, state
        self.daemon, self.bus, self.port = None, None, 0
        self.cell = structured_text.Instance("PL_Cell", LIBRARY, time.monotonic)
        with open(folder + "/stands.csv", "w") as table:
            table.write("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,-100,110,0,-10,0\n")

    def start(self):
        # As after a fit that was validated: PL_Point refuses a radius that is only assumed.
        with open(self.folder + "/cell.toml", "w") as cell:
            cell.write(open("tests/virtual_cell/demo/cockpit-cell.toml").read())
            cell.write("\n[domain]\nq_deg = [%s]\npayload_kg = [0.0, 100.0]\nresidual_sigma_mm = 0.05\n"
                       % ", ".join(["[-360.0, 360.0]"] * 6))
        text = open("tests/virtual_cell/demo/plumbline.toml").read()
        for old, new in (
                ('"cockpit-cell.toml"', '"cell.toml"'),
                ('"/tmp/plumbline-demo"', '"%s"' % self.state),
                ("../../..", HERE),
                ('transport = "tcp"', 'transport = "replay"\nreplay_file = "stands.csv"\nreplay_rows_per_s = 100.0'),
                ('source = "robot"', 'source = "fixed"\nmass_kg = 60.0'),
                ("port = 15020", "port = %d" % self.port)):
            assert old in text, old
            text = text.replace(old, new)
        open(self.folder + "/plumbline.toml", "w").write(text)
        log, ports = open(self.folder + "/log", "w"), self.folder + "/ports"
        if os.path.exists(ports):
            os.remove(ports)
        self.daemon = subprocess.Popen([self.programs + "/plumblined", "--config", self.folder + "/plumbline.toml", "--port-file", ports], stderr=log)
        give_up = time.monotonic() + 20
        while not os.path.exists(ports):
            assert self.daemon.poll() is None and time.monotonic() < give_up, open(self.folder + "/log").read()
            time.sleep(0.02)
        self.port = int(open(ports).read().split()[1])

    def end(self, how):
        self.daemon.send_signal(how)
        self.daemon.wait()

    def cycle(self):
        values = self.cell.values
        try:
            self.bus = self.bus or Modbus(self.port)
            values["General"] = self.bus.read(0, 26)
            values["Block1"] = self.bus.read(2000, 20)
            values["Result"] = self.bus.read(100, 40)
            self.bus.write(1000, values["Window"])
        except OSError:
            self.bus = None  # the registers stay as they were
        self.cell.call({})
        time.sleep(0.02)
        return values

    def until(self, what, seconds=20):
        give_up = time.monotonic() + seconds
        while time.monotonic() < give_up:
            if what(self.cycle()):
                return
        raise AssertionError(open(self.folder + "/log").read())

    def give_probe(self):
        """The robot stands, the tip was measured where the model has it, within millimetres."""
        self.until(lambda v: self.bus and self.bus.read(400, 1)[0] & 1)  # the journal is open
        values = self.cell.values
        values["ProbeNow"] = False
        self.cycle()
        values["MeasuredX"], values["MeasuredY"], values["MeasuredZ"] = 2740000, 0, 1545000
        values["ProbeNow"] = True
        self.until(lambda v: v["Probe"].values["Done"] or v["Probe"].values["Failed"])
        assert values["ProbeTaken"], (values["Probe"].values["Code"], open(self.folder + "/log").read())
