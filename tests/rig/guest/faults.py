"""What happens on bad days. Each function injects its fault `count` times and returns (good, figure)."""
import ctypes
import os
import random
import signal
import socket
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


def served_again(patient):
    """Whether a PLC that waited is answered with a valid point from now on. Ends it."""
    polls, end = patient.polls, time.monotonic() + 30
    while patient.polls < polls + 3 and time.monotonic() < end:
        time.sleep(0.1)
    served = patient.polls >= polls + 3 and plc.valid(*patient.now())
    patient.end()
    return served


def kill(count):
    """kill -9: at rest, while a model is applied, shortly after a start. A PLC that waits for its
    answer keeps its connection, unless the daemon dies between a question and its answer."""
    watch, times = ready(), []
    patient = plc.Watch(period_s=0.2, timeout_s=20)
    patient.until(plc.valid, 20)
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
    served = served_again(patient)
    cut = patient.connections - 1
    time.sleep(2)
    kept = int(cell.sh("systemctl show --value -p NFileDescriptorStore plumbline.service"))
    good, figure = verdict(watch, times, 10)  # emulated cores; at their own speed: native.py
    return (
        good and served and not patient.corrupt and 0 <= cut <= 1 + count // 20 and kept <= 2,
        "%s; %d times a patient PLC's connection was cut, served at the end: %s; %d kept for the next start"
        % (figure, cut, served, kept),
    )


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


THREADS = ("plumblined", "cycle", "robot", "modbus", "monitoring", "zoom", "images")  # the first: main


def hung(count):
    """One thread after the other stands still; the service manager starts the daemon anew."""
    watch, times, slowest = ready(), [], {}
    for name in count * THREADS:
        pid = cell.main_pid()
        named = {
            open("/proc/%d/task/%s/comm" % (pid, thread)).read().strip(): int(thread)
            for thread in os.listdir("/proc/%d/task" % pid)
            if name != THREADS[0] or int(thread) == pid
        }
        thread = named[name]
        began = time.monotonic()
        frozen = Frozen(thread)
        while cell.started_s() < began and time.monotonic() < began + 40:
            frozen.let_die()
            time.sleep(0.1)
        frozen.let_die()
        times.append(cell.started_s() - began if cell.started_s() > began else 99)
        slowest[name] = max(slowest.get(name, 0), times[-1])
        if watch.until(plc.valid, 20) is None:
            return False, "no valid point 20 s after %s hung" % name
        time.sleep(2)
    good, figure = verdict(watch, times, 7, "a new start after")
    return good, figure + " (" + ", ".join("%s %.1f" % pair for pair in slowest.items()) + ")"


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


def busy_share(for_s):
    """What the daemon takes of a core."""
    before = cell.usage()[2]
    time.sleep(for_s)
    return (cell.usage()[2] - before) / for_s


