"""The PLC: polls the daemon from its own network namespace and remembers what changed, and when."""
import ctypes
import math
import os
import socket
import struct
import threading
import time

DAEMON = ("10.77.2.1", 502)


def enter_namespace(name):
    """This thread alone."""
    libc = ctypes.CDLL(None, use_errno=True)
    handle = os.open("/run/netns/" + name, os.O_RDONLY)
    if libc.setns(handle, 0x40000000) != 0:
        raise OSError(ctypes.get_errno(), "setns " + name)
    os.close(handle)


class Client:
    """Modbus TCP, one request at a time."""

    def __init__(self, address=DAEMON, timeout_s=1.0):
        self.socket = socket.create_connection(address, timeout_s)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.number = 0

    def ask(self, pdu):
        self.number = (self.number + 1) % 65536
        self.socket.sendall(struct.pack(">HHHB", self.number, 0, len(pdu) + 1, 1) + pdu)
        head = self.exactly(7)
        number, protocol, length, _ = struct.unpack(">HHHB", head)
        answer = self.exactly(length - 1)
        if number != self.number or protocol != 0 or answer[0] != pdu[0]:
            raise ValueError("an answer that fits no question: %s" % (head + answer).hex())
        return answer

    def exactly(self, size):
        data = b""
        while len(data) < size:
            more = self.socket.recv(size - len(data))
            if not more:
                raise ConnectionError("closed")
            data += more
        return data

    def read(self, first, count):
        answer = self.ask(struct.pack(">BHH", 3, first, count))
        return struct.unpack(">%dH" % count, answer[2:])

    def write(self, first, words):
        self.ask(
            struct.pack(">BHHB%dH" % len(words), 16, first, len(words), 2 * len(words), *words)
        )

    def close(self):
        self.socket.close()


def float_at(words, at):
    return struct.unpack(">f", struct.pack(">HH", *words[at : at + 2]))[0]


class Watch(threading.Thread):
    """Polls the first point and the camera's state until told to end. `changes` holds
    (seconds, answered, valid, camera state); `corrupt` what no PLC may ever be told: a valid point
    that is not where it was."""

    def __init__(self, period_s=0.04, timeout_s=1.0):
        super().__init__(daemon=True)
        self.period_s, self.timeout_s = period_s, timeout_s
        self.changes, self.corrupt, self.slowest_s, self.polls = [], [], 0.0, 0
        self.reference = None
        self.ending = False
        self.good_s = []  # of answered polls with a valid point, the newest
        self.connections = 0  # that it had to open
        self.start()

    address = DAEMON

    def enter(self):
        enter_namespace("plc")

    def run(self):
        self.enter()
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), -10)  # a computer of its own
        client = None
        while not self.ending:
            began = time.monotonic()
            try:
                if client is None:
                    client = Client(self.address, self.timeout_s)
                    self.connections += 1
                point = client.read(2000, 20)
                camera = client.read(500, 1)[0]
                valid = bool(point[1] & 1)
                self.polls += 1
                self.slowest_s = max(self.slowest_s, time.monotonic() - began)
                if valid:
                    self.judge(point)
                    self.good_s = [time.monotonic()]
                self.note(True, valid, camera)
            except (OSError, ValueError) as error:
                if isinstance(error, ValueError):
                    self.corrupt.append(str(error))
                if client:
                    client.close()
                client = None
                self.note(False, False, None)
            time.sleep(max(0.0, began + self.period_s - time.monotonic()))
        if client:
            client.close()

    def note(self, answered, valid, camera):
        if not self.changes or self.changes[-1][1:] != (answered, valid, camera):
            self.changes.append((time.monotonic(), answered, valid, camera))

    def judge(self, point):
        pose = [float_at(point, at) for at in (3, 5, 7)]
        if self.reference is None and all(map(math.isfinite, pose)):
            self.reference = pose
        if not all(abs(a - b) < 0.5 for a, b in zip(pose, self.reference or pose)):
            self.corrupt.append("point at %s, was at %s" % (pose, self.reference))

    def end(self):
        self.ending = True
        self.join()

    def now(self):
        return self.changes[-1][1:] if self.changes else (False, False, None)

    def first(self, wanted, since_s):
        """@return when `wanted` was first true at or after this time"""
        return next(c[0] for c in self.changes if c[0] >= since_s and wanted(*c[1:]))

    def until(self, wanted, patience_s):
        """@return when `wanted`(answered, valid, camera) came true; None: not within the patience"""
        end = time.monotonic() + patience_s
        seen = max(0, len(self.changes) - 1)
        while time.monotonic() < end:
            for change in self.changes[seen:]:
                if wanted(*change[1:]):
                    return max(change[0], end - patience_s)
            seen = max(0, len(self.changes) - 1)
            time.sleep(0.005)
        return None


def valid(answered, is_valid, camera):
    return answered and is_valid


def withdrawn(answered, is_valid, camera):
    return answered and not is_valid
