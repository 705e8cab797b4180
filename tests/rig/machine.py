"""The virtual industrial PC from outside: QEMU, its plugs, and the agent inside."""
import json
import os
import socket
import subprocess
import time


class Machine:
    def __init__(self, folder, cores=2, memory_mib=1536):
        self.folder, self.cores, self.memory_mib = os.path.abspath(folder), cores, memory_mib
        self.qemu = None
        self.number = 0

    def path(self, name):
        return os.path.join(self.folder, name)

    def power_on(self, disk="disk.run", patience_s=90):
        for name in ("agent", "serial", "qmp"):
            if os.path.exists(self.path(name)):
                os.unlink(self.path(name))
        words = f"""qemu-system-x86_64 -machine q35 -accel tcg,thread=multi,tb-size=512 -cpu qemu64
 -smp {self.cores} -m {self.memory_mib} -nodefaults -no-user-config -display none -no-reboot
 -kernel vmlinuz -initrd initrd -serial file:console.log
 -drive file={disk},format=raw,if=none,id=disk -device virtio-blk-pci,drive=disk
 -fsdev local,id=rig,path=share,security_model=none,readonly=on -device virtio-9p-pci,fsdev=rig,mount_tag=rig
 -device virtio-serial-pci -chardev socket,id=agent,path=agent,server=on,wait=off
 -device virtserialport,chardev=agent,name=rig
 -device virtio-rng-pci -device virtio-vga,xres=1600,yres=1200 -device qemu-xhci,id=usb -chardev socket,id=serial,path=serial,server=on,wait=off
 -device usb-serial,chardev=serial,bus=usb.0 -qmp unix:qmp,server=on,wait=off""".split()
        words += [
            "-append",
            "console=ttyS0 panic=-1 quiet mitigations=off nokaslr audit=0 apparmor=0 "
            "random.trust_cpu=on no_timer_check tsc=reliable net.ifnames=0",
        ]
        self.qemu = subprocess.Popen(
            words,
            cwd=self.folder,
            stdout=open(self.path("qemu.log"), "w"),
            stderr=subprocess.STDOUT,
        )
        began = time.monotonic()
        self.agent = self.connected("agent", 10)
        self.control = self.connected("qmp", 10)
        self.lines = self.control.makefile("r")
        self.lines.readline()
        self.qmp("qmp_capabilities")
        self.buffer = b""
        # Nobody listens before the agent is there: what is sent earlier is lost.
        if "up" not in self.line(patience_s):
            raise RuntimeError("the agent did not come up")
        return time.monotonic() - began

    def connected(self, name, patience_s):
        end = time.monotonic() + patience_s
        while True:
            try:
                link = socket.socket(socket.AF_UNIX)
                here = os.open(self.folder, os.O_RDONLY)
                link.connect("/proc/self/fd/%d/%s" % (here, name))  # however long the folder's name
                os.close(here)
                return link
            except OSError:
                link.close()
                os.close(here)
                if time.monotonic() > end or self.qemu.poll() is not None:
                    raise RuntimeError("QEMU did not start: " + open(self.path("qemu.log")).read())
                time.sleep(0.05)

    def line(self, patience_s):
        end = time.monotonic() + patience_s
        while b"\n" not in self.buffer:
            self.agent.settimeout(max(0.01, end - time.monotonic()))
            try:
                more = self.agent.recv(65536)
            except TimeoutError:
                raise TimeoutError(
                    "the machine did not answer within %.0f s" % patience_s
                ) from None
            if not more:
                raise RuntimeError("QEMU ended")
            self.buffer += more
        line, self.buffer = self.buffer.split(b"\n", 1)
        return json.loads(line)

    def call(self, function, *values, patience_s=60):
        """What a function of guest/ returns."""
        self.number += 1
        self.agent.settimeout(10)
        self.agent.sendall(
            json.dumps({"id": self.number, "call": function, "with": values}).encode() + b"\n"
        )
        end = time.monotonic() + patience_s
        while True:
            answer = self.line(end - time.monotonic())
            if answer.get("id") == self.number:
                break
        if "error" in answer:
            raise RuntimeError(answer["error"] + "\n" + answer["where"])
        return answer["value"]

    def sh(self, command, patience_s=60):
        return self.call("cell.sh", command, patience_s, patience_s=patience_s + 5)

    def qmp(self, command, **values):
        self.control.settimeout(20)
        self.control.sendall(json.dumps({"execute": command, "arguments": values}).encode() + b"\n")
        while True:
            answer = json.loads(self.lines.readline())
            if "return" in answer:
                return answer["return"]
            if "error" in answer:
                raise RuntimeError(answer["error"]["desc"])

    def picture(self):
        """(width, height, bytes of RGB) of what the monitor shows."""
        self.qmp("screendump", filename=self.path("screen.ppm"))
        time.sleep(0.3)
        with open(self.path("screen.ppm"), "rb") as file:
            data = file.read()
        head = data.split(b"\n", 3)
        width, height = map(int, head[1].split())
        return width, height, head[3]

    def power_cut(self):
        if self.qemu:
            self.qemu.kill()
            self.qemu.wait()
            self.agent.close()
            self.control.close()
        self.qemu = None
