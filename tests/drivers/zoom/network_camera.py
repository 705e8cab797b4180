"""A VISCA camera in the network, over UDP (with header and sequence number) and TCP (without), and
what networks and cameras do to its answers. It knows bytes, nothing of the product.
[Sony, BRC-X400 / SRG-X400 Command List, "VISCA over IP"]"""
import random
import socket
import struct
import threading
import time

STEP_S = 0.02  # the zoom changes this often, so that an answer shows when it was given
INQUIRY, REPLY, CONTROL, CONTROL_REPLY = 0x0110, 0x0111, 0x0200, 0x0201
LENS_BLOCK, ZOOM, FOCUS = b"\x81\x09\x7e\x7e\x00\xff", b"\x81\x09\x04\x47\xff", b"\x81\x09\x04\x48\xff"
ACK = b"\x90\x41\xff\x90\x51\xff"  # of a command that another controller has sent


def zoom_at(t_s):
    return int(t_s / STEP_S) % 0x4000


def nibbles(value):
    return bytes(value >> shift & 15 for shift in (12, 8, 4, 0))


class NetworkCamera:
    """Runs until close(). `faults` may be changed at any time; probabilities are per answer."""

    def __init__(self, host="127.0.0.1", port=0, seed=0, **faults):
        self.faults = {"loss": 0, "twice": 0, "late": 0, "late_s": 0.1, "split": 0, "interleave": 0, "junk": 0,
                       "checks": True, "answers_reset": True, "has_block": True, "header": True,
                       "sequence": None, "off": False, "hang_up": 0} | faults
        self.random = random.Random(seed)
        self.last = None  # sequence number; none before a reset
        self.inquiries = self.resets = self.connections = 0
        self.closed = False
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.tcp = socket.create_server((host, port), family=family)
        self.port = self.tcp.getsockname()[1]
        self.udp = socket.socket(family, socket.SOCK_DGRAM)
        self.udp.bind((host, self.port))
        for line in (self.udp, self.tcp):
            line.settimeout(0.02)
        self.threads = [threading.Thread(target=run) for run in (self.run_udp, self.run_tcp)]
        for thread in self.threads:
            thread.start()

    def close(self):
        self.closed = True
        for thread in self.threads:
            thread.join()
        self.udp.close()
        self.tcp.close()

    def reboot(self, off_s):
        self.faults["off"] = True
        time.sleep(off_s)
        self.last = None
        self.faults["off"] = False

    def happens(self, fault):
        return self.random.random() < self.faults[fault]

    def answer(self, request):
        self.inquiries += 1
        zoom = nibbles(zoom_at(time.monotonic()))
        if request == LENS_BLOCK and self.faults["has_block"]:
            return b"\x90\x50" + zoom + bytes(10 - 1) + b"\xff"
        if request == ZOOM:
            return b"\x90\x50" + zoom + b"\xff"
        if request == FOCUS:
            return b"\x90\x50" + nibbles(0x1234) + b"\xff"
        return b"\x90\x60\x02\xff"

    # UDP

    def run_udp(self):
        while not self.closed:
            try:
                datagram, peer = self.udp.recvfrom(64)
            except OSError:
                continue
            if not self.faults["off"] and len(datagram) > 8:
                self.take(datagram, peer)

    def take(self, datagram, peer):
        kind, length, sequence = struct.unpack(">HHI", datagram[:8])
        content = datagram[8:]
        if length != len(content):
            return
        if kind == CONTROL and content == b"\x01":
            self.last, self.resets = 0, self.resets + 1
            if self.faults["answers_reset"]:
                self.send(CONTROL_REPLY, sequence, b"\x01", peer)
        elif kind == INQUIRY:
            if self.faults["checks"] and (self.last is None or sequence <= self.last):
                self.send(CONTROL_REPLY, sequence, b"\x0f\x01", peer)
                return
            self.last = sequence
            if self.faults["sequence"] is not None:
                sequence = self.faults["sequence"]
            self.send(REPLY, sequence, self.answer(content), peer)

    def send(self, kind, sequence, content, peer):
        datagram = struct.pack(">HHI", kind, len(content), sequence) + content
        if not self.faults["header"]:
            datagram = content
        if self.happens("junk"):
            self.put(self.random.choice([b"", b"\xff", b"\x01\x11\x00\x10" + bytes(4), b"hello", bytes(60),
                                         datagram[:-2], datagram + b"\x00"]), peer)
        if self.happens("loss"):
            return
        for _ in range(1 + self.happens("twice")):
            delay_s = self.faults["late_s"] * (0.5 + self.random.random()) if self.happens("late") else 0
            if delay_s:
                threading.Timer(delay_s, self.put, (datagram, peer)).start()
            else:
                self.put(datagram, peer)

    def put(self, datagram, peer):
        try:
            self.udp.sendto(datagram, peer)
        except OSError:
            pass

    # TCP

    def run_tcp(self):
        while not self.closed:
            try:
                link, _ = self.tcp.accept()
            except OSError:
                continue
            self.connections += 1
            thread = threading.Thread(target=self.serve, args=(link,))
            self.threads.append(thread)
            thread.start()

    def serve(self, link):
        link.settimeout(0.02)
        waiting = b""
        with link:
            while not self.closed:
                try:
                    more = link.recv(256)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not more:
                    return
                waiting += more
                while b"\xff" in waiting:
                    packet, waiting = waiting.split(b"\xff", 1)
                    if self.faults["off"] or self.happens("loss"):
                        continue
                    if self.happens("hang_up") or not self.write(link, self.answer(packet + b"\xff")):
                        return

    def write(self, link, answer):
        if self.happens("late"):
            time.sleep(self.faults["late_s"] * (0.5 + self.random.random()))
        if self.happens("interleave"):
            answer = ACK + answer + ACK
        try:
            if self.happens("split"):
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                for byte in answer:
                    link.sendall(bytes([byte]))
                    time.sleep(0.0005)
            else:
                link.sendall(answer)
        except OSError:
            return False
        return True
