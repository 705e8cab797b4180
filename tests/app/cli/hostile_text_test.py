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


def check(words, shows=False):
    """shows: the hostile text must be part of the output."""
    for where, text in (("terminal", on_terminal(words)), ("pipe", in_pipe(words))):
        name = "plumbline %s (%s)" % (" ".join(words), where)
        left = OWN.sub(b"", text) if where == "terminal" else text
        if found := FORBIDDEN.search(left):
            faults.append("%s: prints %r in %r" % (name, found.group(), left[max(0, found.start() - 40):][:120]))
        if b"\x1b[31mred" in text:
            faults.append("%s: a file's colour reached the terminal" % name)
        if shows and b"u001b]0;owned" not in text.replace(b"\r\n", b""):
            faults.append("%s: the hostile text is not shown: %r" % (name, text[:300]))
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
    table = write("table.csv", "q1;q2;q3;q4;q5;q6;x;y;z;" + ESCAPE + "\n" + "\n".join(
        "%d;-90;90;0;90;0;1000;200;%d;%s" % (k, 300 + k, ESCAPE) for k in range(8)) + "\n")
    urdf = write("arm.urdf", '<robot name="%s"><link name="a"/><link name="b"/><joint name="%s" type="revolute">'
                 '<parent link="a"/><child link="%s"/></joint></robot>' % (ESCAPE, ESCAPE, ESCAPE))
    json = write("model.json", '{"%s": "%s"}' % (TOML, TOML))
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
    check(["predict", cell, table, "--out", "-"], shows=True)
    check(["predict", "config/cells/ur10.toml", table, "--out", "-"])
    check(["diagnose", "config/cells/ur10.toml", table], shows=True)
    check(["diagnose", cell, table], shows=True)
    check(["plan", cell, "--out", os.path.join(folder, "plan.csv")], shows=True)
    check(["export-urdf", cell, "--urdf", urdf, "--out", "-"])
    check(["journal", "import", table, "--cell", "config/cells/ur10.toml", "--state", folder], shows=True)
    check(["journal", "export", "--cell", cell, "--state", folder, "--out", "-"], shows=True)
    check(["journal", "show", "--state", named], shows=True)
    check(["model", "propose", cell, "--state", folder])
    check(["model", "list", "--state", named], shows=True)
    check(["lens", "list", "--state", named])
    check(["mesh", mesh])
    check(["mesh", named], shows=True)
    check(["print", named])
    check(["doctor", "--config", daemon])
    check(["calibrate-hand-eye", table, json])
    check(["calibrate-lens", named])
    check(["track", named])
    check(["beam", "--material", ESCAPE])
    check([ESCAPE], shows=True)

print("\n".join(faults) or "no file's escape sequence reaches the terminal")
sys.exit(1 if faults else 0)
