"""What happens on bad days. Each function injects its fault `count` times and returns (good, figure)."""
import ctypes
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import time

import cell
import plc


def recovered(watch, began, patience_s=30):
    """Seconds from `began` to the first good poll after a bad one."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        bad = [c[0] for c in watch.changes if c[0] >= began and not (c[1] and c[2])]
        good = [c[0] for c in watch.changes if bad and c[0] > bad[0] and c[1] and c[2]]
        if good:
            return good[0] - began
        time.sleep(0.01)
    raise RuntimeError("not back within %d s: %s\n%s" % (patience_s, watch.now(), cell.journal(15)))


def verdict(watch, times, allowed_s, words="first good poll after"):
    corrupt = len(watch.corrupt)
    return corrupt == 0 and max(
        times
    ) <= allowed_s, "%s %.1f s at most of %d, %.1f allowed; %d corrupt%s" % (
        words,
        max(times),
        len(times),
        allowed_s,
        corrupt,
        ": " + watch.corrupt[0] if corrupt else "",
    )


def ready():
    watch = cell.watch()
    if watch.until(plc.valid, 40) is None:
        raise RuntimeError("no valid point: " + cell.journal(15))
    time.sleep(0.3)
    return watch


def kill(count):
    """kill -9: at rest, while a model is applied, shortly after a start."""
    watch, times = ready(), []
    for turn in range(count):
        applying = (
            subprocess.Popen(
                ["plumbline", "model", "apply", "1"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            if turn % 3 == 1
            else None
        )
        time.sleep(random.uniform(0.05, 1.0 if applying else 3.0))
        began = time.monotonic()
        os.kill(cell.main_pid(), signal.SIGKILL)
        times.append(recovered(watch, began))
        if turn % 3 != 2:
            time.sleep(1)
        if applying:
            applying.wait()
    return verdict(watch, times, 10)  # emulated cores; at this computer's speed: native.py


class Frozen:
    """One thread of the daemon stands still, as one that hangs in the kernel: held by ptrace."""

    def __init__(self, thread):
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.libc.ptrace.argtypes = [ctypes.c_long] + [ctypes.c_void_p] * 3
        self.thread = thread
        if self.libc.ptrace(0x4206, thread, None, None) != 0:  # SEIZE
            raise OSError(ctypes.get_errno(), "ptrace")
        self.libc.ptrace(0x4207, thread, None, None)  # INTERRUPT
        os.waitpid(thread, 0x40000000)

    def let_die(self):
        """A thread that is traced stays until its end is taken note of."""
        try:
            if os.waitpid(self.thread, 0x40000000 | os.WNOHANG)[0] == self.thread:
                self.libc.ptrace(7, self.thread, None, None)  # CONT, with the signal that ends it
        except ChildProcessError:
            pass


PATIENT = (
    "loop",
    "images",
    "zoom",
    "plumblined",
)  # of which the last is the robot's link, or a server


def hung(count):
    """The cycle, or the main thread, stands still; the service manager starts the daemon anew. What waits
    for devices has a longer patience (app/daemon/daemon.cc)."""
    watch, times, names = ready(), [], []
    for turn in range(count):
        pid = cell.main_pid()
        named = [
            (open("/proc/%d/task/%s/comm" % (pid, thread)).read().strip(), int(thread))
            for thread in os.listdir("/proc/%d/task" % pid)
        ]
        impatient = [("main", pid)] + [pair for pair in named if pair[0] not in PATIENT]
        name, thread = impatient[turn % len(impatient)]
        names.append(name)
        began = time.monotonic()
        frozen = Frozen(thread)
        while cell.started_s() < began and time.monotonic() < began + 40:
            frozen.let_die()
            time.sleep(0.1)
        frozen.let_die()
        times.append(cell.started_s() - began if cell.started_s() > began else 99)
        if watch.until(plc.valid, 20) is None:
            return False, "no valid point 20 s after %s hung" % name
        time.sleep(2)
    good, figure = verdict(watch, times, 7, "a new start after")
    return good, figure + " (" + ", ".join(names) + ")"


def clock(count):
    """A year forth and a year back."""
    watch = ready()
    year = 365 * 86400
    for turn in range(count):
        for jump in (year, -year):
            time.clock_settime(time.CLOCK_REALTIME, time.time() + jump)
            time.sleep(1.5)
    bad = [c for c in watch.changes[1:] if not c[2]]
    return (
        not bad and not watch.corrupt,
        "%d jumps of a year, points valid throughout, slowest poll %.0f ms"
        % (2 * count, 1e3 * watch.slowest_s)
        if not bad
        else "withdrawn: %s" % bad[:3],
    )


def absent(count, plug, states, name, away_s=4.0):
    """What a device leaves and finds: seconds from its return to the state before, descriptors and
    memory after the first and the last time, processor time while it is away."""
    watch, times = ready(), []
    if cell.camera_is(*states, patience_s=30) is None:
        raise RuntimeError("not in its state before: %s" % (watch.now(),))
    first = spent = None
    for _ in range(count):
        _, _, busy = cell.usage()
        time.sleep(2)
        present = (cell.usage()[2] - busy) / 2
        plug(False)
        if watch.until(lambda answered, valid, camera: camera not in states, 10) is None:
            raise RuntimeError("its loss was not told")
        time.sleep(1)
        _, _, busy = cell.usage()
        time.sleep(away_s)
        spent = (cell.usage()[2] - busy) / away_s - present
        plug(True)
        began = time.monotonic()
        back = cell.camera_is(*states, patience_s=30)
        times.append(99 if back is None else time.monotonic() - began)
        time.sleep(1)
        first = first or cell.usage()
    last = cell.usage()
    good = (
        max(times) <= 2 + SETTLE_S
        and last[0] <= first[0]
        and last[1] <= first[1] + 1024
        and spent < 0.01
    )
    return (
        good,
        "%s back after %.1f s at most of %d (%.1f allowed: %s), descriptors %d -> %d, memory %d -> %d KiB (+1024 allowed, looser than the issue), processor while away %+.1f %%"
        % (
            name,
            max(times),
            count,
            2 + SETTLE_S,
            "2 s, and the lens must have stood and been looked at",
            first[0],
            last[0],
            first[1],
            last[1],
            100 * spent,
        ),
    )


SETTLE_S = 1.5  # settle_ms of the configuration, three looks at the marks at 5 Hz, detection


def camera_away(count):
    def plug(plugged):
        cell.camera(plugged)
        if plugged:
            cell.sh("for k in $(seq 200); do [ -e /dev/v4l/by-id ] && break; sleep 0.02; done")

    return absent(count, plug, (4,), "camera and its lens")


def network_away(count):
    """The robot's cable: pulled and put back."""
    cell.sh("tc qdisc del dev robot0 root 2> /dev/null; true")
    watch, cleared, times = ready(), [], []
    for _ in range(count):
        cell.sh("ip link set robot0 down")
        began = time.monotonic()
        cleared.append((watch.until(plc.withdrawn, 5) or 1e9) - began)
        time.sleep(2)
        cell.sh("ip link set robot0 up")
        began = time.monotonic()
        times.append((watch.until(plc.valid, 20) or 1e9) - began)
        time.sleep(0.5)
    good = max(cleared) <= STALE_S and max(times) <= 2 and not watch.corrupt
    return (
        good,
        "withdrawn after %.2f s at most (%.2f allowed), back after %.1f s at most of %d (2 allowed)"
        % (max(cleared), STALE_S, max(times), count),
    )


