#!/usr/bin/python3
"""Not about the diagnosis: do two workers do the plant's jobs twice as fast as one?

Simulated cells are stored in a PostgreSQL of its own. Each is diagnosed by one `plumbline plant worker`, and
again, as another version, by two; each does one job at a time. Goal: at least 1.8 times as fast with 100
cells on two free processors. Checked besides: every job done once, and the same verdict each time. Exit code 1
if the goal or a check is missed; --quick uses 6 cells and judges only the checks.
"""

import argparse
import collections
import csv
import os
import pwd
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
POSTGRES = "/usr/lib/postgresql/15/bin/"
FAMILIES = ("joint_compliance@q2,q3", "gear_ratio", "thermal_growth", "link_geometry", "none")
ROBOTS = ("kr210", "ur10", "arm6")
EPOCH, GOAL = 1790000000, 1.8


def call(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError("%s: %s" % (" ".join(words), done.stderr.strip()))
    return done.stdout


class Database:
    """PostgreSQL in a folder, on a unix socket only. It refuses to run as root."""

    def __init__(self, folder):
        self.folder = folder
        self.user = []
        if os.getuid() == 0:
            account = pwd.getpwnam("postgres")
            os.chown(folder, account.pw_uid, account.pw_gid)
            self.user = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"]
        data = os.path.join(folder, "data")
        call(*self.user, POSTGRES + "initdb", "-D", data, "-U", "owner", "--no-sync", "-A", "trust", "-E", "UTF8")
        self.process = subprocess.Popen(
            [*self.user, POSTGRES + "postgres", "-D", data, "-c", "listen_addresses=", "-c", "fsync=off",
             "-c", "unix_socket_directories=" + folder],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(600):
            if subprocess.run(["psql", "-h", folder, "-U", "owner", "-c", "", "postgres"],
                              capture_output=True).returncode == 0:
                break
            time.sleep(0.1)
        self.run("CREATE DATABASE plumbline", "postgres")
        self.settings = "host=%s dbname=plumbline user=owner" % folder

    def run(self, sql, name="plumbline"):
        done = subprocess.run(["psql", "-h", self.folder, "-U", "owner", "-v", "ON_ERROR_STOP=1", "-qAt", name],
                              input=sql, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return done.stdout.splitlines()

    def stop(self):
        self.process.send_signal(signal.SIGQUIT)
        self.process.wait()


def sql_of_cell(number, folder):
    """Statements that store a simulated cell as plumbline-collect does."""
    with open(os.path.join(folder, "cell.toml")) as file:
        toml = file.read()
    with open(os.path.join(folder, "measured.csv")) as file:
        rows = list(csv.DictReader(file))
    lines = [
        "INSERT INTO plumbline.cell (line, node) VALUES ('line-1', 'cell-%03d');" % number,
        "INSERT INTO plumbline.cell_file SELECT max(cell), to_timestamp(%d), 'f', 1, $toml$%s$toml$"
        " FROM plumbline.cell;" % (EPOCH, toml),
        "SELECT plumbline.ensure_month(to_timestamp(%d)) \\g /dev/null" % EPOCH,
        "COPY plumbline.probe (cell, stream, seq, utc, journal, id, model, x_mm, y_mm, z_mm, payload_kg, temp_c,"
        " wild, alarm, quarantined, source, session, q) FROM STDIN;",
    ]
    for k, row in enumerate(rows, 1):
        joints = ",".join(row[name] for name in row if name.startswith("q") and name.endswith("_deg")
                          and name[1:-4].isdigit())
        utc = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(EPOCH + 10 * k))
        lines.append("\t".join([str(number), "1", str(k), utc, str(EPOCH), str(k), "1", row["x_mm"], row["y_mm"],
                                row["z_mm"], row.get("payload_kg") or "\\N", row.get("temp_C") or "\\N", "f", "f",
                                "f", "plc", row.get("session") or "s", "{%s}" % joints]))
    return "\n".join([*lines, "\\.", ""])


def seconds_with(workers, plant, program, database, version):
    """Runs so many workers until the queue is empty. @return seconds"""
    call(plant, "schedule", "--database", database.settings, "--kind", "compare", "--program-version", version)
    words = [plant, "worker", "--once", "--jobs", "1", "--program", program, "--database", database.settings]
    start = time.monotonic()
    running = [subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
               for _ in range(workers)]
    codes = [one.wait() for one in running]
    if any(codes):
        raise RuntimeError("a worker ended with %s" % codes)
    return time.monotonic() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(ROOT, "build/bin/plumbline-simulate"))
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--rows", type=int, default=60)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="6 cells of 30 rows; the ratio is not judged")
    options = parser.parse_args()
    if options.quick:
        options.cells, options.rows = 6, 30
    if not os.path.exists(POSTGRES + "postgres"):
        print("skipped: no PostgreSQL 15 (install postgresql-15)")
        return 77
    plant = os.path.join(os.path.dirname(os.path.abspath(options.product)), "plumbline-plant")
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        store = os.path.join(folder, "database")
        os.mkdir(store)
        database = Database(store)
        try:
            call(plant, "init", "--database", database.settings)
            for number in range(1, options.cells + 1):
                made = os.path.join(folder, "cell")
                call(options.simulate, "--family", FAMILIES[number % len(FAMILIES)], "--robot",
                     ROBOTS[number % len(ROBOTS)], "--seed", str(options.first_seed + number), "--rows",
                     str(options.rows), "--signal", "10", "--out", made)
                database.run(sql_of_cell(number, made))
            # The workers know the version that they print; each round is for a program of its own bytes.
            seconds, versions = {}, []
            for workers in (1, 2):
                program = os.path.join(folder, "plumbline-%d" % workers)
                with open(program, "w") as file:
                    file.write("#!/bin/sh\n# %d\nexec %s \"$@\"\n" % (workers, os.path.abspath(options.product)))
                os.chmod(program, 0o755)
                printed = subprocess.run([plant, "worker", "--once", "--program", program, "--database",
                                          database.settings], capture_output=True, text=True).stderr
                versions.append(printed.split(": version ", 1)[1].splitlines()[0])
                seconds[workers] = seconds_with(workers, plant, program, database, versions[-1])
            done = database.run("SELECT count(*), count(DISTINCT job), count(DISTINCT (program, worker))"
                                " FROM plumbline.result")[0]
            jobs = database.run("SELECT count(*), count(*) FILTER (WHERE failed IS NULL AND attempts = 1)"
                                " FROM plumbline.job")[0]
            differing = database.run(
                "SELECT count(*) FROM (SELECT cell FROM plumbline.job JOIN plumbline.result USING (job)"
                " GROUP BY cell HAVING count(DISTINCT output - 'plant') <> 1) AS differing")[0]
            verdicts = collections.Counter(database.run(
                "SELECT coalesce(output->>'verdict', 'refused') FROM plumbline.result"))
        finally:
            database.stop()
    ratio = seconds[1] / seconds[2]
    print("%d cells of %d rows: one worker %.1f s, two workers %.1f s: %.2f times as fast (goal: %.1f)" %
          (options.cells, options.rows, seconds[1], seconds[2], ratio, GOAL))
    print("verdicts: " + ", ".join("%s %d" % one for one in sorted(verdicts.items())))
    print("load of the machine: %s; processors: %d" % (" ".join("%.1f" % x for x in os.getloadavg()), os.cpu_count()))
    expected = 2 * options.cells
    faults = []
    if done != "%d|%d|3" % (expected, expected) and done != "%d|%d|2" % (expected, expected):
        faults.append("results, distinct jobs and workers: %s" % done)
    if jobs != "%d|%d" % (expected, expected):
        faults.append("jobs, and those done at the first attempt: %s" % jobs)
    if differing != "0":
        faults.append("%s cells have another answer in the second round" % differing)
    if not options.quick and ratio < GOAL:
        faults.append("goal missed: %.2f < %.1f" % (ratio, GOAL))
    print("\n".join(faults) or "every job done once, with the same answer in both rounds")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
