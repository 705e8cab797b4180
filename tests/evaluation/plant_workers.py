#!/usr/bin/python3
"""Not about the diagnosis: do two workers do the plant's jobs twice as fast as one, and none twice under faults?

Simulated cells are stored in a PostgreSQL of its own. Each is diagnosed by one `plumbline plant worker`, and
again, as another version, by two; each does one job at a time. Goal: at least 1.8 times as fast with 100
cells on two free processors, every job done once with the same answer. Then a third time, while workers are
killed ten times and the database's primary is killed once and its standby promoted. Goal: no job without a
result, none with two, each answer as before. Exit code 1 if a goal is missed; --quick uses 6 cells and two
kills, and does not judge the ratio.
"""

import argparse
import collections
import csv
import os
import random
import signal
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "tests/plant_cells"))
import plant_station as station  # noqa: E402

FAMILIES = ("joint_compliance@q2,q3", "gear_ratio", "thermal_growth", "link_geometry", "none")
ROBOTS = ("kr210", "ur10", "arm6")
EPOCH, GOAL = 1790000000, 1.8


def call(*words, text=None):
    done = subprocess.run(words, capture_output=True, text=True, input=text)
    if done.returncode != 0:
        raise RuntimeError("%s: %s" % (" ".join(words), done.stderr.strip()))
    return done


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


class Round:
    """The cells diagnosed by a version of its own: a script that starts the product."""

    def __init__(self, number, folder, options, connection):
        self.plant = os.path.join(os.path.dirname(os.path.abspath(options.product)), "plumbline-plant")
        self.program = os.path.join(folder, "plumbline-%d" % number)
        self.log = os.path.join(folder, "workers-%d.log" % number)
        self.connection, self.count = connection, options.cells
        with open(self.program, "w") as file:
            file.write("#!/bin/sh\n# %d\nexec %s \"$@\"\n" % (number, os.path.abspath(options.product)))
        os.chmod(self.program, 0o755)
        printed = call(self.plant, "worker", "--once", "--program", self.program, "--database", connection).stderr
        self.version = printed.split(": version ", 1)[1].splitlines()[0]
        call(self.plant, "schedule", "--database", connection, "--kind", "compare", "--program-version", self.version)

    def worker(self, *words):
        return station.Process([self.plant, "worker", "--jobs", "1", "--program", self.program, "--database",
                                self.connection, *words], self.log)

    def seconds_with(self, workers):
        """Until the queue is empty."""
        start = time.monotonic()
        running = [self.worker("--once") for _ in range(workers)]
        codes = [one.child.wait() for one in running]
        if any(codes):
            raise RuntimeError("a worker ended with %s: %s" % (codes, open(self.log).read()[-2000:]))
        return time.monotonic() - start

    def faults(self, server, first):
        """What is wrong with the results: jobs that are not done, done twice, or differ from the first round."""
        version, answer = "version = $v$%s$v$" % self.version, "SELECT cell, output - 'plant' AS answer"
        done, distinct, open_jobs, failed = map(int, server.rows(
            "SELECT count(result.job), count(DISTINCT cell) FILTER (WHERE result.job IS NOT NULL),"
            " count(*) FILTER (WHERE finished IS NULL), count(*) FILTER (WHERE failed IS NOT NULL)"
            " FROM plumbline.job LEFT JOIN plumbline.result USING (job) WHERE " + version)[0])
        differing = int(server.ask(
            "SELECT count(*) FROM (%s FROM plumbline.job JOIN plumbline.result USING (job) WHERE version = $v$%s$v$) a"
            " JOIN (%s FROM plumbline.job JOIN plumbline.result USING (job) WHERE %s) b USING (cell)"
            " WHERE a.answer <> b.answer" % (answer, first.version, answer, version)))
        found = {"lost": self.count - distinct, "doubled": done - distinct, "still open": open_jobs,
                 "failed": failed, "with another answer": differing}
        return ["%s: %d" % one for one in found.items() if one[1] != 0]


