#!/usr/bin/python3
"""Stands in for plumbline in the harness's own tests: it reads truth.json beside the data, so that
every rate of a right harness is perfect. With PLUMBLINE_LIES set it names something else."""

import json
import os
import shutil
import sys

command, first, second = sys.argv[1:4]
option = dict(zip(sys.argv[4::2], sys.argv[5::2]))
folder = os.path.dirname(second)
with open(os.path.join(folder, "truth.json")) as file:
    truth = json.load(file)
if command == "predict":
    shutil.copy(os.path.join(folder, "test_truth.csv"), option["--out"])
    sys.exit()
effects = truth["effects"]
for effect in effects:
    for parameter in effect["parameters"]:
        parameter["sd"] = abs(parameter["value"]) * 0.01
if os.environ.get("PLUMBLINE_LIES"):
    answer = {"verdict": "explained", "effects": [{"id": "tool_shear", "parameters": []}]}
elif not effects:
    answer = {"verdict": "no_effect", "effects": []}
elif not truth["in_catalogue"]:
    answer = {"verdict": "unknown", "effects": [], "drivers": truth["drivers"]}
else:
    verdict = os.environ.get("PLUMBLINE_VERDICT", "explained")
    answer = {"verdict": verdict, "effects": effects, "rivals": []}
with open(option["--json"], "w") as file:
    json.dump(answer, file)
open(option["--write-model"], "w").close()
