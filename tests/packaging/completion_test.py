"""bash completes every command and every option that --help names, and no other.

    completion_test.py BUILD_BIN"""

import os
import re
import subprocess
import sys

BIN = os.path.abspath(sys.argv[1])
faults = []


def printed(*words):
    return subprocess.run([BIN + "/plumbline", *words], capture_output=True, text=True, timeout=60).stdout


SCRIPT = printed("completion")


def completed(*lines):
    """What bash offers for the last word of each line."""
    ask = SCRIPT + "\n"
    for words in lines:
        quoted = " ".join("'%s'" % word for word in ("plumbline", *words))
        ask += "COMP_WORDS=(%s); COMP_CWORD=%d; COMPREPLY=(); _plumbline_with_plant\n" % (quoted, len(words))
        ask += 'printf "%s " "${COMPREPLY[@]}"; echo\n'
    done = subprocess.run(["bash", "--norc", "-c", ask], capture_output=True, text=True, timeout=60)
    if done.returncode or done.stderr:
        faults.append("bash: %d, %s" % (done.returncode, done.stderr))
    return [set(line.split()) for line in done.stdout.split("\n")[: len(lines)]]


def named(text):
    options = set(re.findall(r"^  (?:-\w,)?(--[a-z][A-Za-z0-9-]+)", text, re.M))
    options |= set(re.findall(r"^  (-\w),--", text, re.M))
    commands = set(re.findall(r"^  ([a-z][a-z-]+)  ", text.split("ommands:", 1)[1], re.M)) if "ommands:" in text else set()
    return options, commands


checked = 0


def walk(path):
    global checked
    options, commands = named(printed(*path, "--help"))
    if not options:
        faults.append("plumbline %s --help names no options" % " ".join(path))
    offered, listed = completed((*path, "-"), (*path, ""))
    if offered != options:
        faults.append("plumbline %s: --help and completion differ by %s" % (" ".join(path), sorted(offered ^ options)))
    if listed != commands:
        faults.append("plumbline %s: commands differ by %s" % (" ".join(path), sorted(listed ^ commands)))
    checked += len(options) + len(commands)
    for command in sorted(commands):
        walk((*path, command))


walk(())
if checked < 150:
    faults.append("hardly any option was found: %d" % checked)
# Values from a list, a command that options stand before, a part of a word, and what is not listed.
expected = [
    (("log", "--level", ""), {"error", "warning", "notice", "info"}),
    (("log", "--level", "=", "no"), {"notice"}),
    (("log", "--level", "="), {"error", "warning", "notice", "info"}),
    (("calibrate-hand-eye", "--setup", "eye-in"), {"eye-in-hand"}),
    (("journal", "imp"), {"import"}),
    (("model", "list", "--st"), {"--state"}),
    (("check", ""), set()),
    (("plant", "rep"), {"report"}),
    (("plant", "cell", "remove", "--bro"), {"--broker-folder"}),
    (("diagnose", "cell.toml", "measured.csv", "--rep"), {"--report"}),
]
for (words, wanted), got in zip(expected, completed(*[words for words, _ in expected])):
    if got != wanted:
        faults.append("plumbline %s<TAB>: %s, not %s" % (" ".join(words), sorted(got), sorted(wanted)))
# Where nothing is listed, names of files: bash itself does that.
if "complete -o bashdefault -o default -F _plumbline_with_plant plumbline" not in SCRIPT:
    faults.append("files are not completed")
print("\n".join(faults) or "%d options and commands are completed" % checked)
sys.exit(1 if faults else 0)
