"""The cell around the daemon: networks, robot, devices, package, service."""
import os
import shutil
import subprocess
import threading
import time

import plc

STATE = "/var/lib/plumbline"
running = {}  # name: process or watch
ZOOMS = {
    "v4l2": 'kind = "v4l2"',
    "hid": 'kind = "hid"\nprofile = "computar-lensconnect"\nperiod_ms = 100\ntimeout_ms = 500',
    "visca": 'kind = "visca"\ndevice = "@serial@"\nbaud = 38400\nperiod_ms = 200\ntimeout_ms = 500',
    "gpio": 'kind = "gpio"\nchip = "rig-gpio"\nline = 0',
}


def sh(command, timeout_s=60, check=True):
    done = subprocess.run(
        command,
        shell=True,
        executable="/bin/bash",
        timeout=timeout_s,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
    )
    if check and done.returncode != 0:
        raise RuntimeError("%s: exit %d: %s" % (command, done.returncode, done.stdout[-2000:]))
    return done.stdout


def networks():
    for name, net in (("robot", 1), ("plc", 2)):
        sh(
            f"""ip netns add {name}
ip link add {name}0 type veth peer name eth0 netns {name}
ip addr add 10.77.{net}.1/24 dev {name}0; ip link set {name}0 up
ip -n {name} addr add 10.77.{net}.2/24 dev eth0; ip -n {name} link set eth0 up; ip -n {name} link set lo up"""
        )


def another_computer():
    """What is a device of its own in a plant does not wait for this one's programs."""
    os.nice(-10)


def robot():
    """The virtual cell of the demo, with what it hides, holding its cockpit module."""
    words = [
        "ip",
        "netns",
        "exec",
        "robot",
        "/rig/plumbline-virtual-cell",
        "--cell",
        "/rig/cockpit-cell.toml",
        "--program",
        "/rig/cockpit-program.toml",
        "--profile",
        "generic",
        "--idle",
        "--time-scale",
        "4",
        "--address",
        "0.0.0.0",
        "--port",
        "502",
        "--tracker-port",
        "503",
        "--period-ms",
        "50",
    ]
    running["robot"] = subprocess.Popen(
        words,
        preexec_fn=another_computer,
        stdin=subprocess.PIPE,
        text=True,
        stdout=open("/run/robot.log", "w"),
        stderr=subprocess.STDOUT,
    )
    tell("robot", "payload 60")


def tell(name, line):
    running[name].stdin.write(line + "\n")
    running[name].stdin.flush()


def camera(plugged=True):
    """The USB camera: video and HID at once."""
    if plugged:
        running["camera"] = subprocess.Popen(
            ["/rig/usb_camera", "/rig/image.grey"],
            preexec_fn=another_computer,
            stdin=subprocess.PIPE,
            text=True,
            stdout=open("/run/camera.log", "w"),
            stderr=subprocess.STDOUT,
        )
    else:
        running.pop("camera").communicate()


def modules():
    sh(
        "modprobe -a dummy_hcd raw_gadget gpio-sim-rig uhid sch_netem; "
        "mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config"
    )


def lines():
    """A GPIO chip with a line that says `the lens moved`."""
    chip = "/sys/kernel/config/gpio-sim/rig"
    os.makedirs(chip + "/bank0/line0")
    for name, value in (
        ("bank0/num_lines", "4"),
        ("bank0/label", "rig-gpio"),
        ("bank0/line0/name", "LENS"),
        ("live", "1"),
    ):
        with open(chip + "/" + name, "w") as file:
            file.write(value)
    running["line"] = "/sys/devices/platform/%s/%s/sim_gpio0/pull" % (
        open(chip + "/dev_name").read().strip(),
        open(chip + "/bank0/chip_name").read().strip(),
    )


def pull(up):
    with open(running["line"], "w") as file:
        file.write("pull-up" if up else "pull-down")


def hardware():
    modules()
    networks()
    lines()
    robot()
    camera()
    sh("udevadm settle", 30)


def configure(zoom, loop=False):
    """The configuration of a cell whose zoom is read that way, with or without probes; the service
    takes it when it starts."""
    serial = sh("ls /dev/plumbline/serial-* 2> /dev/null | head -1", check=False).strip()
    text = (
        open("/rig/plumbline.toml")
        .read()
        .replace("@zoom@", ZOOMS[zoom].replace("@serial@", serial))
        .replace("@loop@", str(loop).lower())
    )
    with open("/etc/plumbline/plumbline.toml", "w") as file:
        file.write(text)
    shutil.copy("/rig/cockpit-cell.toml", "/etc/plumbline/cell.toml")
    shutil.copy("/rig/bodies.toml", "/etc/plumbline/bodies.toml")
    sh("plumbline check /etc/plumbline/plumbline.toml")


