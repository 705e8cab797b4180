"""The rig's hand inside: lays out the cell, then calls a function of these modules for each line
that the host sends. The service manager starts the daemon after the cell is there, as robots and
cameras are when a plant is switched on."""
import importlib
import json
import os
import socket
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def ready():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as link:
        link.sendto(b"READY=1", os.environ["NOTIFY_SOCKET"])


def main():
    cell = importlib.import_module("cell")
    cell.hardware()
    cell.watch()
    ready()
    with open("/dev/virtio-ports/rig", "r+b", buffering=0) as port:
        port.write(b'{"up": true}\n')
        waiting = b""
        while True:
            waiting += port.read(65536) or b""
            while b"\n" in waiting:
                line, waiting = waiting.split(b"\n", 1)
                request = json.loads(line)
                answer = {"id": request["id"]}
                try:
                    module, name = request["call"].split(".")
                    function = getattr(importlib.import_module(module), name)
                    answer["value"] = function(*request["with"])
                except Exception as error:  # whatever it is, the host is told
                    answer["error"] = "%s: %s" % (type(error).__name__, error)
                    answer["where"] = traceback.format_exc()
                data = json.dumps(answer).encode() + b"\n"
                while data:
                    data = data[port.write(data) :]


if __name__ == "__main__":
    main()
