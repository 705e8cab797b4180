"""A VISCA camera at the far end of a USB serial adapter; it knows bytes, nothing of the product.
[Sony, EVI-D70 Technical Manual]"""
import socket
import threading
import time


class Visca(threading.Thread):
    """Making it plugs the adapter in (QEMU's appears with its far end), unplug() pulls it."""

    def __init__(self, machine):
        super().__init__(daemon=True)
        self.link = machine.connected("serial", 10)
        self.zoom, self.moving, self.asked = 4000, False, 0
        self.start()

    def unplug(self):
        self.link.shutdown(socket.SHUT_RDWR)
        self.join()
        self.link.close()

    def run(self):
        waiting = b""
        while True:
            try:
                more = self.link.recv(256)
            except OSError:
                return
            if not more:
                return
            waiting += more
            while b"\xff" in waiting:
                packet, waiting = waiting.split(b"\xff", 1)
                answer = self.answer(packet)
                if answer:
                    self.link.sendall(answer + b"\xff")

    def answer(self, packet):
        self.asked += 1
        if packet == b"\x88\x30\x01":  # the line is addressed: one camera
            return b"\x88\x30\x02"
        position = bytes(self.zoom >> shift & 15 for shift in (12, 8, 4, 0))
        if packet == b"\x81\x09\x7e\x7e\x00":  # the block of the lens
            return b"\x90\x50" + position + bytes(2) + bytes(4) + bytes(2) + bytes([self.moving])
        if packet == b"\x81\x09\x04\x47":
            return b"\x90\x50" + position
        return b"\x90\x60\x02"

    def turn(self, zoom):
        """As a hand turns it: it moves, then it stands."""
        self.moving = True
        time.sleep(0.3)
        self.zoom, self.moving = zoom, False
