"""Simulated controllers with a Modbus server, each with its own way of holding the joints; shares no
code with the product. Every kind is a function from a random generator to a Device."""

import math
import socketserver
import struct
import threading
import time
import tomllib

import numpy as np


# ---- The arm

class Arm:
    def __init__(self, path):
        with open(path, "rb") as file:
            robot = tomllib.load(file)["robot"]
        self.path, self.rows, self.modified = path, robot["joint"], robot["convention"] == "mdh"
        self.lower = np.array([row.get("min_deg", -180.0) for row in self.rows])
        self.upper = np.array([row.get("max_deg", 180.0) for row in self.rows])

    def flange(self, q_deg, errors=None):
        """4 x 4 pose of the flange in the base, in metres; errors: of a, d [mm] and theta [deg] of each row."""
        pose = np.eye(4)
        for row, q, (da, dd, turn) in zip(self.rows, q_deg, np.zeros((len(self.rows), 3)) if errors is None else errors):
            theta = math.radians(row.get("sign", 1) * q + row.get("theta_offset_deg", 0.0) + turn)
            a, d, alpha = (row["a_mm"] + da) / 1e3, (row["d_mm"] + dd) / 1e3, math.radians(row["alpha_deg"])
            c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
            if self.modified:
                step = [[c, -s, 0, a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], [0, 0, 0, 1]]
            else:
                step = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
            pose = pose @ np.array(step)
        return pose

    def turns_beyond(self):
        """Joints that go clearly beyond half a turn."""
        return np.flatnonzero(self.upper > 215)

    def posture(self, rng, negative=False, beyond=False):
        """A random posture, as a working robot has it: no joint near its limit.
        beyond: one joint is beyond half a turn, if the arm goes there."""
        reach = np.minimum(np.minimum(-self.lower, self.upper), 175.0)
        q = rng.uniform(-0.9, 0.9, len(self.rows)) * np.maximum(reach, 30.0)
        q = np.clip(q, self.lower + 12, self.upper - 12)
        if negative and not (q < -15).any():
            joint = int(np.argmin(self.lower))
            q[joint] = max(-25.0, self.lower[joint] + 12)
        if beyond and len(self.turns_beyond()):
            joint = int(rng.choice(self.turns_beyond()))
            q[joint] = rng.uniform(190, min(self.upper[joint] - 12, 345))
            if negative and not (q < -15).any():
                q[(joint + 1) % len(q)] = max(-25.0, self.lower[(joint + 1) % len(q)] + 12)
        return q


def angles_of(rotation, convention):
    """The three angles [rad] of a rotation matrix."""
    r = rotation
    if convention == "rotation_vector":
        angle = math.acos(max(-1.0, min(1.0, (np.trace(r) - 1) / 2)))
        if angle < 1e-9:
            return np.zeros(3)
        if angle > math.pi - 1e-6:
            axis = np.sqrt(np.maximum(0, (np.diag(r) + 1) / 2))
            axis[1] *= math.copysign(1, r[0, 1]) if axis[0] > 1e-6 else 1
            axis[2] *= math.copysign(1, r[0, 2]) if axis[0] > 1e-6 else math.copysign(1, r[1, 2])
            return angle * axis
        return angle / (2 * math.sin(angle)) * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    if convention == "zyz":
        b = math.acos(max(-1.0, min(1.0, r[2, 2])))
        return np.array([math.atan2(r[1, 2], r[0, 2]), b, math.atan2(r[2, 1], -r[2, 0])])
    pitch = math.asin(max(-1.0, min(1.0, -r[2, 0])))
    rpy = np.array([math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])])
    return rpy if convention == "roll_pitch_yaw" else rpy[::-1]


# ---- Words

ORDERS = ["ABCD", "CDAB", "BADC", "DCBA"]


def words_of(value, kind, order="ABCD"):
    """Registers of a number; integers are rounded."""
    if kind in ("int16", "uint16"):
        return [int(round(value)) & 0xFFFF]
    raw = struct.pack(">f", value) if kind == "float32" else struct.pack(">I", int(round(value)) & 0xFFFFFFFF)
    if kind == "float64":
        raw = struct.pack(">d", value)
    places = {"ABCD": [0, 1, 2, 3], "CDAB": [2, 3, 0, 1], "BADC": [1, 0, 3, 2], "DCBA": [3, 2, 1, 0]}[order]
    mixed = bytes(raw[k] for k in places)
    return list(struct.unpack(">HH", mixed))


