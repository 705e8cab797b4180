"""Every example command of README.md, docs/ and each --help runs once, beside a virtual cell, or is listed
below with the reason why it cannot run here.

    examples_test.py BUILD_BIN

It runs in a mount, network and process namespace of its own, where /etc/plumbline, /etc/mosquitto, /var/lib/plumbline,
/usr/share/plumbline and /usr/share/doc are its own, with the broker and the database of a plant. Skipped without root's
rights, which the database needs to change its user, and where namespaces cannot be created."""

import importlib.machinery
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = os.getcwd()
sys.path.insert(0, ROOT + "/tests/plant_cells")
import plant_station  # noqa: E402

BIN = os.path.abspath(sys.argv[1])
# reference/commands.md repeats each --help; the commands of paper.md need a build's tests or the demo.
DOCUMENTS = ["README.md", *sorted(str(path) for path in pathlib.Path("docs").rglob("*.md")
                                  if path.name not in ("commands.md", "paper.md"))]
INSIDE = "PLUMBLINE_EXAMPLES_INSIDE"
# Commands that cannot run here. Each pattern must match a line of the documents, or it is removed.
NOT_HERE = [
    (r"^\./dev ", "builds, installs packages, or runs this test"),
    (r"^(sudo )?apt ", "installs a package"),
    (r"^(sudo )?systemctl ", "needs systemd; the units run in ./dev rig"),
    (r"^(sudo )?(editor|\$EDITOR) ", "a person edits a file"),
    (r"^journalctl ", "needs systemd's journal"),
    (r"^tar -C / ", "replaces the state of the computer; backup_test runs it"),
    (r"^chown -R plumbline:", "needs the package's user"),
    (r"^(\S*/)?plumbline cameras", "needs a camera"),
    (r"--camera A1B2C3", "needs a camera"),
    (r"^(\S*/)?plumbline log ", "needs systemd's journal"),
    (r"^mv /var/lib/plumbline ", "moves the state away; backup_test replaces it"),
    (r"import-urdf|export-urdf", "needs the URDF of a robot; import_test and export_test have one"),
    (r"plumbline identify-controller ", "needs postures with a controller's poses; controller_models.py makes some"),
    (r"plumbline track |--images frames", "needs photographs of tags or a board; track_command_test and calibrate_lens_command_test have some"),
    (r"plumbline lens (list|export|solve)\b", "needs a stored lens and its views; lens_command_test has them"),
    (r"plumbline program .*(weld|PICK|HANDLING)", "needs the files of a controller; programs.py has some"),
    (r"plumbline mesh check ", "needs a mesh; mesh_command_test has some"),
    (r"^(\S*/)?plumbline distance |--distances", "needs an object table and a renderer; view_process_test has both"),
    (r"plumbline snapshot |--snapshot", "needs a renderer; view_process_test draws"),
    (r"plumbline import (tracker|table)\.csv|plumbline import gauge\.txt", "needs the files of an instrument; import_command_test has some"),
    (r"--artefacts left_0", "needs a cell with artefacts; measurement_plan_test has one"),
    (r"plan cell.toml --tool 2", "needs a cell with numbered tools; numbered_tools_test has one"),
    (r"plumbline journal quarantine (accept|reject)", "needs rows in quarantine; loop_test has some"),
    (r"plumbline journal salvage", "needs a damaged journal; integrity_test damages one"),
    (r"plumbline model (apply|rollback|show|propose)", "needs a proposal of this cell; backup_test and ./dev demo apply one"),
    (r"corrected.toml poses.csv --align|--align session2.csv", "needs a second session; predict_command_test has one"),
    (r"/opt/new/bin/plumbline", "needs another version; plant_worker_test makes one"),
    (r"createdb plumbline$", "plant_of_examples has made it"),
    (r"mosquitto_passwd ", "asks for a password"),
    (r"plumbline registers scan ", "needs a controller without a profile; register_maps_test plays some"),
    (r"\| jq ", "needs jq"),
    (r"my-cell/plumbline.toml", "the file that a person has edited; check and start of the shipped one run"),
]
ARM_MODEL = "KR 210 R2700-2"
# A lens as ROS stores it, for the example of explain.
CAMERA_INFO = """image_width: 1280
image_height: 720
camera_name: left
camera_matrix: {rows: 3, cols: 3, data: [900, 0, 640, 0, 900, 360, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.01, 0, 0, 0]}
"""
# Programs that run until they are stopped: they must still run after a moment, and end on SIGTERM.
RUNS_ON = r"^(\S*/)?(plumblined|plumbline-(view|virtual-cell|fleet|collect|sparkplug))\b(?!.*--version)|journal tail|plant (page|worker)\b(?!.*--once)"
# Commands whose exit code states a finding about this computer or cell.
MAY_FIND = {r"plumbline doctor": (0, 1), r"plumbline (plant )?status": (0, 1)}
OWN_FOLDERS = ("/etc", "/var/lib", "/usr/share")