STALE_S = (
    0.5 + 0.25
)  # stale_after_ms of the configuration; a cycle, a poll and the fault's own command


def robot_told(line):
    """Gives the virtual cell a line, which answers ok, or the fault is not in force."""
    answers = lambda: open("/run/robot.log").read().split("\n").count("ok")
    before, end = answers(), time.monotonic() + 5
    cell.tell("robot", line)
    while answers() == before:
        if time.monotonic() > end:
            raise RuntimeError("the virtual cell did not answer ok to: " + line)
        time.sleep(0.01)


def link(count, fault):
    """The robot's link goes bad; the valid bit clears within the staleness limit, or data stay fresh."""
    inject, mend, must_clear = {
        "stalled": (lambda: robot_told("fault stall 2"), lambda: time.sleep(2), True),
        "delayed": (
            lambda: cell.sh("tc qdisc add dev robot0 root netem delay 700ms"),
            lambda: cell.sh("tc qdisc del dev robot0 root"),
            True,
        ),
        "lost": (
            lambda: cell.sh("tc qdisc add dev robot0 root netem loss 100%"),
            lambda: cell.sh("tc qdisc del dev robot0 root"),
            True,
        ),
        "reordered": (
            lambda: cell.sh("tc qdisc add dev robot0 root netem delay 30ms 20ms reorder 40% 50%"),
            lambda: cell.sh("tc qdisc del dev robot0 root"),
            False,
        ),
        "half closed": (lambda: robot_told("fault half-close"), lambda: None, False),
        "reset": (lambda: robot_told("fault reset"), lambda: None, False),
    }[fault]
    cell.sh("tc qdisc del dev robot0 root 2> /dev/null; true")  # a check before that broke off
    watch, cleared, times = ready(), [], []
    oldest_ms = 0
    for _ in range(count):
        client = plc.Client()
        inject()
        began = time.monotonic()  # from here on the fault is in force
        while time.monotonic() < began + 2:
            head, point = client.read(10, 6), client.read(2000, 2)
            if point[1] & 1:
                oldest_ms = max(oldest_ms, head[5])
            elif len(cleared) < len(times) + 1:
                cleared.append(time.monotonic() - began)
            time.sleep(0.02)
        mend()
        began = time.monotonic()
        at = watch.until(plc.valid, 20)
        times.append(max(0, (at or 1e9) - began))
        client.close()
        time.sleep(0.5)
    good = (
        oldest_ms <= 1e3 * STALE_S
        and (not must_clear or len(cleared) == count)
        and not watch.corrupt
        and max(times) < 5
    )
    if cleared:
        good = good and max(cleared) <= STALE_S
        return good, "withdrawn after %.2f s at most of %d (%.2f allowed), back after %.1f s (5 allowed, looser than the issue)" % (
            max(cleared),
            len(cleared),
            STALE_S,
            max(times),
        )
    return good, (
        "no point was withdrawn, data %d ms old at most, back after %.1f s (5 allowed, looser than the issue)"
        % (oldest_ms, max(times))
    )


