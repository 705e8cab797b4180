"""A new user follows "The first cell" of README.md, command by command, in an empty folder, until a Modbus
client reads a point that is corrected by more than 1 mm, and a picture is written.

    first_cell_test.py BUILD_BIN       with the programs that were built
    first_cell_test.py --deb FILE.deb  with the package, in an empty Debian made by mmdebstrap; needs root and
                                       a package mirror. Exit code 77: skipped"""

import os
import re
import shlex
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

SECTION = open("README.md").read().split("\n## The first cell\n")[1].split("\n## ")[0]
COMMANDS = [line[4:].split("  #")[0].strip() for line in SECTION.split("Your own cell")[0].splitlines() if line.startswith("    ")]
COMMANDS = [command for command in COMMANDS if command and not command.startswith("#")]
TAUGHT_MM = (1336.0, 163.9, 345.9)


class Checkout:
    """The programs of the build, found through PATH as the README says."""

    def __init__(self, programs, root):
        self.root = root
        self.environment = {**os.environ, "PATH": os.path.abspath(programs) + ":" + os.environ["PATH"]}

    def copy_configuration(self):
        shutil.copytree("config", self.root + "/my-cell")

    def start(self, command, **streams):
        return subprocess.Popen(shlex.split(command), cwd=self.root + "/my-cell", env=self.environment, **streams)


class EmptyDebian:
    """A Debian 12 of essential packages, and Plumbline with what `apt install` adds to it."""

    def __init__(self, deb, root):
        self.root, name = root + "/debian", os.path.basename(deb)
        os.mkdir(self.root)
        made = subprocess.run(
            ["mmdebstrap", "--variant=minbase", "--skip=check/empty", "--mode=root",
             "--customize-hook=copy-in %s /root" % os.path.abspath(deb),
             "--customize-hook=chroot \"$1\" apt-get install -y /root/%s" % name,
             "bookworm", self.root], capture_output=True, text=True)
        if made.returncode:
            print("SKIPPED: mmdebstrap: " + made.stderr[-2000:])
            sys.exit(77)

    def copy_configuration(self):
        copy = re.search(r"with the package: (cp -r .*)$", SECTION, re.M).group(1)
        subprocess.run(["chroot", self.root, "sh", "-c", "cd /root && " + copy], check=True)

    def start(self, command, **streams):
        mounted = 'mount -t proc proc "$0/proc" && exec chroot "$0" sh -c "cd /root/my-cell && exec $1"'
        return subprocess.Popen(["unshare", "--mount", "sh", "-c", mounted, self.root, command], **streams)

    @property
    def folder(self):
        return self.root + "/root/my-cell"


def run(place, command):
    process = place.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        out, errors = process.communicate(timeout=120)
    except BaseException:
        process.kill()
        process.wait()
        raise
    assert process.returncode == 0, "%s: exit %d\n%s%s" % (command, process.returncode, out, errors)
    return out


def exactly(connection, count):
    data = b""
    while len(data) < count:
        more = connection.recv(count - len(data))
        assert more, "the daemon closed the connection"
        data += more
    return data


def registers(port, first, count):
    """Modbus TCP, function 3, with nothing of Plumbline."""
    with socket.create_connection(("127.0.0.1", port), 2) as connection:
        connection.sendall(struct.pack(">HHHBBHH", 7, 0, 6, 1, 3, first, count))
        head = struct.unpack(">HHHBBB", exactly(connection, 9))
        assert head[:2] == (7, 0) and head[4:] == (3, 2 * count), head
        return exactly(connection, 2 * count)


def corrected_point(port, daemon, log):
    give_up = time.monotonic() + 60
    while time.monotonic() < give_up:
        assert daemon.poll() is None, open(log).read()
        try:
            block = registers(port, 2000, 20)
        except OSError:
            block = bytes(40)
        point, validity, code, x, y, z = struct.unpack(">HHHfff", block[:18])
        if validity & 1:
            return point, code, (x, y, z), struct.unpack(">ff", block[30:38])
        time.sleep(0.05)
    raise AssertionError("no valid point\n" + open(log).read())


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def follow(place, folder):
    assert COMMANDS[:2] == ["./dev build", 'export PATH="$PWD/build/bin:$PATH"'], COMMANDS
    assert COMMANDS[2] == "cp -r config my-cell && cd my-cell", COMMANDS
    place.copy_configuration()
    check, daemon_command, status, snapshot = COMMANDS[3:]
    port, log = free_port(), folder + "/log"  # other tests run at the same time
    text = open(folder + "/first-cell.toml").read()
    assert "port = 1502" in text and "--port 1502" in status
    open(folder + "/first-cell.toml", "w").write(text.replace("port = 1502", "port = %d" % port))

    told = run(place, check)
    assert "no faults" in told and "nothing is corrected" not in told, told
    promised = re.search(r"corrected by ([0-9.]+) mm, \+-([0-9.]+) mm", SECTION).groups()
    row = re.search(r"left bracket +6 kg +([0-9.]+) mm +([0-9.]+) mm assumed", told)
    assert row and row.groups() == promised, (promised, told)

    with open(log, "w") as errors:
        daemon = place.start(daemon_command, stderr=errors)
    try:
        point, code, xyz, (correction, radius) = corrected_point(port, daemon, log)
        away = sum((a - b) ** 2 for a, b in zip(xyz, TAUGHT_MM)) ** 0.5
        assert point == 1 and code == 0, (point, code)
        assert away > 1 and abs(away - correction) < 0.01, (xyz, correction)
        assert "%.1f" % correction == promised[0] and "%.1f" % radius == promised[1], (correction, radius)
        heights = re.search(r"is ([0-9.]+) mm where ([0-9.]+) mm was taught", SECTION).groups()
        assert ("%.1f" % xyz[2], "%.1f" % TAUGHT_MM[2]) == heights, (xyz, heights)
        told = run(place, status.replace("1502", str(port)))
        assert re.search(r"corrected by %s mm, ±%s mm \(95 %%, assumed\)" % promised, told), told
        told = run(place, snapshot)
        picture = open(folder + "/cell.png", "rb").read()
        assert picture[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", picture[16:24]) == (1280, 720), told
        assert os.path.exists(re.search(r"\]\((docs/.*\.png)\)", SECTION).group(1))
    finally:
        daemon.send_signal(signal.SIGINT)
        try:
            daemon.wait(60)
        finally:
            daemon.kill()
            daemon.wait()
    assert daemon.returncode == 0, open(log).read()
    print("point 1: corrected by %.2f mm, radius %.2f mm, read by Modbus" % (correction, radius))


if len(sys.argv) == 3 and (os.getuid() or not shutil.which("mmdebstrap")):
    print("SKIPPED: the empty Debian needs root and mmdebstrap")
    sys.exit(77)
with tempfile.TemporaryDirectory(dir="/var/tmp" if len(sys.argv) == 3 else None) as scratch:
    if len(sys.argv) == 3:
        place = EmptyDebian(sys.argv[2], scratch)
        follow(place, place.folder)
    else:
        place = Checkout(sys.argv[1], scratch)
        follow(place, scratch + "/my-cell")