def number_of(words, kind, order="ABCD"):
    """The inverse of words_of."""
    if kind == "int16":
        return struct.unpack(">h", struct.pack(">H", words[0]))[0]
    if kind == "uint16":
        return words[0]
    raw = struct.pack(">HH", *words[:2])
    places = {"ABCD": [0, 1, 2, 3], "CDAB": [2, 3, 0, 1], "BADC": [1, 0, 3, 2], "DCBA": [3, 2, 1, 0]}[order]
    straight = bytearray(4)
    for at, place in enumerate(places):
        straight[place] = raw[at]
    return struct.unpack({"float32": ">f", "int32": ">i", "uint32": ">I"}[kind], bytes(straight))[0]


# ---- The device

class Device:
    """A controller. Joints in degrees; `fields` are functions of the state that fill registers."""

    def __init__(self, arm, rng):
        self.arm, self.rng = arm, rng
        self.beyond = rng.random() < 0.25  # one joint beyond half a turn, where the arm goes there
        self.q = self.posture()
        self.speed_deg_s = np.zeros(len(self.q))  # moving: a swing of each joint about q
        self.fields = []          # function(q_deg, qd_deg_s) -> {address: word}
        self.static = {}
        self.ranges = [(0, 1023)]  # readable registers
        self.holes = set()
        self.functions, self.units, self.max_count = [3], None, 125
        self.delay_s, self.closes, self.framing, self.bad_transaction = 0.0, False, "tcp", False
        self.pairs_from = None    # first register of an area that is only read in whole pairs
        self.expected = None      # words of a note that must appear instead of a profile
        self.may_stay_open = False   # at standstill nothing separates the two places
        self.must_stay_open = False  # a profile would be wrong somewhere
        self.tool, self.base, self.errors = np.eye(4), np.eye(4), None
        self.noise_deg = 0.0
        self.start_s, self.lock = time.monotonic(), threading.Lock()
        self.requests = 0
        self.one_turn = False     # joints beyond +-180 degrees cannot be told

    def posture(self, negative=False):
        return self.arm.posture(self.rng, negative, self.beyond)

    def now(self):
        t = time.monotonic() - self.start_s
        phase = 0.8 * t
        return self.q + self.speed_deg_s / 0.8 * np.sin(phase), self.speed_deg_s * np.cos(phase)

    def registers(self, q, qd):
        words = dict(self.static)
        for field in self.fields:
            words.update(field(q, qd))
        return words

    def answer(self, unit, pdu):
        """A response PDU, or None for silence."""
        self.requests += 1
        function = pdu[0]
        if self.units is not None and unit not in self.units:
            return bytes([function | 0x80, 0x0B])
        if function not in self.functions:
            return bytes([function | 0x80, 1])
        first, count = struct.unpack(">HH", pdu[1:5])
        if count < 1 or count > self.max_count:
            return bytes([function | 0x80, 3])
        if not self.readable(first, count):
            return bytes([function | 0x80, 2])
        with self.lock:
            q, qd = self.now()
        if self.noise_deg:
            q = q + self.rng.normal(0, self.noise_deg, len(q))
        words = self.registers(q, qd)
        return bytes([function, 2 * count]) + b"".join(struct.pack(">H", words.get(a, 0)) for a in range(first, first + count))

    def readable(self, first, count):
        inside = any(low <= first and first + count - 1 <= high for low, high in self.ranges)
        if not inside or any(a in self.holes for a in range(first, first + count)):
            return False
        if self.pairs_from is None:
            return True
        return (first - self.pairs_from) % 2 == 0 and count % 2 == 0


class Handler(socketserver.BaseRequestHandler):
    def take(self, count):
        taken = b""
        while len(taken) < count:
            more = self.request.recv(count - len(taken))
            if not more:
                raise ConnectionError
            taken += more
        return taken

    def handle(self):
        device = self.server.device
        try:
            while True:
                if device.framing == "rtu":
                    frame = self.take(8)
                    if crc(frame[:6]) != frame[6:]:
                        continue
                    answer = bytes([frame[0]]) + device.answer(frame[0], frame[1:6])
                    self.request.sendall(answer + crc(answer))
                    continue
                head = self.take(7)
                transaction, _, size, unit = struct.unpack(">HHHB", head)
                pdu = self.take(size - 1)
                if device.delay_s:
                    time.sleep(device.delay_s)
                answer = device.answer(unit, pdu)
                self.request.sendall(struct.pack(">HHHB", 0 if device.bad_transaction else transaction, 0, len(answer) + 1, unit) + answer)
                if device.closes:
                    return
        except (ConnectionError, OSError):
            pass


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1
    return struct.pack("<H", value)


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address, daemon_threads = True, True

    def __init__(self, device):
        super().__init__(("127.0.0.1", 0), Handler)
        self.device = device
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def port(self):
        return self.server_address[1]