def grown(memory):
    """KiB from the middle to the end: a buffer that is used late is a step, what is lost at each turn
    goes on. 0 of few turns."""
    tenth, middle = len(memory) // 10, len(memory) // 2
    if tenth < 3:
        return 0
    return (
        sorted(memory[-tenth:])[tenth // 2] - sorted(memory[middle - tenth : middle])[tenth // 2]
    )


VALID_S = 2 + 0.3 + 1.5  # a device's return, settle_ms, three looks at the marks at 2 Hz


def absent(count, plug, states, name):
    """What a device leaves and finds: seconds from when the kernel shows it until it is heard and until
    the state is as before, descriptors and memory, and what the daemon takes of a core while it is
    away against when it is there."""
    watch, times, valid, used, spent = ready(), [], [], [], []
    if cell.camera_is(*states, patience_s=30) is None:
        raise RuntimeError("not in its state before: %s" % (watch.now(),))
    for turn in range(count):
        weighed = turn in (0, count - 1)
        present = busy_share(3.0) if weighed else 0
        plug(False)
        if watch.until(lambda answered, valid, camera: camera not in states, 10) is None:
            raise RuntimeError("its loss was not told")
        time.sleep(1)
        if weighed:
            spent.append(busy_share(4.0) - present)
        plug(True)
        began = time.monotonic()
        back = cell.heard(True, True)
        times.append(99 if back is None else time.monotonic() - began)
        back = cell.camera_is(*states, patience_s=30)
        valid.append(99 if back is None else time.monotonic() - began)
        time.sleep(1)
        used.append(cell.usage())
    descriptors, memory = [use[0] for use in used], [use[1] for use in used]
    settled = max(memory[:10])  # its buffers were all used once
    good = (
        max(times) <= 2
        and max(valid) <= VALID_S
        and descriptors[-1] <= descriptors[0]
        and memory[-1] <= settled + 256
        and grown(memory) <= 64
        and max(spent) < 0.01
    )
    return (
        good,
        "%s heard after %.1f s at most of %d (2 allowed; later: %d; median %.1f), valid after %.1f s (%.1f allowed: it must stand and be looked at), descriptors %d -> %d, memory %d, after ten times %d, at last %d KiB (+256 allowed), from the middle on %+d (+64 allowed), away it takes %+.1f %% of a core"
        % (
            name,
            max(times),
            count,
            sum(t > 2 for t in times),
            sorted(times)[count // 2],
            max(valid),
            VALID_S,
            descriptors[0],
            descriptors[-1],
            memory[0],
            settled,
            memory[-1],
            grown(memory),
            100 * max(spent),
        ),
    )


def camera_away(count):
    def plug(plugged):
        cell.camera(plugged)
        if plugged:
            cell.sh("for k in $(seq 200); do [ -e /dev/v4l/by-id ] && break; sleep 0.02; done")

    return absent(count, plug, (4,), "camera and its lens")


def network_away(count):
    """The robot's cable: pulled and put back."""
    cell.sh("tc qdisc del dev robot0 root 2> /dev/null; true")
    watch, cleared, times, late = ready(), [], [], []
    for _ in range(count):
        cell.sh("ip link set robot0 down")
        began = time.monotonic()
        cleared.append((watch.until(plc.withdrawn, 5) or 1e9) - began)
        if cleared[-1] > STALE_S:
            polls = [c for c in watch.changes if c[0] > began - 1]
            late.append("%.2f s at %.1f: %s\n%s" % (cleared[-1], began, polls, cell.journal(6)))
        time.sleep(2)
        cell.sh("ip link set robot0 up")
        began = time.monotonic()
        times.append((watch.until(plc.valid, 20) or 1e9) - began)
        time.sleep(0.5)
    good = max(cleared) <= STALE_S and max(times) <= 2 and not watch.corrupt
    return (
        good,
        "withdrawn after %.2f s at most (%.2f allowed; later: %d), back after %.1f s at most of %d (2 allowed), slowest poll %.0f ms%s"
        % (
            max(cleared),
            STALE_S,
            len(late),
            max(times),
            count,
            1e3 * watch.slowest_s,
            "\n".join([""] + late),
        ),
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
        return (
            good,
            "withdrawn after %.2f s at most of %d (%.2f allowed), back after %.1f s (5 allowed)"
            % (
                max(cleared),
                len(cleared),
                STALE_S,
                max(times),
            ),
        )
    return good, (
        "no point was withdrawn, data %d ms old at most, back after %.1f s (5 allowed)"
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
    return not bad and not watch.corrupt, "%s, slowest poll %.0f ms" % (
        "not served: %s" % bad[:3] if bad else "the PLC was served throughout",
        1e3 * watch.slowest_s,
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
    """Gives a measured tip, within millimetres of the model's. @return the daemon's code"""
    words = [0] * 40
    words[0] = 6
    words[2:8] = client.read(318, 6)  # the tool's place as the controller reports it
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
    cell.stop()
    cell.configure("v4l2", loop=True)
    cell.sh(
        """[ -e /var/small.img ] || { truncate -s 32M /var/small.img; mke2fs -q -F -t ext4 -m 0 /var/small.img; }
loop=$(losetup -f --show /var/small.img)
dmsetup create state --table "0 65536 linear $loop 0"
mount /dev/mapper/state /mnt && cp -a /var/lib/plumbline/. /mnt/ && chown plumbline: /mnt && chmod 750 /mnt && umount /mnt
mount /dev/mapper/state /var/lib/plumbline""",
        90,
    )
    cell.start()


def whole_disk():
    cell.stop()
    cell.sh("umount /var/lib/plumbline; dmsetup remove state; losetup -D; rm /var/small.img", 60)
    cell.configure("v4l2")
    cell.start()


def loop_state():
    """(whether probes are recorded, whether there is a fault, how many were told as recorded)"""
    client = plc.Client(timeout_s=10)
    words = client.read(400, 6)
    client.close()
    return bool(words[0] & RECORDING), bool(words[0] & FAULT), words[4] << 16 | words[5]


RECORDING, FAULT = 1 << 0, 1 << 5
STORAGE_UNAVAILABLE = 19  # the code of a probe; bit 14 of the warnings, register 14
STORAGE_WARNING = 1 << 14


def loop_becomes(wanted, patience_s=60):
    end = time.monotonic() + patience_s
    while not wanted(*loop_state()):
        if time.monotonic() > end:
            raise RuntimeError("the loop stays %s\n%s" % (loop_state(), cell.journal(15)))
        time.sleep(0.1)


def disk(count, fault):
    """The state cannot be written: it is told, points stay valid, what was taken is kept in memory;
    once the state can be written it is recorded, and what was told as recorded is in the journal.
    """
    full = "dd if=/dev/zero of=/var/lib/plumbline/filler bs=4k 2> /dev/null; true"
    table = "dmsetup suspend --noflush state; dmsetup load state --table '%s'; dmsetup resume state"
    linear = "loop=$(losetup -j /var/small.img | cut -d: -f1); " + table.replace(
        "'%s'", '"0 65536 linear $loop 0"'
    )
    anew = "systemctl stop plumbline.socket plumbline.service; umount /var/lib/plumbline; e2fsck -p /dev/mapper/state > /dev/null; mount /dev/mapper/state /var/lib/plumbline; systemctl start plumbline.socket plumbline.service"
    inject, mend, same_process = {
        "full": (full, "rm /var/lib/plumbline/filler", True),
        # As after an error of the disk: the file system lets nobody write any more.
        "read-only": ("mount -o remount,abort /var/lib/plumbline 2> /dev/null; true", anew, False),
        "input/output errors": (table % "0 65536 error", linear + "; " + anew, False),
    }[fault]
    watch, told = ready(), 0
    models = cell.sh("plumbline model list")
    loop_becomes(lambda recording, faulty, number: recording and not faulty)
    client = plc.Client(timeout_s=10)
    give(client, 1)  # a journal without rows is not exported
    client.close()
    loop_becomes(lambda recording, faulty, number: number > 0)
    kept = probes_kept()
    for turn in range(count):
        loop_becomes(lambda recording, faulty, number: recording and not faulty)
        client = plc.Client(timeout_s=10)
        before = loop_state()[2] + give(client, 2).count(0)
        loop_becomes(lambda recording, faulty, number: number >= before)
        cell.sh(inject, 60)
        codes = give(client, 3)
        loop_becomes(lambda recording, faulty, number: faulty, 20)
        still, during = watch.now(), loop_state()[2]
        client.close()
        cell.sh(mend, 60)
        if watch.until(plc.valid, 60) is None:
            return False, "no valid point afterwards: " + cell.journal(15)
        loop_becomes(lambda recording, faulty, number: recording and not faulty)
        if same_process:  # what was taken meanwhile is recorded now
            taken = codes.count(0)
            loop_becomes(lambda recording, faulty, number: number >= before + taken, 20)
            told += 2 + taken
        else:
            told += during - before + 2
        if not (still[1] and still[2]) or set(codes) - {0, 12, STORAGE_UNAVAILABLE}:
            return False, "during: %s, point %s" % (codes, still)
    same = cell.sh("plumbline model list") == models
    rows = probes_kept() - kept
    return (
        same and not watch.corrupt and rows >= told,
        "told as a fault, points valid; %d probes told as recorded, %d in the journal; models kept; %d times"
        % (told, rows, count),
    )


FILL = "dd if=/dev/zero of=/var/lib/plumbline/filler bs=4k 2> /dev/null; sync"


def full_disk_for_power_cut():
    """The state goes to a small disk of its own, mounted at every start of the machine, without room
    for a byte."""
    cell.stop()
    cell.configure("v4l2", loop=True)
    cell.sh(
        """truncate -s 32M /var/full.img && mke2fs -q -F -t ext4 -m 0 /var/full.img
mount -o loop /var/full.img /mnt && cp -a /var/lib/plumbline/. /mnt/ && chown plumbline: /mnt && chmod 750 /mnt && umount /mnt
echo '/var/full.img /var/lib/plumbline ext4 loop,x-systemd.before=plumbline.service 0 0' >> /etc/fstab
mount /var/lib/plumbline
"""
        + FILL,
        90,
    )
    cell.start()


def whole_disk_after_power_cut():
    cell.stop()
    cell.sh(
        "umount /var/lib/plumbline; sed -i '/full.img/d' /etc/fstab; losetup -D; rm /var/full.img; "
        "systemctl daemon-reload",  # the mount unit made of fstab goes with its line
        60,
    )
    cell.configure("v4l2")
    cell.start()


def started_on_a_full_disk():
    """After the power came back: points valid, probes refused with the reason; with room again the
    same process takes them. Full again at the end, for the next cut. (good, figure)"""
    watch = ready()
    client = plc.Client(timeout_s=10)
    pid = cell.sh("systemctl show -P MainPID plumbline.service")
    refused = give(client, 3)
    warned = bool(client.read(14, 1)[0] & STORAGE_WARNING)
    cell.sh("rm /var/lib/plumbline/filler; sync")
    loop_becomes(lambda recording, faulty, number: recording and not faulty, 30)
    taken = give(client, 1)
    client.close()
    same = pid == cell.sh("systemctl show -P MainPID plumbline.service")
    cell.sh(FILL, 60)
    good = refused == [STORAGE_UNAVAILABLE] * 3 and warned and taken == [0] and same
    figure = "probes answered %s, warned: %s; with room %s, same process: %s"
    return good and not watch.corrupt, figure % (refused, warned, taken, same)


def give(client, count):
    """@return the daemon's codes for so many probes"""
    give.sequence = getattr(give, "sequence", os.getpid() % 1000)
    codes = []
    for _ in range(count):
        give.sequence += 1
        codes.append(probe(client, give.sequence))
    return codes


def probes_kept():
    cell.sh(
        "runuser -u plumbline -- plumbline journal export --cell /etc/plumbline/cell.toml --state /var/lib/plumbline --output /tmp/journal.csv",
        60,
    )
    return open("/tmp/journal.csv").read().count("\n") - 1


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
