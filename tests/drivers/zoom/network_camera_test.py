"""VISCA in the network, over real sockets: whatever happens to the answers, a reading is what the
camera answered to that inquiry, or a fault with its reason.

network_camera_test.py ZOOM_READER [SEED]"""
import concurrent.futures
import subprocess
import sys
import threading
import time

from network_camera import NetworkCamera, STEP_S, zoom_at

READER = sys.argv[1]
SEED = int(sys.argv[2]) if len(sys.argv) > 2 else 1
TIMEOUT_MS = 150  # an answer takes under a millisecond; the machine may be busy
SILENT = f"no answer within {TIMEOUT_MS} ms"
FAILED = []


class Reader:
    """Reads in its own process; `rows` are (before_s, after_s, result, zoom, problem)."""

    def __init__(self, device, transport="", reads=100, timeout_ms=TIMEOUT_MS):
        self.process = subprocess.Popen([READER, device, transport, str(timeout_ms), str(reads)], text=True,
                                        stdout=subprocess.PIPE)

    def finish(self):
        text = self.process.communicate(timeout=60)[0]
        rows = [line.split("\t") for line in text.splitlines()]
        return [(float(a), float(b), result, int(zoom), problem) for a, b, result, zoom, problem in rows]


def wrong(rows):
    """Readings that are not what the camera had during the call."""
    found = []
    for before_s, after_s, result, zoom, _ in rows:
        steps = range(int(before_s / STEP_S), int(after_s / STEP_S) + 1)
        if result == "ok" and zoom not in [step % 0x4000 for step in steps]:
            found.append((before_s, zoom, zoom_at(before_s)))
    return found


def judge(name, rows, share=None, words=None, longest_ms=TIMEOUT_MS + 150):
    """@param share  least share of readings that succeed
    @param words  in the problem of a reading that fails"""
    good = sum(row[2] == "ok" for row in rows) / max(1, len(rows))
    texts = {row[4] for row in rows if row[4]}
    longest = max((1e3 * (row[1] - row[0]) for row in rows), default=0)
    faults = []
    bad = wrong(rows)
    if bad:
        faults.append(f"wrong readings {bad[:3]}")
    if share is not None and good < share:
        faults.append(f"only {good:.2f} of the readings succeed: {sorted(texts)[:3]}")
    if words is not None and not any(words in text for text in texts):
        faults.append(f"no problem has \"{words}\": {sorted(texts)[:3]}")
    if longest > longest_ms:
        faults.append(f"a call took {longest:.0f} ms")
    print(f"{'FAILED' if faults else 'ok    '} {name}: {good:.2f} of {len(rows)} succeed, {len(bad)} wrong, "
          f"longest {longest:.0f} ms" + "".join("\n    " + fault for fault in faults))
    if faults:
        FAILED.append(name)


def case(name, transport="", share=None, words=None, reads=60, during=None, host="127.0.0.1", **faults):
    """@param during  called with the camera while it is read"""
    camera = NetworkCamera(host, seed=SEED, **faults)
    place = f"[{host}]:{camera.port}" if ":" in host else f"{host}:{camera.port}"
    reader = Reader(place, transport, reads)
    if during:
        thread = threading.Thread(target=during, args=(camera,))
        thread.start()
        thread.join()
    rows = reader.finish()
    camera.close()
    judge(name, rows, share, words)
    return camera


def reboot(camera):
    time.sleep(0.4)
    camera.reboot(0.4)


def another_controller(camera):
    for _ in range(10):
        time.sleep(0.1)
        camera.last = 0xFFFFFFFF if camera.random.random() < 0.5 else 0


def counted(name, count, **faults):
    """@param count  of the camera, 1 at the end"""
    camera = case(name, **faults)
    if getattr(camera, count) != 1:
        FAILED.append(f"{name}: {getattr(camera, count)} {count} instead of 1")


def absent(name, transport, words):
    """Nobody listens; then somebody does."""
    camera = NetworkCamera()
    port = camera.port
    camera.close()
    reader = Reader(f"127.0.0.1:{port}", transport, 200)
    time.sleep(0.7)
    camera = NetworkCamera(port=port)
    rows = reader.finish()
    camera.close()
    judge(name, rows, 0.1, words)
    if rows[-1][2] != "ok":
        FAILED.append(f"{name}: not found when it came")


def unknown(name):
    judge(name, Reader("no-such-camera.invalid", "udp", 20).finish(), words="address")


CASES = [
    (counted, dict(name="UDP", count="resets", share=1)),
    (case, dict(name="UDP, IPv6", share=1, host="::1")),
    (case, dict(name="UDP, no lens block", share=1, has_block=False)),
    (case, dict(name="UDP, losses", share=0.4, loss=0.2)),
    (case, dict(name="UDP, duplicates", share=1, twice=1)),
    (case, dict(name="UDP, late, reordered and duplicated", share=0.2, late=0.4, twice=0.3, late_s=0.2)),
    (case, dict(name="UDP, all late", words="Increase timeout_ms", late=1, late_s=0.35, reads=20)),
    (case, dict(name="UDP, junk between", share=1, junk=0.9)),
    (case, dict(name="UDP, everything", share=0.1, loss=0.1, twice=0.2, late=0.3, junk=0.3, late_s=0.25,
                during=reboot, reads=100)),
    (case, dict(name="UDP, restarted", share=0.3, words=SILENT, during=reboot, reads=100)),
    (case, dict(name="UDP, another controller", share=0.9, during=another_controller, reads=150)),
    (case, dict(name="UDP, the reset is not answered", share=0.9, answers_reset=False)),
    (case, dict(name="UDP, numbers are not checked", share=1, checks=False, answers_reset=False)),
    (case, dict(name="UDP, always the same number", words="does not count", sequence=1, reads=20)),
    (case, dict(name="UDP, no header", words='Set transport = "tcp"', header=False, reads=20)),
    (case, dict(name="UDP, switched off", words=SILENT, off=True, reads=10)),
    (counted, dict(name="TCP", count="connections", transport="tcp", share=1)),
    (case, dict(name="TCP, IPv6", transport="tcp", share=1, host="::1")),
    (case, dict(name="TCP, no lens block", transport="tcp", share=1, has_block=False)),
    (case, dict(name="TCP, split and interleaved", transport="tcp", share=0.9, split=0.5, interleave=0.5)),
    (case, dict(name="TCP, late", transport="tcp", share=0.1, late=0.2, late_s=0.25)),
    (case, dict(name="TCP, lost", transport="tcp", share=0.1, words=SILENT, loss=0.1)),
    (case, dict(name="TCP, hung up", transport="tcp", share=0.1, words="closed the connection", hang_up=0.1)),
    (absent, dict(name="UDP, absent, then there", transport="udp", words="refuses UDP port")),
    (absent, dict(name="TCP, absent, then there", transport="tcp", words="refuses TCP port")),
    (unknown, dict(name="unknown name")),
]
with concurrent.futures.ThreadPoolExecutor(6) as pool:
    for done in [pool.submit(run, **values) for run, values in CASES]:
        done.result()
if FAILED:
    sys.exit("failed: " + ", ".join(FAILED))