def programs():
    return sorted(name for name in os.listdir(BIN) if re.fullmatch(r"plumbline\w*|plumbline-(view|mesh|dv|fleet|plant|collect|sparkplug)", name))


def help_of(*words):
    done = subprocess.run([os.path.join(BIN, words[0]), *words[1:], "--help"], capture_output=True, text=True, timeout=60)
    return done.stdout + done.stderr


def is_command(line):
    """Whether an indented line is a command, and no output, table or file content."""
    words = re.sub(r"^sudo (-u \w+ )?", "", line).split()
    return bool(words) and (words[0] == "for" or words[0].startswith(("./dev", "../build/", "build/bin/", "$EDITOR")) or (
        re.fullmatch(r"[a-z][\w-]*", words[0]) and (words + ["="])[1][:1] not in ("=", ":", "|") and
        (words[0].startswith("plumbline") or shutil.which(words[0]) or words[0] in ("cd", "editor", "systemctl"))
        and (words[0].startswith("plumbline") or len(words) > 1) and not line.endswith((".", ","))))


def commands_in(text, indent):
    """Lists of the commands of each block of indented or fenced lines: continued lines joined, comments removed."""
    blocks, block, fenced = [], [], False
    for line in re.sub(r" *\\\n\s*", " ", text).split("\n") + [""]:
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith(indent):
            command = re.sub(r"\s+# .*$", "", line.strip()).removeprefix("$ ")
            if is_command(command):
                block.append(command)
        elif block and line.strip():
            blocks.append(block)
            block = []
    return blocks + [block] if block else blocks


def examples():
    """{source: blocks of commands}"""
    found = {name: commands_in(open(name).read(), "    ") for name in DOCUMENTS}
    for program in programs():
        text = help_of(program)
        found[program + " --help"] = commands_in(text.partition("Example")[2], "  ")
        names = re.findall(r"^  ([a-z][a-z-]+)  ", text.split("ommands:", 1)[-1], re.M) if program == "plumbline" else []
        for name in names:
            whole = help_of(program, name)
            parts = re.findall(r"^  ([a-z][a-z-]+)  ", whole.split("ubcommands:", 1)[1], re.M) if "ubcommands:" in whole else []
            for words in [(name,)] + [(name, part) for part in parts]:
                found["plumbline %s --help" % " ".join(words)] = commands_in(help_of(program, *words).partition("Example")[2], "  ")
    return found


def own_view(folder, scratch):
    """Replaces `folder` by one of our own that shows the same entries and may be written."""
    lower, upper = (scratch + "/" + kind + folder.replace("/", "-") for kind in ("lower", "upper"))
    os.makedirs(lower)
    os.makedirs(upper)
    subprocess.run(["mount", "--bind", folder, lower], check=True)
    subprocess.run(["mount", "-o", "remount,bind,ro", lower], check=True)  # no example writes to the computer's own files
    for name in os.listdir(lower):
        if name in ("mosquitto", "doc") and folder != "/var/lib":
            os.makedirs(upper + "/" + name)
        elif name != "plumbline":
            os.symlink(lower + "/" + name, upper + "/" + name)
    os.makedirs(upper + "/plumbline")
    subprocess.run(["mount", "--bind", upper, folder], check=True)


def run(command, folder, environment, timeout_s=240):
    """Exit code and output."""
    try:
        done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=timeout_s)
    except subprocess.TimeoutExpired:
        return 124, "did not end within %d s" % timeout_s
    return done.returncode, done.stdout


