"""Every relative link of an installed document leads to an installed file; ./dev build makes every
program that is installed; bash finds the completions; the bill of materials names every package that a
program is linked with; OpenCV's image codecs, cairo and FCL are each linked to a
module only, and libavcodec to nothing.

    package_files_test.py CMAKE BUILD"""

import json
import os
import re
import subprocess
import sys
import tempfile

cmake, build = sys.argv[1], os.path.abspath(sys.argv[2])
faults = []
CODECS = "usr/lib/plumbline/plumbline-image-codecs.so"
SHEETS = "usr/lib/plumbline/plumbline-sheets.so"
INTERFERENCE = "usr/lib/plumbline/plumbline-interference.so"
MODULES = {CODECS, SHEETS, INTERFERENCE}
with tempfile.TemporaryDirectory() as root:
    installed = subprocess.run(
        [cmake, "--install", build, "--prefix", "/usr"],
        env={**os.environ, "DESTDIR": root},
        capture_output=True,
        text=True,
    )
    if installed.returncode:
        sys.exit("cmake --install: " + installed.stderr)
    files = {
        os.path.relpath(os.path.join(folder, name), root)
        for folder, _, names in os.walk(root)
        for name in names
    }
    links = 0
    for document in sorted(name for name in files if name.endswith(".md")):
        text = open(os.path.join(root, document)).read()
        for link in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:|#", link):
                continue
            links += 1
            target = os.path.normpath(os.path.join(os.path.dirname(document), link.split("#")[0]))
            if target not in files:
                faults.append("%s: its link %s leads to nothing that is installed" % (document, link))
    # Whatever a program is linked with is loaded at each of its starts.
    needed = {
        name: re.findall(
            r"NEEDED.*\[(.*)\]",
            subprocess.run(
                ["readelf", "-d", os.path.join(root, name)], capture_output=True, text=True
            ).stdout,
        )
        for name in files
        if name.startswith("usr/bin/") or name in MODULES
    }
    if links < 1:
        faults.append("no link was found in the installed documents")
    bill = os.path.join(root, "usr/share/doc/plumbline/plumbline.cdx.json")
    listed = {}
    if os.path.exists(bill):
        listed = {one["name"]: one for one in json.load(open(bill))["components"]}
    libraries = {
        os.path.realpath(path)
        for name in needed
        for path in re.findall(
            r"=> (/\S+)",
            subprocess.run(["ldd", os.path.join(root, name)], capture_output=True, text=True).stdout,
        )
    }
    owners = subprocess.run(
        ["dpkg-query", "-S", *libraries, *(path.replace("/usr/lib/", "/lib/", 1) for path in libraries)],
        capture_output=True,
        text=True,
    ).stdout
    linked = set(re.findall(r"^([^:\s]+)\S*: /", owners, re.M))
    for package in sorted(linked - set(listed)):
        faults.append("the bill of materials lacks %s, which a program is linked with" % package)
    for package in ("libceres-dev", "libeigen3-dev", "gnuplot-nox"):
        if package not in listed:
            faults.append("the bill of materials lacks %s" % package)
    if len(linked) < 20 or not all(listed[name].get("version") for name in linked & set(listed)):
        faults.append("the bill of materials: %d linked packages, each with a version?" % len(linked))

if "usr/share/bash-completion/completions/plumbline" not in files:
    faults.append("no completions for bash are installed")
if not any("opencv_imgcodecs" in library for library in needed.get(CODECS, [])):
    faults.append("%s is not installed, or without OpenCV's codecs" % CODECS)
if not any("cairo" in library for library in needed.get(SHEETS, [])):
    faults.append("%s is not installed, or without cairo" % SHEETS)
if not any("fcl" in library for library in needed.get(INTERFERENCE, [])):
    faults.append("%s is not installed, or without FCL" % INTERFERENCE)
for name in sorted(set(needed) - MODULES):
    if not needed[name]:
        faults.append("%s: readelf names no library of it" % name)
    for library in needed[name]:
        if re.search("opencv_(imgcodecs|aruco)|cairo|avcodec|fcl", library):
            faults.append("%s is linked with %s: loaded at each start" % (name, library))
# What README.md and docs/ have somebody run after ./dev build is there then.
words = re.search(r"^programs=\((.*)\)$", open("dev").read(), re.M)
built = set(words.group(1).split()) if words else set()
programs = {name.split("/")[-1] for name in files if name.startswith("usr/bin/")}
if programs != built:
    faults.append("installed, or built by ./dev build, only: %s" % sorted(programs ^ built))
print("\n".join(faults) or "%d links, %d programs" % (links, len(programs)))
sys.exit(1 if faults else 0)