def descriptors(count):
    """No descriptor is left: who is connected is served, who comes later waits or is refused."""
    watch = ready()
    for _ in range(count):
        pid = cell.main_pid()
        used = cell.usage()[0]
        cell.sh("prlimit --nofile=%d:4096 --pid %d" % (used, pid))
        strangers = []
        for _ in range(5):
            try:
                strangers.append(socket.create_connection(plc.DAEMON, 1))
            except OSError:
                pass
        time.sleep(1)
        served = watch.now()
        for stranger in strangers:
            stranger.close()
        cell.sh("prlimit --nofile=4096:4096 --pid %d" % pid)
        time.sleep(0.5)
        client = plc.Client(timeout_s=5)
        client.read(10, 2)
        client.close()
        if not served[1] or pid != cell.main_pid():
            return False, "%s, process %d -> %d" % (served, pid, cell.main_pid())
    bad = [c for c in watch.changes[1:] if not (c[1] and c[2])]
    return not bad and not watch.corrupt, "the PLC was served throughout, slowest poll %.0f ms" % (
        1e3 * watch.slowest_s
    )


HOG = """
import time
free = lambda: int(next(line for line in open("/proc/meminfo") if line.startswith("MemAvailable")).split()[1])
kept = []
while free() > 64 << 10:
    kept.append(bytearray(8 << 20))
time.sleep(5)
"""


def memory(count):
    """A program takes all memory there is but 64 MiB, for five seconds."""
    watch = ready()
    pid = cell.main_pid()
    for _ in range(count):
        hog = subprocess.run(
            [sys.executable, "-c", HOG],
            timeout=90,
            stderr=subprocess.DEVNULL,
            preexec_fn=lambda: open("/proc/self/oom_score_adj", "w").write("1000"),
        )
        if hog.returncode != 0:
            return False, "the program that takes the memory ended with %d" % hog.returncode
    good = cell.main_pid() == pid and not watch.corrupt and watch.until(plc.valid, 10) is not None
    lost = sum(1 for c in watch.changes[1:] if not (c[1] and c[2]))
    return good, "the same process serves; slowest poll %.0f ms, %d times no valid point" % (
        1e3 * watch.slowest_s,
        lost,
    )


