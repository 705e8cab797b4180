"""What happens on a good day: installed, started, polled, its lens turned, upgraded, purged. Each
function returns (good, figure)."""
import os
import shutil
import time

import cell
import faults
import plc

UNTOUCHED = "/var/log /var/cache /var/lib/dpkg /var/lib/apt /var/lib/systemd /run /proc /sys /dev /tmp /var/tmp /rig /root /usr/share/mime /etc/passwd- /etc/group- /etc/shadow- /etc/gshadow-"
BEFORE = "/var/tmp/rig-files-before"


def files():
    skip = " -o ".join("-path " + name for name in UNTOUCHED.split())
    return set(cell.sh("find / -xdev \\( %s \\) -prune -o -print" % skip, 120).split("\n"))


def install():
    # On the disk: the agent that runs now does not outlive a power cut.
    with open(BEFORE, "w") as out:
        out.write("\n".join(files()))
        out.flush()
        os.fsync(out.fileno())
    began = time.monotonic()
    cell.sh("apt-get install -y -q /rig/plumbline.deb", 180)
    idle = cell.sh("systemctl is-active plumbline.service", check=False).strip()
    return idle == "inactive", "%.0f s; it waits for its configuration" % (time.monotonic() - began)


def start(zoom):
    """To the first valid point, from the start of the service's process."""
    cell.stop()
    cell.configure(zoom)
    cell.watch()
    cell.sh("systemctl enable -q plumbline.service plumbline.socket")
    cell.start()
    took = cell.first_valid_s(60)
    if took is None:
        return False, "none came: " + cell.journal(15)
    return took <= 10, "%.1f s after the service's start, 10 allowed" % took


def security(unit):
    words = cell.sh("systemd-analyze security --no-pager %s | tail -1" % unit, 60).split()
    level = float(words[words.index(unit + ":") + 1])
    return level <= 1.5, "%.1f, 1.5 allowed" % level


def kernel_devices():
    """The tests that ctest skips where the kernel lacks these virtual devices."""
    tests = ("gauge_kernel_device_test [uhid]", "zoom_kernel_device_test [uhid]")
    tests += ("zoom_kernel_device_test [gpio-sim]", "display_kms_test")
    for test in tests:
        told = cell.sh("/rig/" + test, 120, check=False)
        if "SKIPPED" in told or "All tests passed" not in told:
            return False, "%s: %s" % (test, told[-1500:])
    return True, "passed: " + ", ".join(tests)


def visit():
    """The PLC goes to the points as taught and as corrected; a tracker sees where they land."""
    cell.running["watch"].reference = None
    told = cell.sh(
        "/rig/plumbline-plc-client visit --robot 10.77.1.2:502 --tracker 10.77.1.2:503 --daemon 10.77.2.1:502"
        " --robot-profile generic --program /rig/cockpit-program.toml --require-mm 0.25 --settle-s 0.5",
        150,
        check=False,
    )
    lines = [line for line in told.split("\n") if "distance" in line]
    cell.tell("robot", "payload 60")
    client, end = plc.Client(timeout_s=10), time.monotonic() + 20
    while abs(plc.float_at(client.read(330, 2), 0) - 60) > 0.1 and time.monotonic() < end:
        time.sleep(0.05)  # points are where they were once the load is what it was
    time.sleep(0.5)
    client.close()
    good = "is below" in told
    return (
        good,
        "; ".join(" -> ".join(line.split()[1:]) + " mm" for line in lines) if good else told[-300:],
    )


def turned(turn_away, turn_back):
    """@return whether the register said stale, and came back; the functions turn the lens"""
    first = cell.camera_is(4, patience_s=30)
    if first is None:
        return False, "never valid: " + cell.sh(
            "plumbline status | grep -A2 '^camera'", check=False
        )
    turn_away()
    withdrawn = cell.camera_is(1, 2, 3, 5)
    stale = cell.camera_is(5)
    turn_back()
    back = cell.camera_is(4, patience_s=30)
    if None in (withdrawn, stale, back):
        return False, "withdrawn %s, stale %s, back %s" % (withdrawn, stale, back)
    return True, "lens withdrawn after %.2f s, stale after %.1f s, back after %.1f s" % (
        withdrawn,
        withdrawn + stale,
        back,
    )


def turned_at_the_camera():
    return turned(
        lambda: cell.tell("camera", "zoom 7000"), lambda: cell.tell("camera", "zoom 4000")
    )


def upgrade():
    before = open("/etc/plumbline/plumbline.toml").read()
    model = cell.sh("plumbline model list")
    watch = cell.watch()
    watch.until(plc.valid, 20)
    patient = plc.Watch(period_s=0.2, timeout_s=60)
    patient.until(plc.valid, 20)
    pid = cell.main_pid()
    cell.sh("apt-get install -y -q /rig/plumbline-next.deb", 180)
    watch.until(plc.withdrawn, 1)
    back = watch.until(plc.valid, 30)
    another = cell.main_pid() not in (0, pid)
    now = cell.sh("dpkg-query -W -f '${Version}' plumbline")
    kept = (
        faults.served_again(patient)
        and patient.connections == 1
        and not patient.corrupt
        and open("/etc/plumbline/plumbline.toml").read() == before
        and cell.sh("plumbline model list") == model
    )
    return (
        kept and another and back is not None and now.endswith("next"),
        "version %s, another process: %s, configuration, models and the PLC's connection kept: %s, points valid: %s"
        % (now, another, kept, back is not None),
    )


def purge():
    cell.unwatch()
    cell.sh("apt-get purge -y -q plumbline", 120)
    left = sorted(
        name
        for name in files() - set(open(BEFORE).read().split("\n"))
        if "__pycache__" not in name and not name.startswith("/etc/systemd/system/dbus")
    )
    users = cell.sh("getent passwd plumbline; getent group plumbline", check=False)
    return not left and not users, "nothing left" if not left and not users else "left: %s %s" % (
        left[:8],
        users,
    )