def prepare(folder, started):
    """The files that the examples name, a configuration at its place, and the programs beside it, added to `started`."""
    os.symlink(ROOT + "/build", folder + "/build")
    shutil.copytree(ROOT + "/config", folder + "/config")
    os.makedirs(folder + "/tests")
    os.symlink(ROOT + "/tests/virtual_cell", folder + "/tests/virtual_cell")
    for number in range(1, 5):
        out = "%s/arm-%d" % (folder, number)
        subprocess.run([BIN + "/plumbline-simulate", "--family", "joint_compliance@q2,q3", "--robot", "ur10", "--rows", "60",
                        "--seed", str(number), "--out", out + "/data"], check=True, stdout=subprocess.DEVNULL)
        cell = open(out + "/data/cell.toml").read()
        open(out + "/cell.toml", "w").write(cell.replace("[robot]\n", '[robot]\nmodel = "%s"\n' % ARM_MODEL, 1))
        shutil.copy(out + "/data/measured.csv", out)
    os.makedirs(folder + "/delivery")
    for name in ("cell.toml", "measured.csv"):
        shutil.copy(folder + "/arm-1/" + name, folder)
        shutil.copy(folder + "/arm-1/" + name, folder + "/delivery")
    for example in ("ur/pick.script", "path.csv"):
        shutil.copy("%s/packaging/examples/%s" % (ROOT, example), folder)
    open(folder + "/camera.yaml", "w").write(CAMERA_INFO)
    for name in ("cells", "profiles"):
        shutil.copytree(ROOT + "/config/" + name, "/usr/share/plumbline/" + name)
    text = open("tests/virtual_cell/demo/plumbline.toml").read()
    text += '\n[mqtt]\nhost = "127.0.0.1"\nport = 1883\ngroup = "line-1"\nnode = "cell-1"\n'
    for old, new in (('"cockpit-cell.toml"', '"%s/tests/virtual_cell/demo/cockpit-cell.toml"' % ROOT), ("../../..", ROOT),
                     ('"/tmp/plumbline-demo"', '"/var/lib/plumbline"'), ("port = 15020", "port = 502")):
        assert old in text, old
        text = text.replace(old, new)
    for place in ("/etc/plumbline/plumbline.toml", folder + "/plumbline.toml"):
        open(place, "w").write(text if place.startswith("/etc") else text.replace("port = 502", "port = 1502").replace(
            '"/var/lib/plumbline"', '"%s/state"' % folder))
    started.append(subprocess.Popen([BIN + "/plumbline-virtual-cell", "--cell", "tests/virtual_cell/demo/cockpit-cell.toml", "--idle",
                                 "--profile", "generic", "--port", "15502", "--port-file", folder + "/cell.ports"],
                                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL))
    for place in ("/etc/plumbline/plumbline.toml", folder + "/plumbline.toml"):
        started.append(subprocess.Popen([BIN + "/plumblined", place, "--port-file", place + ".ports"], stderr=open(place + ".log", "w")))
        give_up = time.monotonic() + 30
        while not os.path.exists(place + ".ports"):
            assert started[-1].poll() is None and time.monotonic() < give_up, open(place + ".log").read()
            time.sleep(0.05)


def plant_of_examples(folder, processes):
    """A broker, and a database that the collector has filled with three cells of line-2, added to `processes`. Returns the
    environment that libpq reads."""
    home = folder + "/plant"
    os.makedirs(home + "/cells")
    loader = importlib.machinery.SourceFileLoader("plant_demo", ROOT + "/tests/plant_cells/demo/run")
    demo = importlib.util.module_from_spec(importlib.util.spec_from_loader("plant_demo", loader))
    loader.exec_module(demo)
    demo.BIN = BIN
    for number in (7, 8, 9):
        demo.record(home + "/cells", "cell-%d" % number, ARM_MODEL, number)
    broker = plant_station.Broker(home, "listener 1883 127.0.0.1\n")
    processes.append(broker)
    server = plant_station.Postgres(home, lines="listen_addresses = '127.0.0.1'\n")
    processes.append(server)
    plant_station.new_plant(BIN, server)
    server.ask("CREATE ROLE root SUPERUSER LOGIN")  # whom the examples call postgres
    for statement in re.findall(r"^    ((?:CREATE ROLE|SELECT)[^;]*);", open("docs/plant.md").read(), re.M):
        server.ask("SET search_path = plumbline; " + statement)
    collector = plant_station.Collector(BIN, home, broker, server.settings())
    processes.append(collector)
    collector.wait()
    processes.append(plant_station.Cells(BIN, home, broker, "--folder", home + "/cells", "--start-days", str(demo.DAYS),
                                         "--line", "line-2"))
    expected = str(3 * demo.DAYS * demo.PER_DAY)
    assert plant_station.soon(lambda: server.ask("SELECT count(*) FROM plumbline.probe") == expected), open(collector.log).read()
    processes.append(plant_station.Process([BIN + "/plumbline-plant", "worker", "--database", server.settings()],
                                           home + "/worker.log"))
    for place in ("/etc/plumbline", folder):
        plant_station.write_config(place + "/plant.toml", broker, server.settings())
    with open("/etc/hosts", "w") as hosts:
        hosts.write("127.0.0.1 localhost db1\n")
    return {"PGHOST": server.sockets, "PGPORT": str(server.port)}