# ---- Fields

COUNTS = {  # degrees to counts
    "deg": 1.0, "rad": math.pi / 180, "mrad": math.pi / 180 * 1e3, "0.1 deg": 10.0, "0.01 deg": 100.0,
    "0.001 deg": 1000.0, "0.1 mrad": math.pi / 180 * 1e4, "urad": math.pi / 180 * 1e6, "0.0001 deg": 1e4}


def joints(addresses, kind, unit, order="ABCD"):
    def fill(q, qd):
        words = {}
        for address, value in zip(addresses, q):
            for k, word in enumerate(words_of(value * COUNTS[unit], kind, order)):
                words[address + k] = word
        return words
    return fill


def pose_field(device, first, kind, stride, order, length, angle, convention):
    """length: counts per metre; angle: counts per radian."""
    def fill(q, qd):
        pose = device.base @ device.arm.flange(q, device.errors) @ device.tool
        numbers = list(pose[:3, 3] * length) + list(angles_of(pose[:3, :3], convention) * angle)
        words = {}
        for j, value in enumerate(numbers):
            for k, word in enumerate(words_of(value, kind, order)):
                words[first + j * stride + k] = word
        return words
    return fill


def numbers(first, kind, stride, order, values):
    """Other values, one function of (q, qd) each."""
    def fill(q, qd):
        words = {}
        for j, value in enumerate(values):
            for k, word in enumerate(words_of(value(q, qd), kind, order)):
                words[first + j * stride + k] = word
        return words
    return fill


def pick(rng, things):
    return things[int(rng.integers(len(things)))]


def spread(first, count, stride):
    return [first + stride * k for k in range(count)]


FORMS = [("float32", "deg"), ("float32", "rad"), ("int32", "0.001 deg"), ("int32", "urad"), ("int16", "0.1 deg"),
         ("int16", "0.01 deg"), ("int32", "0.0001 deg"), ("int16", "mrad")]


def width(kind):
    return 1 if kind in ("int16", "uint16") else 2


