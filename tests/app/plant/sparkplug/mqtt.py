"""MQTT 3.1.1 from its specification: a client, and a relay that records what passes. No code of the product."""

import socket
import struct
import threading
import time

CONNECT, CONNACK, PUBLISH, PUBACK, SUBSCRIBE, SUBACK, DISCONNECT = 1, 2, 3, 4, 8, 9, 14


def text(value):
    data = value if isinstance(value, bytes) else value.encode()
    return struct.pack(">H", len(data)) + data


def packet(kind, flags, body):
    length, size = b"", len(body)
    while True:
        size, digit = divmod(size, 128)
        length += bytes([digit | (128 if size else 0)])
        if not size:
            return bytes([kind << 4 | flags]) + length + body


class Packets:
    """Cuts a stream of bytes into packets (kind, flags, body)."""

    def __init__(self):
        self.data = b""

    def add(self, data):
        self.data += data
        while True:
            length = shift = 0
            for at in range(1, min(5, len(self.data))):
                length |= (self.data[at] & 127) << shift
                shift += 7
                if self.data[at] < 128:
                    break
            else:
                return
            if len(self.data) < at + 1 + length:
                return
            body = self.data[at + 1 : at + 1 + length]
            yield self.data[0] >> 4, self.data[0] & 15, body
            self.data = self.data[at + 1 + length :]


class Message:
    def __init__(self, flags, body):
        size = struct.unpack(">H", body[:2])[0]
        self.topic, rest = body[2 : 2 + size].decode(), body[2 + size :]
        self.qos, self.retained = flags >> 1 & 3, bool(flags & 1)
        self.id, self.payload = (rest[:2], rest[2:]) if self.qos else (b"", rest)


class Client:
    """Hands each message to `take`, in a thread of its own."""

    def __init__(self, port, name, take=None, will=None):
        self.take, self.lock, self.number = take, threading.Lock(), 0
        self.acknowledged, self.changed = set(), threading.Condition()
        flags, body = 2, text(name)
        if will:
            topic, payload, qos, retained = will
            flags |= 4 | qos << 3 | (32 if retained else 0)
            body += text(topic) + text(payload)
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        self.socket.settimeout(None)
        self.send(packet(CONNECT, 0, text("MQTT") + bytes([4, flags]) + struct.pack(">H", 0) + body))
        threading.Thread(target=self.read, daemon=True).start()
        self.await_(b"connack")

    def send(self, data):
        with self.lock:
            self.socket.sendall(data)

    def read(self):
        packets = Packets()
        try:
            while data := self.socket.recv(65536):
                for kind, flags, body in packets.add(data):
                    if kind == PUBLISH:
                        message = Message(flags, body)
                        self.take(message)
                        if message.qos:
                            self.send(packet(PUBACK, 0, message.id))
                    elif kind in (CONNACK, SUBACK, PUBACK):
                        with self.changed:
                            self.acknowledged.add(b"connack" if kind == CONNACK else body[:2])
                            self.changed.notify_all()
        except OSError:
            pass

    def await_(self, what):
        with self.changed:
            assert self.changed.wait_for(lambda: what in self.acknowledged, 20), "no answer of the broker"

    def next_id(self):
        self.number = self.number % 65535 + 1
        self.acknowledged.discard(struct.pack(">H", self.number))
        return struct.pack(">H", self.number)

    def publish(self, topic, payload, qos=1, retain=False, wait=True):
        data = payload if isinstance(payload, bytes) else payload.encode()
        number = self.next_id() if qos else b""
        self.send(packet(PUBLISH, qos << 1 | retain, text(topic) + number + data))
        if qos and wait:
            self.await_(number)

    def subscribe(self, topic, qos):
        number = self.next_id()
        self.send(packet(SUBSCRIBE, 2, number + text(topic) + bytes([qos])))
        self.await_(number)

    def disconnect(self):
        self.send(packet(DISCONNECT, 0, b""))
        self.socket.close()

    def drop(self):
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()


class Relay:
    """Forwards connections to a port; `connections` lists the packets of each client in order."""

    def __init__(self, port):
        self.target, self.connections = port, []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            client = self.listener.accept()[0]
            try:
                server = socket.create_connection(("127.0.0.1", self.target))
            except OSError:
                client.close()
                continue
            packets = []
            self.connections.append(packets)
            threading.Thread(target=self.forward, args=(client, server, packets), daemon=True).start()
            threading.Thread(target=self.forward, args=(server, client, None), daemon=True).start()

    @staticmethod
    def forward(source, target, record):
        cut = Packets()
        try:
            while data := source.recv(65536):
                if record is not None:
                    record.extend(cut.add(data))
                target.sendall(data)
        except OSError:
            pass
        for one in (source, target):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass


class Connect:
    """The CONNECT packet of a client."""

    def __init__(self, body):
        assert body[:7] == text("MQTT") + b"\x04", "not MQTT 3.1.1"
        flags = body[7]
        self.clean, self.will_qos, self.will_retained = bool(flags & 2), flags >> 3 & 3, bool(flags & 32)
        parts, rest = [], body[10:]
        while rest:
            size = struct.unpack(">H", rest[:2])[0]
            parts.append(rest[2 : 2 + size])
            rest = rest[2 + size :]
        self.client = parts[0].decode()
        self.will_topic, self.will = (parts[1].decode(), parts[2]) if flags & 4 else (None, None)


def subscriptions(body):
    """(topic, QoS) of a SUBSCRIBE packet."""
    rest, found = body[2:], []
    while rest:
        size = struct.unpack(">H", rest[:2])[0]
        found.append((rest[2 : 2 + size].decode(), rest[2 + size]))
        rest = rest[3 + size :]
    return found


def soon(holds, seconds=30):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if holds():
            return True
        time.sleep(0.005)
    return holds()
