"""Files that announce more than any machine needs are refused by their size or header: with a fault that names the file,
and without the memory that their content would take.

    oversized_files_test.py BUILD_BIN [--times]    --times also prints how long each refusal took"""

import os
import struct
import subprocess
import sys
import tempfile
import time
import zlib

PLUMBLINE = os.path.abspath(sys.argv[1]) + "/plumbline"
LARGEST_MB = 200
CELL = "config/cells/ur10.toml"


def png(side):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    row = zlib.compress(bytes(side + 1), 9)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", row) + chunk(b"IEND", b""))


def peak_and_answer(words):
    """Peak memory in MB, output and duration of a command."""
    start = time.monotonic()
    with tempfile.TemporaryFile() as output:
        child = subprocess.Popen([PLUMBLINE, *words], stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        _, child.returncode, usage = os.wait4(child.pid, 0)
        output.seek(0)
        text = output.read(100000).decode()
    return usage.ru_maxrss / 1024, text, time.monotonic() - start


faults = []
with tempfile.TemporaryDirectory() as folder:
    names = {name: os.path.join(folder, name) for name in ("wide.csv", "joints.toml", "cell.toml", "images")}
    columns = ",".join("c%d" % k for k in range(10**6))
    with open(names["wide.csv"], "w") as file:
        file.write("%s\n%s\n" % (columns, ",".join("1" for _ in range(10**6))))
    with open(CELL) as cell, open(names["cell.toml"], "w") as file:
        file.write(cell.read())
        file.write("# padding\n" * 2_200_000)
    with open(names["joints.toml"], "w") as file:
        file.write("q_deg = [%s]\n" % ", ".join("12.5" for _ in range(3_600_000)))
    os.mkdir(names["images"])
    with open(os.path.join(names["images"], "1.png"), "wb") as file:
        file.write(png(30000))
    for words, file in (
        (["diagnose", CELL, names["wide.csv"]], "wide.csv"),
        (["import", names["wide.csv"], "--preview"], "wide.csv"),
        (["predict", CELL, names["wide.csv"], "--output", "-"], "wide.csv"),
        (["check", names["cell.toml"]], "cell.toml"),
        (["check", names["joints.toml"]], "joints.toml"),
        (["calibrate-lens", "--images", names["images"], "--board", "9x6"], "1.png"),
    ):
        peak_mb, text, seconds = peak_and_answer(words)
        name = " ".join(words[:1]) + " " + file
        if "at most" not in text and "the limit is" not in text:
            faults.append("%s: the limit is not stated: %s" % (name, text[:300]))
        if file not in "".join(text.split()):
            faults.append("%s: the file is not named: %s" % (name, text[:300]))
        if peak_mb > LARGEST_MB:
            faults.append("%s: takes %.0f MB, more than %d" % (name, peak_mb, LARGEST_MB))
        if "--times" in sys.argv:
            print("%-24s %5.2f s %5.0f MB  %s" % (name, seconds, peak_mb, text.splitlines()[0][:100] if text else ""))

print("\n".join(faults))
sys.exit(1 if faults else 0)
