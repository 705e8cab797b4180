"""The parts of a plant for the tests: a broker, the bridge, and cells that publish as plumbline-fleet does."""

import json
import os
import signal
import socket
import subprocess
import tempfile
import time

from mqtt import Client, soon


def now_ms():
    return int(time.time() * 1000)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def answers(port):
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1).close()
        return True
    except OSError:
        return False


def mosquitto():
    return next((path for path in ("/usr/sbin/mosquitto", "/usr/bin/mosquitto") if os.access(path, os.X_OK)), None)


class Broker:
    def __init__(self, more=""):
        """@param more  lines of another listener"""
        self.folder, self.port = tempfile.TemporaryDirectory(), free_port()
        with open(self.folder.name + "/conf", "w") as conf:
            conf.write("per_listener_settings true\nlistener %d 127.0.0.1\nuser root\nallow_anonymous true\npersistence true\n"
                       "persistence_location %s/\nmax_queued_messages 0\n%s" % (self.port, self.folder.name, more))
        self.start()

    def start(self):
        log = open(self.folder.name + "/log", "a")
        self.process = subprocess.Popen([mosquitto(), "-c", self.folder.name + "/conf"], stdout=log, stderr=log)
        assert soon(lambda: answers(self.port)), "mosquitto does not start"

    def kill(self, number=signal.SIGKILL):
        self.process.send_signal(number)
        self.process.wait()

    def close(self):
        self.kill(signal.SIGTERM)
        self.folder.cleanup()


class Bridge:
    def __init__(self, program, broker_port, hosts_port=None, more="", whole=False):
        self.program, self.folder = program, tempfile.TemporaryDirectory()
        with open(self.folder.name + "/plant.toml", "w") as config:
            if not whole:
                config.write('[broker]\nhost = "127.0.0.1"\nport = %d\n[sparkplug]\n' % broker_port)
            config.write(more + "\n")
            if hosts_port:
                config.write('[sparkplug.broker]\nhost = "127.0.0.1"\nport = %d\n' % hosts_port)
        self.start()

    def start(self):
        log = open(self.folder.name + "/log", "a")
        self.process = subprocess.Popen([self.program, self.folder.name + "/plant.toml"], stdout=log, stderr=log,
                                        env={**os.environ, "STATE_DIRECTORY": self.folder.name})

    def log(self):
        return open(self.folder.name + "/log").read()

    def kill(self, number=signal.SIGKILL):
        self.process.send_signal(number)
        return self.process.wait(timeout=20)

    def close(self):
        if self.process.poll() is None:
            self.kill(signal.SIGTERM)
        self.folder.cleanup()


class Cell:
    """What plumbline-fleet publishes, in its order and form."""

    def __init__(self, port, node, group="plumbline", points=2, joints=6):
        self.port, self.node, self.group, self.points, self.joints = port, node, group, points, joints
        self.stream, self.seq, self.bdSeq, self.client, self.queue = "3f8a01c2", 0, 0, None, []

    def topic(self, kind):
        return "plumblineV1/%s/%s/%s" % (self.group, kind, self.node)

    def connect(self):
        self.bdSeq = max(now_ms(), self.bdSeq + 1)
        dead = {"timestamp": self.bdSeq, "bdSeq": self.bdSeq, "clean_shutdown": False}
        self.client = Client(self.port, "fleet-" + self.node, will=(self.topic("NDEATH"), json.dumps(dead), 1, True))
        birth = {"timestamp": now_ms(), "bdSeq": self.bdSeq, "schema": 1, "version": "0.1.0", "cell": "arm", "joints": self.joints,
                 "points": [{"id": k + 1, "name": "P%d" % (k + 1)} for k in range(self.points)], "stream": self.stream,
                 "waiting": len(self.queue), "dropped": {"states": 0, "changes": 0, "others": 0}}
        self.client.publish(self.topic("NBIRTH"), json.dumps(birth), 1, True)
        for kind, body in self.queue:
            self.client.publish(self.topic(kind), json.dumps(body))
        self.queue = []

    def number(self, kind, body, timestamp=None):
        self.seq += 1
        return kind, {"stream": self.stream, "seq": self.seq, "timestamp": timestamp or now_ms(), **body}

    def say(self, kind, body, timestamp=None, wait=True):
        kind, body = self.number(kind, body, timestamp)
        if self.client is None:
            self.queue.append((kind, body))
        else:
            self.client.publish(self.topic(kind), json.dumps(body), wait=wait)

    def state(self, wait=True, **changes):
        body = {"status": 3, "alarms": 0, "warnings": 0, "health": 0, "health_reason": "ok", "model": 4, "data_age_ms": 12,
                "q": [10.5] * self.joints, "payload_kg": 60.5, "temp_C": None, "points": self.points, "points_valid": self.points,
                "monitoring": 1, "loop": 1, "probes": 7, "drift_statistic": -0.25, "proposed_model": 0,
                "cameras": [{"camera": "left", "lens": "valid", "reason": "none", "lens_id": 3}]}
        self.say("NDATA", {**body, **changes}, wait=wait)

    def point(self, number, x, **changes):
        body = {"point": number, "name": "P%d" % number, "valid": True, "extrapolated": False, "code": 0, "reason": "ok",
                "correction_mm": [x, -0.5, 0], "correction_size_mm": abs(x), "command_mm": [1, 2, 3], "uncertainty_mm": 0.1,
                "basis": "measured", "model": 4}
        self.say("NPOINT", {**body, **changes})

    def probe(self, number, residual, timestamp=None, wait=True):
        self.say("NPROBE", {"journal": 1790000000, "id": number, "source": "plc", "session": "1", "model": 4,
                            "measured_mm": [1, 2, 3 + residual], "predicted_mm": [1, 2, 3], "residual_mm": [0, 0, residual],
                            "residual_size_mm": residual, "payload_kg": None, "temp_C": 21.5, "wild": False, "alarm": False,
                            "quarantined": False}, timestamp, wait)

    def alarm(self, begins, meaning="robot input stale", word="alarms", timestamp=None):
        self.say("NALARM", {"word": word, "bit": 1, "event": "begin" if begins else "end", "meaning": meaning}, timestamp)

    def stop(self, clean=True):
        """As plumbline-fleet at SIGTERM; or the connection breaks."""
        if clean:
            dead = {"timestamp": now_ms(), "bdSeq": self.bdSeq, "clean_shutdown": True}
            self.client.publish(self.topic("NDEATH"), json.dumps(dead), 1, True)
            self.client.disconnect()
        else:
            self.client.drop()
        self.client = None
