"""tests/bench/run and tests/contained: a program that fails, hangs, or whose runner is killed leaves nothing
behind; malformed rows are faults; a missed goal is visible."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid

ROOT = os.getcwd()
MARK = "PLUMBLINE_RUN_TEST=" + uuid.uuid4().hex
GOOD = '{"what": "w", "ours": 3, "unit": "", "of": "ours", "sense": "<=", "bound": 0, "peer": "", "peers": null, "timed": false}'
# A daemon with a session of its own, as a benchmark would leave it.
LEAVES = "setsid sleep 1000 & echo '%s' >> $PLUMBLINE_BENCH_ROWS; " % GOOD
faults = []


def left():
    """Processes with the mark in their environment, apart from this one."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            if entry.isdigit() and MARK.encode() in open("/proc/%s/environ" % entry, "rb").read():
                found.append(entry)
        except OSError:
            pass
    return found


def gone():
    for _ in range(500):
        if not left():
            return True
        time.sleep(0.02)
    return False


def check(what, holds):
    if not holds:
        faults.append(what)


def environment():
    name, value = MARK.split("=")
    return dict(os.environ, **{name: value})


with tempfile.TemporaryDirectory() as folder:
    def program(text):
        path = os.path.join(folder, "stub_bench")
        open(path, "w").write("#!/bin/sh\n" + text)
        os.chmod(path, 0o755)
        open(folder + "/programs", "w").write(path + "\n")

    def run(text):
        program(text)
        done = subprocess.run(["tests/bench/run", "--quick", "--programs", folder + "/programs"], env=environment(),
                              capture_output=True, text=True, timeout=60)
        return done.returncode, done.stdout + done.stderr

    code, text = run("echo '%s' >> $PLUMBLINE_BENCH_ROWS" % GOOD)
    check("a good program fails: " + text, code == 0)
    check("a missed goal is not shown: " + text, "**missed**" in text and "1 missed" in text)
    for name, script in (("fails", LEAVES + "exit 3"), ("kills itself", LEAVES + "kill -9 $$"),
                         ("forgets its daemon", LEAVES + "exit 0")):
        code, text = run(script)
        check("a program that %s is not reported: %s" % (name, text), code == 1 and "FAILED: stub_bench" in text)
        check("a program that %s leaves a process behind" % name, gone())
    for name, line in (("no row", ""), ("not JSON", "nonsense"), ("no finite value", GOOD.replace("3", "null", 1)),
                       ("ratio without a peer", GOOD.replace('"of": "ours"', '"of": "ratio"'))):
        code, text = run("echo '%s' >> $PLUMBLINE_BENCH_ROWS" % line if line else "true")
        check("rows with the fault \"%s\" pass: %s" % (name, text), code == 1)

    program(LEAVES + "sleep 1000")
    done = subprocess.run(["tests/contained", "--limit", "0.5", folder + "/stub_bench"],
                          env=dict(environment(), PLUMBLINE_BENCH_ROWS="/dev/null"), timeout=60, capture_output=True)
    check("a program that hangs is not stopped", done.returncode == 124 and gone())
    for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGINT):
        started = subprocess.Popen(["tests/contained", folder + "/stub_bench"],
                                   env=dict(environment(), PLUMBLINE_BENCH_ROWS="/dev/null"), start_new_session=True)
        give_up = time.monotonic() + 20
        while len(left()) < 5 and time.monotonic() < give_up:  # the two of contained, sh, two of sleep
            time.sleep(0.02)
        started.send_signal(number)
        started.wait(60)
        check("%s of the runner leaves a process behind" % number.name, gone())
for pid in left():
    os.kill(int(pid), signal.SIGKILL)
print("\n".join(faults) or "nothing is left behind")
sys.exit(1 if faults else 0)
