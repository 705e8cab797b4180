"""Processor time and memory of plumbline-sparkplug with many cells, beside mosquitto_sub, which prints the same messages.

    load.py PLUMBLINE_SPARKPLUG [CELLS] [SECONDS]"""

import os
import subprocess
import sys
import time

from host import Host
from mqtt import soon
from plant import Bridge, Broker, Cell, mosquitto

count, seconds = (int(word) for word in (sys.argv[2:] + ["300", "10"][len(sys.argv) - 2 :])[:2])
if not mosquitto():
    print("SKIPPED: no mosquitto here")
    sys.exit(77)


def processor_s(pid):
    fields = open("/proc/%d/stat" % pid).read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_MB(pid):
    return next(int(line.split()[1]) / 1000 for line in open("/proc/%d/status" % pid) if line.startswith("VmRSS"))


broker = Broker()
host = Host(broker.port)
cells = [Cell(broker.port, "cell-%d" % k, points=4) for k in range(count)]
for cell in cells:
    cell.connect()
peer = subprocess.Popen(["mosquitto_sub", "-p", str(broker.port), "-t", "plumblineV1/#", "-q", "1"], stdout=subprocess.DEVNULL)
bridge = Bridge(sys.argv[1], broker.port)
nodes = [host.node(("plumbline", cell.node)) for cell in cells]
assert soon(lambda: all(node.births for node in nodes), 120), bridge.log()
for cell in cells:
    cell.state()
time.sleep(2)  # births of the cameras
pids = (bridge.process.pid, peer.pid)
before, data, start = [processor_s(pid) for pid in pids], sum(node.data for node in nodes), time.monotonic()
for turn in range(seconds):
    for cell in cells:
        cell.probe(turn, 0.5, wait=False)
        cell.state(wait=False, temp_C=20 + turn % 50)
    time.sleep(max(0, start + turn + 1 - time.monotonic()))
published = soon(lambda: sum(node.data for node in nodes) - data >= 2 * count * seconds, 60)
elapsed = time.monotonic() - start
used = [processor_s(pid) - one for pid, one in zip(pids, before)]
print("%d cells, %d messages in %.1f s: %d NDATA" % (count, 2 * count * seconds, elapsed, sum(node.data for node in nodes) - data))
print("plumbline-sparkplug %.1f %% of a processor, %.0f MB; mosquitto_sub %.1f %%; ratio %.1f" % (
    100 * used[0] / elapsed, resident_MB(pids[0]), 100 * used[1] / elapsed, used[0] / max(used[1], 0.01)))
for fault in host.faults[:10]:
    print("the specification forbids:", fault)
peer.kill()
peer.wait()
bridge.close()
broker.close()
sys.exit(0 if published and not host.faults else 1)