def main():
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    faults, ran, listed, used = [], 0, 0, set()
    found = examples()
    scratch, plant, started = os.environ[INSIDE], [], []
    try:
        for folder in OWN_FOLDERS:
            own_view(folder, scratch)
        os.remove("/etc/hosts")
        shutil.copytree(ROOT + "/config/plant", "/usr/share/doc/plumbline/examples/plant")
        work, stubs = scratch + "/work", scratch + "/bin"
        os.makedirs(work)
        os.makedirs(stubs)
        open(stubs + "/sudo", "w").write('#!/bin/sh\n[ "$1" != -u ] || shift 2\nexec "$@"\n')
        os.chmod(stubs + "/sudo", 0o755)
        environment = dict(os.environ, PATH="%s:%s:%s" % (stubs, BIN, os.environ["PATH"]), HOME=scratch)
        environment.update(plant_of_examples(work, plant))
        prepare(work, started)
        done = set()
        for source, blocks in found.items():
            for block in blocks:
                folder = work
                for command in block:
                    reasons = [pattern for pattern, _ in NOT_HERE if re.search(pattern, command)]
                    used.update(reasons)
                    if reasons or (command, folder) in done:
                        listed += bool(reasons)
                        continue
                    done.add((command, folder))
                    ran += 1
                    allowed, line = (0,), command
                    if re.search(RUNS_ON, command):  # beside no other daemon, whose port and state it would share
                        line, allowed = "timeout 5 " + command, (124,)
                        if re.search("plumblined|plumbline-virtual-cell", command):
                            line = ("unshare --net --mount sh -c 'ip link set lo up; mount -t tmpfs tmpfs /var/lib/plumbline; "
                                    "exec %s'" % line)
                    for pattern, codes in MAY_FIND.items():
                        allowed = codes if re.search(pattern, command) else allowed
                    own = tempfile.mkdtemp(dir=scratch) if " > " in command else folder  # overwrites nothing
                    code, output = run(line, own, environment)
                    if code not in allowed:
                        faults.append("%s: exit code %d of: %s\n    %s" % (source, code, command, "\n    ".join(output.strip().split("\n")[-6:])))
                    moved = re.search(r"(?:^|&& )cd (\S+)$", command)
                    folder = os.path.join(folder, moved.group(1)) if moved and code == 0 else folder
    finally:
        for process in started:
            process.kill()
            process.wait()
        for process in reversed(plant):
            process.stop()
    faults += ["no example matches %s any more: remove it from NOT_HERE" % pattern for pattern, _ in NOT_HERE if pattern not in used]
    if ran < 40 or not found["README.md"] or not any(found[name] for name in DOCUMENTS[1:]):
        faults.append("hardly any example was found: %d" % ran)
    print("\n".join(faults) or "%d example commands ran, %d cannot run here" % (ran, listed))
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    if os.environ.get(INSIDE):
        main()
    inside = ["unshare", "--mount", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if os.getuid() != 0 or subprocess.run(inside + ["true"], capture_output=True).returncode != 0:
        print("SKIPPED: needs root's rights, and a computer that lets a test create namespaces")
        sys.exit(77)
    # Removed out here, where nothing is mounted in it: in there it holds the computer's own folders.
    with tempfile.TemporaryDirectory() as scratch:
        done = subprocess.run(inside + [sys.executable, "-B"] + sys.argv, env=dict(os.environ, **{INSIDE: scratch}))
    sys.exit(done.returncode)
