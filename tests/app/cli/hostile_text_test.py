"""Nothing in a file controls the operator's terminal: every command that reads files gets files full of escape
sequences, on a terminal and through a pipe, and prints them as visible text.

    hostile_text_test.py BUILD_BIN"""

import os
import pty
import re
import subprocess
import sys
import tempfile

PLUMBLINE = os.path.abspath(sys.argv[1]) + "/plumbline"
ESCAPE = "\x1b]0;owned\x07\x1b[2J\x1b[31mred\u009b2J\u202egpj"
TOML = r"\u001b]0;owned\u0007\u001b[2J\u001b[31mred\u009b2J\u202egpj"
OWN = re.compile(rb"\x1b\[(31|32|33|0)m|\r\x1b\[K|\r\n")
FORBIDDEN = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\x8e\x8f\xa8-\xae]|\xe2\x81[\xa6-\xa9]")
faults = []


def on_terminal(words):
    main, side = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    environment["TERM"] = "xterm"
    child = subprocess.Popen([PLUMBLINE, *words], stdin=subprocess.DEVNULL, stdout=side, stderr=side, env=environment)
    os.close(side)
    text = b""
    try:
        while part := os.read(main, 65536):
            text += part
    except OSError:  # the child has closed its side
        pass
    child.wait(timeout=60)
    os.close(main)
    return text


def in_pipe(words):
    ended = subprocess.run([PLUMBLINE, *words], stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
    return ended.stdout + ended.stderr


def check(words, shows=False, usage=False):
    """shows: the hostile text must be part of the output. usage: the command line itself is hostile, and wrong;
    that of every other entry must be right, or its file would not be read."""
    for where, text in (("terminal", on_terminal(words)), ("pipe", in_pipe(words))):
        name = "plumbline %s (%s)" % (" ".join(words), where)
        left = OWN.sub(b"", text) if where == "terminal" else text
        if found := FORBIDDEN.search(left):
            faults.append("%s: prints %r in %r" % (name, found.group(), left[max(0, found.start() - 40):][:120]))
        if b"\x1b[31mred" in text:
            faults.append("%s: a file's colour reached the terminal" % name)
        if shows and b"]0;owned" not in b"".join(text.split()):  # some readers write ? for the escape character
            faults.append("%s: the hostile text is not shown: %r" % (name, text[:300]))
        if (b"; see plumbline" in b" ".join(text.split())) != usage:
            faults.append("%s: %s usage error: %r" % (name, "no" if usage else "a", text[:300]))
        if not text:
            faults.append("%s: prints nothing" % name)


with tempfile.TemporaryDirectory() as folder:
    def write(name, text):
        path = os.path.join(folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    ur10 = open("config/cells/ur10.toml").read()
    unknown = '"%s" = 1\n' % TOML
    cell = write("cell.toml", unknown + ur10)
    raw = write("raw.toml", "x = " + ESCAPE + "\n")
    daemon = write("plumbline.toml", 'cell = "cell.toml"\n' + unknown)
    table = write("table.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm," + ESCAPE + "\n" + "\n".join(
        "%d,-90,90,0,90,0,1000,200,%d,%s" % (k, 300 + k, ESCAPE) for k in range(8)) + "\n")
    urdf = write("arm.urdf", '<robot name="%s"><link name="a"/><link name="b"/><joint name="%s" type="revolute">'
                 '<parent link="a"/><child link="%s"/></joint></robot>' % (ESCAPE, ESCAPE, ESCAPE))
    json = write("model.json", '{"%s": "%s"}' % (TOML, TOML))
    lens = write("lens.json", '{"schema": 1, "accepted": true, "image_size": [8, 8], "fx": 8.0, "fy": 8.0, "cx": 4.0, '
                 '"cy": 4.0, "distortion": [0, 0, 0, 0, 0], "%s": 1}' % TOML)
    mesh = write("part.stl", "solid %s\nfacet %s\n" % (ESCAPE, ESCAPE))
    named = os.path.join(folder, ESCAPE.replace("/", ""))
    write(os.path.basename(named), "q1,q2\n1,2\n")

    check(["check", cell], shows=True)
    check(["check", daemon], shows=True)
    check(["check", raw])
    check(["check", named], shows=True)
    check(["import", table, "--preview"], shows=True)
    check(["import", table, "--output", "-"])
    check(["import-urdf", urdf], shows=True)
    check(["predict", cell, table, "--output", "-"], shows=True)
    check(["predict", "config/cells/ur10.toml", table, "--output", "-"], shows=True)
    check(["diagnose", "config/cells/ur10.toml", table], shows=True)
    check(["diagnose", cell, table], shows=True)
    check(["plan", cell, "--output", os.path.join(folder, "plan.csv")], shows=True)
    check(["export-urdf", cell, urdf, "--output", "-"], shows=True)
    check(["journal", "import", table, "--cell", "config/cells/ur10.toml", "--state", folder], shows=True)
    check(["journal", "export", "--cell", cell, "--state", folder, "--output", "-"], shows=True)
    check(["journal", "show", "--state", named], shows=True)
    check(["model", "propose", cell, "--state", folder], shows=True)
    check(["model", "list", "--state", named], shows=True)
    check(["lens", "list", "--state", named], shows=True)
    check(["mesh", "check", mesh])
    check(["mesh", "check", named], shows=True)
    check(["print", "tag", "--id", "7", "--size-mm", "80", "--output", os.path.join(named, "a.pdf")], shows=True)
    check(["doctor", "--config", daemon])
    check(["calibrate-hand-eye", "--images", folder, "--poses", table, "--intrinsics", lens])
    check(["calibrate-hand-eye", "--images", folder, "--poses", named, "--intrinsics", lens], shows=True)
    check(["calibrate-lens", "--images", named], shows=True)
    check(["track", "--image", named, "--intrinsics", lens, "--tag-size-mm", "80"], shows=True)
    check(["track", "--image", named, "--intrinsics", json, "--tag-size-mm", "80"])
    check(["distance", daemon], shows=True)
    check(["snapshot", daemon, "--output", os.path.join(folder, "a.png")], shows=True)
    check(["beam", "--material", ESCAPE], shows=True, usage=True)
    check([ESCAPE], shows=True, usage=True)

print("\n".join(faults) or "no file's escape sequence reaches the terminal")
sys.exit(1 if faults else 0)