def under_faults(third, primary, standby, kills, seed):
    """Two workers, killed at random moments and started again; the primary is killed halfway."""
    draw = random.Random(seed)
    workers = [third.worker("--lease-s", "5") for _ in range(2)]
    open_jobs = "SELECT count(*) FROM plumbline.job WHERE finished IS NULL"
    server = primary
    for kill in range(kills):
        time.sleep(draw.uniform(0.5, 3))
        if kill == kills // 2:
            primary.stop(signal.SIGKILL)
            standby.promote()
            server = standby
        victim = draw.randrange(2)
        workers[victim].stop(signal.SIGKILL)
        workers[victim].start()
    ended = station.soon(lambda: server.ask(open_jobs) == "0", 600, 0.5)
    for worker in workers:
        worker.stop()
    return [] if ended else ["the queue was not empty after 600 s"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--product", default=os.path.join(ROOT, "build/bin/plumbline"))
    parser.add_argument("--simulate", default=os.path.join(ROOT, "build/bin/plumbline-simulate"))
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--rows", type=int, default=60)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="6 cells of 30 rows, two kills; the ratio is not judged")
    options = parser.parse_args()
    if options.quick:
        options.cells, options.rows, options.kills = 6, 30, 2
    if station.missing():
        print("skipped: install " + ", ".join(station.missing()))
        return 77
    folder, servers = station.scratch_folder("plumbline-workers-"), []
    try:
        servers.append(station.Postgres(folder, lines="fsync = off\n"))
        primary = servers[0]
        station.new_plant(os.path.dirname(os.path.abspath(options.product)), primary)
        for number in range(1, options.cells + 1):
            made = os.path.join(folder, "cell")
            call(options.simulate, "--family", FAMILIES[number % len(FAMILIES)], "--robot",
                 ROBOTS[number % len(ROBOTS)], "--seed", str(options.first_seed + number), "--rows",
                 str(options.rows), "--signal", "10", "--out", made)
            call("psql", "-X", "-q", "-v", "ON_ERROR_STOP=1", "-d", primary.settings(), text=sql_of_cell(number, made))
        first, second = (Round(k, folder, options, primary.settings()) for k in (1, 2))
        # A worker takes jobs of its own version only: the other round waits.
        one_s, two_s = first.seconds_with(1), second.seconds_with(2)
        faults = first.faults(primary, first) + second.faults(primary, first)
        ratio = one_s / two_s
        print("%d cells of %d rows: one worker %.1f s, two workers %.1f s: %.2f times as fast (goal: %.1f)" %
              (options.cells, options.rows, one_s, two_s, ratio, GOAL))
        if not options.quick and ratio < GOAL:
            faults.append("goal missed: %.2f < %.1f" % (ratio, GOAL))

        servers.append(station.Postgres(folder, "standby", standby_of=primary))
        standby = servers[1]
        both = "host=%s,%s port=%d,%d dbname=plumbline user=owner target_session_attrs=read-write" % (
            primary.sockets, standby.sockets, primary.port, standby.port)
        third = Round(3, folder, options, both)
        faults += under_faults(third, primary, standby, options.kills, options.first_seed)
        faults += third.faults(standby, first)
        again = standby.ask("SELECT count(*) FROM plumbline.job WHERE attempts > 1")
        print("%d kills of a worker, one failover of the database: %s jobs were tried again" % (options.kills, again))
        verdicts = collections.Counter(row[0] for row in standby.rows(
            "SELECT coalesce(output->>'verdict', 'refused') FROM plumbline.result"))
    finally:
        for server in servers:
            server.stop(signal.SIGINT)
        station.remove(folder)
    print("verdicts: " + ", ".join("%s %d" % one for one in sorted(verdicts.items())))
    print("load of the machine: %s; processors: %d" % (" ".join("%.1f" % x for x in os.getloadavg()), os.cpu_count()))
    print("\n".join(faults) or "lost 0, doubled 0, failed 0, the same answers in every round")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