def calibrated():
    """The lens store of a cell that was calibrated before."""
    os.makedirs(STATE, mode=0o750, exist_ok=True)
    shutil.copy("/rig/lenses.sqlite", STATE)
    sh("chown -R plumbline: " + STATE)


def stop():
    """The socket too: a PLC that polls would start the service anew at once."""
    sh("systemctl stop plumbline.socket plumbline.service", 60)


def start():
    sh("systemctl start plumbline.socket plumbline.service", 90)


def main_pid():
    return int(sh("systemctl show -P MainPID plumbline.service"))


def started_s():
    """When the service's process was started, on the monotonic clock."""
    return 1e-6 * int(sh("systemctl show -P ExecMainStartTimestampMonotonic plumbline.service"))


def watch():
    unwatch()
    running["watch"] = plc.Watch()
    return running["watch"]


def unwatch():
    if "watch" in running:
        running.pop("watch").end()


def first_valid_s(patience_s):
    """Seconds from the start of the service's process to the first valid point; None: none came"""
    seen = running["watch"]
    if seen.until(plc.valid, patience_s) is None:
        return None
    return seen.first(plc.valid, started_s()) - started_s()


def camera_is(*states, patience_s=20):
    """@return seconds until the camera's register says one of these states; None: it did not"""
    began = time.monotonic()
    at = running["watch"].until(lambda answered, valid, camera: camera in states, patience_s)
    return None if at is None else at - began


FRESH_ms = 700  # at two images a second


def heard(camera, zoom, patience_s=20):
    """@return seconds until the camera's images and the zoom sensor's answers come, by their ages in
    the map, where each is wanted; None: not within the patience"""
    began = time.monotonic()
    client = plc.Client(timeout_s=5)
    try:
        while time.monotonic() < began + patience_s:
            ages = client.read(505, 8)
            if not (camera and ages[0] > FRESH_ms) and not (zoom and ages[7] > FRESH_ms):
                return time.monotonic() - began
            time.sleep(0.02)
    finally:
        client.close()
    return None


def journal(lines=40):
    return sh(
        "journalctl -u plumbline.service -o short-monotonic --no-hostname -n %d --no-pager" % lines
    )


def usage():
    """(descriptors, resident KiB, seconds of processor time) of the daemon."""
    pid = main_pid()
    stat = open("/proc/%d/stat" % pid).read().rsplit(")", 1)[1].split()
    resident = int(open("/proc/%d/statm" % pid).read().split()[1]) * 4
    return (
        len(os.listdir("/proc/%d/fd" % pid)),
        resident,
        (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK"),
    )


def file(path):
    import base64

    return base64.b64encode(open(path, "rb").read()).decode()


def three_models():
    """The cell three times, as versions that differ in nothing that matters here."""
    for number in (2, 3):
        text = (
            open("/etc/plumbline/cell.toml")
            .read()
            .replace(
                "compliance_rad_per_Nm = 3.0e-7", "compliance_rad_per_Nm = 3.00000%de-7" % number
            )
        )
        with open("/run/cell-%d.toml" % number, "w") as out:
            out.write(text)
        sh("plumbline model propose /run/cell-%d.toml" % number)


def keep_applying():
    """One version after another is put in force; the console is told of each when it is."""
    subprocess.Popen(
        [
            "/bin/sh",
            "-c",
            "while :; do for n in 2 3 1; do plumbline model apply $n > /dev/null 2>&1"
            " && echo applied $n > /dev/ttyS0; done; done",
        ]
    )


def after_a_cut():
    """(whole, the list of models, version in force, seconds to the first valid point or None)"""
    took = first_valid_s(60)
    listed = sh("plumbline model list")
    version = [line.split()[0] for line in listed.split("\n") if "APPLIED" in line]
    whole = (
        sh(
            """python3 - <<'P'
import glob, sqlite3
print(all(sqlite3.connect("file:%s?mode=ro" % f, uri=True).execute("pragma integrity_check").fetchone()[0] == "ok"
          for f in glob.glob("/var/lib/plumbline/*.sqlite")))
P"""
        ).strip()
        == "True"
    )
    return whole and len(version) == 1, listed, int(version[0]) if version else None, took
