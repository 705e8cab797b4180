"""Every program's and command's --help fits 80 columns, lists no exclusions and has an example; on a terminal, long
lines are wrapped, and there are colours unless NO_COLOR is set.

    help_test.py BUILD_BIN"""

import os
import pty
import re
import subprocess
import sys
import tempfile

BIN = os.path.abspath(sys.argv[1]) + "/"
PLUMBLINE = BIN + "plumbline"
SERVICES = ("plumblined", "plumbline-view", "plumbline-fleet", "plumbline-sparkplug")
WIDTH = 80
faults = []


def printed(*words):
    return subprocess.run([PLUMBLINE, *words], capture_output=True, text=True, timeout=60).stdout


def on_terminal(*words, **environment):
    """Output of a command whose standard output and error are a terminal 80 columns wide."""
    main, side = pty.openpty()
    subprocess.run(["stty", "cols", str(WIDTH)], stdin=side, check=True)
    settings = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    settings.update({"TERM": "xterm"}, **environment)
    child = subprocess.Popen([PLUMBLINE, *words], stdin=side, stdout=side, stderr=side, env=settings)
    os.close(side)
    text = b""
    try:
        while part := os.read(main, 65536):
            text += part
    except OSError:  # the child has closed its side
        pass
    child.wait(timeout=60)
    os.close(main)
    return text.decode().replace("\r\n", "\n")


def too_wide(text):
    return [line for line in text.split("\n") if len(re.sub("\033\\[[0-9;]*[mK]|\r", "", line)) > WIDTH]


def check_help(*path):
    text = printed(*path, "--help")
    check_help_text("plumbline " + " ".join((*path, "--help")), text)
    if "ommands:" in text:
        for command in re.findall(r"^  ([a-z][a-z-]+)  ", text.split("ommands:", 1)[1], re.M):
            check_help(*path, command)


def check_help_text(name, text):
    for line in too_wide(text):
        faults.append("%s: wider than %d columns: %s" % (name, WIDTH, line))
    for word in ("Excludes", "Needs:", "\n\n\n"):
        if word in text:
            faults.append("%s: contains %r" % (name, word))
    if not re.search(r"^Examples?:\n  ", text, re.M):
        faults.append("%s: has no example" % name)


check_help()
if "Subcommands:" in printed("--help"):
    faults.append("plumbline --help: a command is in no group of GroupCommands() in app/cli/main.cc")
check_help("completion")
for service in SERVICES:
    said = subprocess.run([BIN + service, "--help"], capture_output=True, text=True, timeout=60).stdout
    check_help_text(service + " --help", said)

with tempfile.TemporaryDirectory() as folder:
    cell = folder + "/cell.toml"
    with open("config/cells/ur10.toml") as original, open(cell, "w") as changed:
        text = original.read()
        changed.write("unknown_key = 1\n" + text)
    upside_down = folder + "/upside-down.toml"  # has a warning
    with open(upside_down, "w") as changed:
        assert "-9.80665" in text
        changed.write(text.replace("-9.80665", "9.80665", 1))
    piped, shown = printed("check", upside_down), on_terminal("check", upside_down)
    if not too_wide(piped):
        faults.append("check: expected a long line when piped: " + piped)
    for line in too_wide(shown):
        faults.append("check: not wrapped on a terminal: " + line)
    if "\033[33m" not in shown:
        faults.append("check: the warning has no colour on a terminal: " + shown)
    if "\033[31m" not in on_terminal("check", cell):
        faults.append("check: the fault has no colour on a terminal")
    if "\033" in piped or "\033" in on_terminal("check", upside_down, NO_COLOR="1"):
        faults.append("check: colours in a pipe or in spite of NO_COLOR")
    if " ".join(on_terminal("check", upside_down, NO_COLOR="1").split()) != " ".join(piped.split()):
        faults.append("check: wrapping changed the words")
    json = on_terminal("check", upside_down, "--json")
    if json != printed("check", upside_down, "--json"):
        faults.append("check --json: changed on a terminal")
TABLES = (
    ("beam", "--paper-table2"),
    ("beam", "--length-mm", "1800", "--section", "rectangle", "--b-mm", "50", "--h-mm", "50", "--material", "steel",
     "--force-n", "100:100:1000", "--own-weight", "--stress", "--point-mm", "900,40"),
    ("check", "tests/virtual_cell/demo/plumbline.toml"),
    ("log", "--events"),
)
for words in TABLES:
    for line in too_wide(on_terminal(*words)):
        faults.append("plumbline %s: wider than the terminal: %s" % (" ".join(words), line))

print("\n".join(faults) or "every command's help and tables fit %d columns" % WIDTH)
sys.exit(1 if faults else 0)