def probe(client, sequence):
    """Gives a measured tip. @return the daemon's code"""
    words = [0] * 40
    words[0] = 6
    words[2:8] = struct.unpack(">6H", struct.pack(">3f", 2683.0, -424.0, 973.7))
    words[39] = sequence
    client.write(1000, words)
    end = time.monotonic() + 20
    while time.monotonic() < end:
        answer = client.read(100, 4)
        if answer[1] == sequence:
            return answer[2]
        time.sleep(0.02)
    return -1


def small_disk():
    """The state goes to a disk of its own, whose faults can be chosen; probes are recorded."""
    cell.configure("v4l2", loop=True)
    cell.sh(
        """systemctl stop plumbline.service
[ -e /var/small.img ] || { truncate -s 32M /var/small.img; mke2fs -q -F -t ext4 -m 0 /var/small.img; }
loop=$(losetup -f --show /var/small.img)
dmsetup create state --table "0 65536 linear $loop 0"
mount /dev/mapper/state /mnt && cp -a /var/lib/plumbline/. /mnt/ && chown plumbline: /mnt && chmod 750 /mnt && umount /mnt
mount /dev/mapper/state /var/lib/plumbline
systemctl start plumbline.service""",
        90,
    )


def whole_disk():
    cell.sh(
        "systemctl stop plumbline.service; umount /var/lib/plumbline; dmsetup remove state; losetup -D; rm /var/small.img; systemctl start plumbline.service",
        60,
    )


def disk(count, fault):
    """The state cannot be written: probes are refused, points stay valid; afterwards all goes on."""
    full = "dd if=/dev/zero of=/var/lib/plumbline/filler bs=64k 2> /dev/null; true"
    table = "loop=$(dmsetup table state | cut -d' ' -f4); dmsetup suspend --noflush state; dmsetup load state --table '%s'; dmsetup resume state"
    anew = "systemctl stop plumbline.service; umount /var/lib/plumbline; e2fsck -p /dev/mapper/state > /dev/null; mount /dev/mapper/state /var/lib/plumbline; systemctl start plumbline.service"
    inject, mend = {
        "full": (full, "rm /var/lib/plumbline/filler"),
        "read-only": (
            "mount -o remount,ro /var/lib/plumbline",
            "mount -o remount,rw /var/lib/plumbline",
        ),
        "input/output errors": (
            table % "0 65536 error",
            "loop=$(losetup -j /var/small.img | cut -d: -f1); dmsetup suspend --noflush state; "
            'dmsetup load state --table "0 65536 linear $loop 0"; dmsetup resume state; ' + anew,
        ),
    }[fault]
    watch, codes = ready(), []
    models = cell.sh("plumbline model list")
    for turn in range(count):
        client = plc.Client(timeout_s=10)
        cell.sh(inject, 60)
        during = [probe(client, 10 * turn + k + 1 + os.getpid() % 100 * 100) for k in range(2)]
        still = watch.now()
        client.close()
        cell.sh(mend, 60)
        watch.until(plc.valid, 30)
        client = plc.Client(timeout_s=10)
        code, end = -1, time.monotonic() + 10
        while code != 0 and time.monotonic() < end:
            code = probe(client, random.randrange(20000, 60000))
            time.sleep(0.5)
        client.close()
        codes.append((during, code))
        if not (still[1] and still[2]) or code != 0 or 12 not in during:
            return False, "during: %s, point %s; after: %s" % (during, still, code)
    same = cell.sh("plumbline model list") == models
    return (
        same and not watch.corrupt,
        "points valid, probes refused (code 12), taken again afterwards; models kept; %d times"
        % count,
    )


def display_away(count):
    """The monitor's cable."""
    card = cell.sh("ls -d /sys/class/drm/card*-*").split()[0]
    restarts = lambda: int(cell.sh("systemctl show -P NRestarts plumbline-view.service"))
    before = restarts()
    for _ in range(count):
        cell.sh(
            "echo off > %s/status; udevadm trigger -s drm; sleep 3; echo detect > %s/status; udevadm trigger -s drm; sleep 3"
            % (card, card)
        )
    after = restarts()
    active = cell.sh("systemctl is-active plumbline-view.service", check=False).strip()
    return (
        active == "active" and after == before,
        "pulled %d times, %s, restarts %d -> %d" % (count, active, before, after),
    )