def add_pose(device, first, kind, order, rng):
    """The pose of the flange; at times of a tool or in a frame that the cell does not declare, at times of
    an arm that differs from the nominal one as real arms do."""
    chance = rng.random()
    if chance < 0.2:
        device.tool = np.eye(4)
        device.tool[:3, 3] = rng.uniform(-0.15, 0.15, 3)
    elif chance < 0.3:
        device.base = np.eye(4)
        device.base[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    elif chance < 0.6:
        device.errors = rng.normal(0, 1, (len(device.q), 3)) * [0.4, 0.4, 0.03]
    if kind == "float32":
        length, angle = pick(rng, [(1e3, 180 / math.pi), (1.0, 1.0), (1e3, 1.0)])
    elif kind == "int32":
        length, angle = pick(rng, [(1e6, 1.8e5 / math.pi), (1e5, 1.8e4 / math.pi), (1e6, 1e6)])
    else:
        length, angle = pick(rng, [(1e4, 1e3), (1e4, 1800 / math.pi)])
    convention = pick(rng, ["rotation_vector", "roll_pitch_yaw", "abc", "zyz"])
    device.fields.append(pose_field(device, first, kind, width(kind), order, length, angle, convention))


def plain(arm, rng, kind=None, unit=None, first=None, stride=None, order=None, pose=None):
    """Joints of one form at one place; perhaps a pose behind them."""
    device = Device(arm, rng)
    if kind is None:
        kind, unit = pick(rng, FORMS)
    if kind == "int16" and unit == "0.01 deg" and (device.arm.upper.max() > 327 or device.arm.lower.min() < -327):
        unit = "0.1 deg"
    order = order or pick(rng, ORDERS)
    first = int(rng.integers(0, 400)) if first is None else first
    stride = stride or width(kind)
    n = len(device.q)
    device.fields.append(joints(spread(first, n, stride), kind, unit, order))
    device.end = first + n * stride
    device.form = kind, unit, order, first, stride
    if pose if pose is not None else rng.random() < 0.5:
        add_pose(device, device.end + int(rng.integers(0, 20)), kind, order, rng)
    return device


# ---- Kinds

def float_deg(arm, rng):
    return plain(arm, rng, "float32", "deg")


def float_rad(arm, rng):
    return plain(arm, rng, "float32", "rad")


def int32_milli_degree(arm, rng):
    return plain(arm, rng, "int32", "0.001 deg")


def int32_micro_radian(arm, rng):
    return plain(arm, rng, "int32", "urad")


def int16_tenth_degree(arm, rng):
    return plain(arm, rng, "int16", "0.1 deg")


def modulo_with_turns(arm, rng):
    """Unsigned mrad modulo one turn, whole turns as int16, the pose in 0.1 mm and mrad."""
    device = Device(arm, rng)
    first = int(rng.integers(100, 300))
    turn = 2 * math.pi * 1e3

    def fill(q, qd):
        words = {}
        for j, value in enumerate(np.radians(q) * 1e3):
            turns = math.floor(value / turn)
            words[first + j] = int(round(value - turns * turn)) & 0xFFFF
            words[first + 50 + j] = turns & 0xFFFF
        return words
    device.fields.append(fill)
    device.fields.append(numbers(first + 10, "int16", 1, "ABCD", [lambda q, qd, j=j: math.radians(qd[j]) * 1e3 for j in range(len(device.q))]))
    device.fields.append(numbers(first + 30, "int16", 1, "ABCD", [lambda q, qd, j=j: 31 + j for j in range(len(device.q))]))
    device.fields.append(pose_field(device, first + 130, "int16", 1, "ABCD", 1e4, 1e3, "rotation_vector"))
    device.units = [255, 0] if rng.random() < 0.5 else None
    return device


def modulo_without_turns(arm, rng):
    device = Device(arm, rng)
    first, counts = int(rng.integers(0, 300)), pick(rng, [3600, 36000])
    device.fields.append(lambda q, qd: {first + j: int(round(value % 360 * counts / 360)) % counts for j, value in enumerate(q)})
    device.one_turn, device.beyond = True, False
    device.q = device.posture()
    # Beyond half a turn, where the arm goes there, no profile is right.
    device.must_stay_open = bool(max(arm.upper.max(), -arm.lower.min()) > 185)
    return device


def modulo_beyond(arm, rng):
    """Angles within half a turn of an arm that is beyond it: 200 degrees are counted as -160."""
    device = Device(arm, rng)
    kind, unit = pick(rng, [("float32", "deg"), ("float32", "rad"), ("int32", "0.001 deg"), ("int16", "0.1 deg")])
    order, first = pick(rng, ORDERS), int(rng.integers(0, 300))
    fill = joints(spread(first, len(device.q), width(kind)), kind, unit, order)
    device.fields.append(lambda q, qd: fill((q + 180) % 360 - 180, qd))
    device.beyond, device.must_stay_open = True, bool(len(arm.turns_beyond()))
    device.one_turn = not device.must_stay_open
    device.q = device.posture()
    device.needs_pendant = True  # moves and poses do not tell whole turns
    return device


def modulo_two_rows(arm, rng):
    """Two equal rows of whole turns, perhaps the commanded and the actual ones."""
    device = modulo_with_turns(arm, rng)
    fill = device.fields[0]
    device.fields.append(lambda q, qd: {a + 400: w for a, w in list(fill(q, qd).items())[1::2]})
    device.must_stay_open, device.q = bool(max(arm.upper.max(), -arm.lower.min()) > 185), device.posture(negative=True)
    return device


def stored_point(arm, rng):
    """The actual joints, at times without a pose, and the joints and pose of a stored point in the same form."""
    device = plain(arm, rng, *pick(rng, FORMS[:5]), first=int(rng.integers(0, 300)), pose=bool(rng.random() < 0.3))
    kind, unit, order, _, stride = device.form
    stored = Device(arm, rng)
    stored.fields.append(joints(spread(500, len(stored.q), stride), kind, unit, order))
    add_pose(stored, 500 + len(stored.q) * stride, kind, order, rng)
    stored.tool, stored.base, stored.errors = np.eye(4), np.eye(4), None
    fixed = stored.registers(stored.q, np.zeros(len(stored.q)))
    device.static.update(fixed)
    return device


def pose_first(arm, rng):
    device = Device(arm, rng)
    kind, unit = pick(rng, FORMS[:5])
    order, first, n = pick(rng, ORDERS), int(rng.integers(0, 200)), len(device.q)
    add_pose(device, first, kind, order, rng)
    device.fields.append(joints(spread(first + 6 * width(kind), n, width(kind)), kind, unit, order))
    return device


def interleaved(arm, rng):
    """Of each joint: position, speed, current and temperature beside each other."""
    device = Device(arm, rng)
    kind, unit = pick(rng, [("float32", "deg"), ("float32", "rad"), ("int16", "0.1 deg"), ("int32", "0.001 deg")])
    order, first, n = pick(rng, ORDERS), int(rng.integers(0, 200)), len(device.q)
    stride = 4 * width(kind)
    device.fields.append(joints(spread(first, n, stride), kind, unit, order))
    amperes = rng.uniform(-4, 4, n)
    factor = 1 if kind == "float32" else 100
    for at, values in enumerate([[lambda q, qd, j=j: qd[j] * COUNTS[unit] for j in range(n)],
                                 [lambda q, qd, j=j: factor * amperes[j] for j in range(n)],
                                 [lambda q, qd, j=j: factor * (30 + 0.7 * j) for j in range(n)]]):
        device.fields.append(numbers(first + (at + 1) * width(kind), kind, stride, order, values))
    if rng.random() < 0.5:
        add_pose(device, first + n * stride + 4, kind, order, rng)
    return device


def gaps(arm, rng):
    kind, unit = pick(rng, FORMS[:5])
    return plain(arm, rng, kind, unit, stride=width(kind) + int(rng.integers(1, 7)))


def irregular(arm, rng):
    """Joints at addresses without a rule; only moves of single axes find them."""
    device = Device(arm, rng)
    kind, unit = pick(rng, FORMS[:5])
    order, address, places = pick(rng, ORDERS), int(rng.integers(0, 100)), []
    for _ in device.q:
        places.append(address)
        address += width(kind) + int(rng.integers(0, 6))
    device.fields.append(joints(places, kind, unit, order))
    device.only_confirm = True
    return device


def noise(arm, rng):
    device = plain(arm, rng, *pick(rng, [("float32", "deg"), ("float32", "rad"), ("int32", "0.001 deg")]))
    device.noise_deg = 0.003
    return device


def moving(arm, rng):
    device = plain(arm, rng, *pick(rng, FORMS[:4]), pose=True)
    device.speed_deg_s = rng.uniform(1, 5, len(device.q))
    return device


def slow(arm, rng):
    device = plain(arm, rng)
    device.delay_s = 0.08
    return device


def closing(arm, rng):
    device = plain(arm, rng)
    device.closes = True
    return device


def rtu_gateway(arm, rng):
    device = plain(arm, rng)
    device.framing, device.expected = "rtu", "RTU frames over TCP"
    return device


def no_transaction(arm, rng):
    device = plain(arm, rng)
    device.bad_transaction, device.expected = True, "transaction id"
    return device


def zeros(arm, rng):
    device = Device(arm, rng)
    device.expected = "no decoding gives plausible joints"
    return device


def offset_one(arm, rng):
    """A status word before the joints, so that they start at an odd address."""
    device = plain(arm, rng, *pick(rng, [("float32", "deg"), ("float32", "rad"), ("int32", "0.001 deg")]), first=1)
    device.static = {0: int(rng.integers(1, 20))}
    return device


def decoys(arm, rng):
    """Constants that look like joints, in the same form, and the tool's speed."""
    device = plain(arm, rng, *pick(rng, FORMS[:5]))
    kind, unit, order, _, _ = device.form
    fixed = arm.posture(rng)
    device.fields.append(lambda q, qd: joints(spread(500, len(fixed), width(kind)), kind, unit, order)(fixed, qd))
    device.fields.append(lambda q, qd: joints(spread(540, len(fixed), width(kind)), kind, unit, order)(0.3 * fixed, qd))
    return device


def small_requests(arm, rng):
    device = plain(arm, rng)
    device.max_count = int(rng.integers(6, 20))
    return device


def holes(arm, rng):
    device = plain(arm, rng)
    used = set(device.registers(*device.now()))
    device.holes = {a for a in range(0, 1024) if a not in used and rng.random() < 0.2}
    return device


def islands(arm, rng):
    """Only the registers in use exist."""
    device = plain(arm, rng)
    used = sorted(device.registers(*device.now()))
    device.ranges, first = [], used[0]
    for a, b in zip(used, used[1:] + [None]):
        if b != a + 1:
            device.ranges.append((first, a))
            first = b
    return device


def unit_255(arm, rng):
    device = plain(arm, rng)
    device.units = [255]
    return device


def input_only(arm, rng):
    device = plain(arm, rng)
    device.functions = [4]
    return device


def whole_pairs(arm, rng):
    """32-bit values that are only read whole."""
    device = plain(arm, rng, *pick(rng, [("float32", "deg"), ("int32", "0.001 deg")]), pose=False)
    first, end = device.form[3], device.end
    device.ranges, device.pairs_from = [(first, end - 1)], first
    return device


def far_away(arm, rng):
    device = plain(arm, rng, "float32", pick(rng, ["deg", "rad"]), first=7001, pose=False)
    device.ranges, device.functions = [(7001, 7100)], [4]
    add_pose(device, 7025, "float32", device.form[2], rng)
    return device


def mirrored(arm, rng):
    device = plain(arm, rng)
    device.functions = [3, 4]
    return device


def commanded_and_actual(arm, rng):
    """Two equal rows of joints: at standstill nothing separates them."""
    device = plain(arm, rng, *pick(rng, FORMS[:4]), pose=False)
    kind, unit, order, _, stride = device.form
    device.fields.append(joints(spread(600, len(device.q), stride), kind, unit, order))
    device.may_stay_open = True
    return device


def following_error(arm, rng):
    """The commanded joints, exact, and the actual ones with a following error and noise."""
    device = plain(arm, rng, *pick(rng, [("float32", "deg"), ("float32", "rad"), ("int32", "0.001 deg")]), first=100)
    kind, unit, order, _, stride = device.form
    lag, device.noise_deg = rng.choice([-1, 1], len(device.q)) * rng.uniform(0.01, 0.03, len(device.q)), 0.002

    def commanded(q, qd):
        # Without the noise of the actual joints.
        return joints(spread(pick_first, len(q), stride), kind, unit, order)(np.round((q + lag) / 0.01) * 0.01, qd)
    pick_first = int(rng.choice([20, 300]))
    device.fields.append(commanded)
    device.may_stay_open = True
    return device


def two_arms(arm, rng):
    """The joints and the flange of a second arm of the same model behind those of the first."""
    device = plain(arm, rng, *pick(rng, FORMS[:4]), first=0, pose=True)
    kind, unit, order, _, stride = device.form
    other = Device(arm, rng)
    add_pose(other, 560, kind, order, rng)
    device.fields.append(lambda q, qd: joints(spread(500, len(other.q), stride), kind, unit, order)(other.q, qd))
    device.fields.append(lambda q, qd: other.fields[0](other.q, qd))
    for one in (device, other):  # both poses are as the cell has them
        one.tool, one.base, one.errors = np.eye(4), np.eye(4), None
    return device


def two_units(arm, rng):
    """The joints in degrees and in radians."""
    device = plain(arm, rng, "float32", "deg", pose=False)
    order = device.form[2]
    device.fields.append(joints(spread(600, len(device.q), 2), "float32", "rad", order))
    device.may_stay_open = True
    return device


def modulo_with_flags(arm, rng):
    """Joints modulo one turn, among words that look like whole turns."""
    device = modulo_with_turns(arm, rng)
    device.static.update({500 + k: int(rng.choice([0, 0, 1, 65535])) for k in range(60)})
    return device


KINDS = [float_deg, float_rad, int32_milli_degree, int32_micro_radian, int16_tenth_degree, modulo_with_turns,
         modulo_without_turns, modulo_beyond, modulo_two_rows, stored_point, pose_first, interleaved, gaps, irregular, noise, moving, slow, closing, rtu_gateway,
         no_transaction, zeros, offset_one, decoys, small_requests, holes, islands, unit_255, input_only, whole_pairs,
         far_away, mirrored, commanded_and_actual, following_error, two_arms, two_units, modulo_with_flags]
