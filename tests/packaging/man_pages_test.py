"""Each program has its page, and page and --help name the same options and commands.

    man_pages_test.py BUILD_BIN"""

import pathlib
import re
import subprocess
import sys

BIN = sys.argv[1]
PAGES = {"plumbline": 1, "plumbline-mesh": 1, "plumbline-dv": 1, "plumblined": 8, "plumbline-view": 8, "plumbline-fleet": 8,
         "plumbline-collect": 8, "plumbline-sparkplug": 8}
NOT_IN_PAGES = {"--help", "--help-all"}


def help_of(*words):
    told = subprocess.run([BIN + "/" + words[0], *words[1:], "--help"], capture_output=True, text=True, timeout=60)
    return told.stdout + told.stderr


def page_of(program):
    text = open("packaging/man/%s.%d" % (program, PAGES[program])).read()
    return text.replace("\\-", "-")


def options(text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text)) - NOT_IN_PAGES


faults = []
for program in PAGES:
    page, told = page_of(program), help_of(program)
    # plumbline's page names its commands; their options stand in the help of each.
    listed = re.findall(r"^  ([a-z][a-z-]+)  ", told.split("ommands:", 1)[-1], re.M) if program == "plumbline" else []
    in_page = re.findall(r"^\.TP\n\.B ([a-z][a-z-]+)$", page, re.M)
    for command in sorted(set(listed) ^ set(in_page) if listed else ()):
        faults.append("%s: the command %s stands in one of page and help only" % (program, command))
    if program == "plumbline" and len(listed) < 15:
        faults.append("plumbline --help lists no commands: " + told)
    known = options(told)
    for command in listed:
        known |= options(help_of(program, command))
        for part in re.findall(r"^  ([a-z][a-z-]+)  ", help_of(program, command).split("ubcommands:", 1)[-1], re.M):
            known |= options(help_of(program, command, part))
    for option in sorted(options(page) - known - {"--now"}):  # of systemctl
        faults.append("%s: its page names %s, which is none" % (program, option))
    if program != "plumbline":
        for option in sorted(options(told) - options(page)):
            faults.append("%s: its page does not name %s" % (program, option))
    version = subprocess.run([BIN + "/" + program, "--version"], capture_output=True, text=True).stdout
    if program not in ("plumbline-mesh", "plumbline-dv") and not re.search(r"\d+\.\d+\.\d+", version):
        faults.append("%s --version says %r" % (program, version))

# What the documents have somebody type must exist: the commands, and their options.
commands = {command: help_of("plumbline", command)
            for command in re.findall(r"^  ([a-z][a-z-]+)  ", help_of("plumbline").split("ommands:", 1)[-1], re.M)}
checked = 0
for document in ["README.md", *map(str, pathlib.Path("docs").rglob("*.md"))]:
    text = open(document).read().replace("\\\n", " ")
    for line in re.findall(r"(?:^ {4,}|`|&& )(?:sudo )?(?:\.\./)?(?:build/bin/)?plumbline ([^`\n#&|;]+)", text, re.M):
        words = line.split()
        if words[0] == "--version" or not re.fullmatch(r"[a-z-]+", words[0]) or words[0] == "...":
            continue
        if words[0] not in commands:
            faults.append("%s: plumbline %s is no command" % (document, words[0]))
            continue
        part = [words[1]] if len(words) > 1 and re.search(r"^  %s  " % re.escape(words[1]), commands[words[0]], re.M) else []
        told = help_of("plumbline", words[0], *part) + commands[words[0]]
        for option in options(line):
            checked += 1
            if option not in told:
                faults.append("%s: plumbline %s has no %s" % (document, " ".join([words[0]] + part), option))
# Each command's help has an example of it.
leaves = 0
for command, told in commands.items():
    parts = re.findall(r"^  ([a-z][a-z-]+)  ", told.split("ubcommands:", 1)[1], re.M) if "ubcommands:" in told else [None]
    for part in parts:
        words = [command] + ([part] if part else [])
        leaves += 1
        example = (help_of("plumbline", *words) if part else told).split("Example", 1)
        if len(example) < 2 or "plumbline " + " ".join(words) not in example[1]:
            faults.append("plumbline %s --help has no example" % " ".join(words))
if leaves < 25:
    faults.append("hardly any command was found: %d" % leaves)

# Trying a cell without a robot: the registers that the virtual cell can serve stand in docs/commission.md.
virtual = help_of("plumbline-virtual-cell")
profiles = re.search(r"--profile [^\n]*\{([a-z,]+)\}", virtual)
section = re.search(r"^## Trying a cell without a robot\n(.*?)^## ", open("docs/commission.md").read(), re.M | re.S).group(1)
for profile in profiles.group(1).split(",") if profiles else ["(none in --help)"]:
    if not re.search(r"^\| `%s`" % profile, section, re.M):
        faults.append("docs/commission.md: where the virtual cell is explained, --profile %s is not" % profile)

if checked < 20:
    faults.append("hardly any option was found in the documents: %d" % checked)
print("\n".join(faults) or "%d pages, %d commands, %d options of the documents" % (len(PAGES), len(commands), checked))
sys.exit(1 if faults else 0)
