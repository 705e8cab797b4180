#!/usr/bin/python3 -B
"""Benchmark of the plant's collector: speed beside a plain script, losses under faults, a flooding cell.

    plant_bench.py BIN [--smoke | --quick]

Speed: broker, database and consumer on one processor, while a backlog is read. The script is what an engineer
would write in one line: mosquitto_sub into COPY; it checks nothing and stores lines of text.
Faults: simulated cells, a probe and a state a second each on their own clock; the broker is killed and stays away
for an hour of that clock, the collectors are killed ten times, the database's primary once, and the
standby promoted."""
import os
import random
import signal
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(os.path.dirname(HERE), "plant_cells")]
import plant_station as station  # noqa: E402
import rows  # noqa: E402

EFFORT = next((word[2:] for word in sys.argv if word in ("--smoke", "--quick")), "whole")


def choose(smoke, quick, whole):
    return {"smoke": smoke, "quick": quick, "whole": whole}[EFFORT]


def publish(binaries, folder, broker, cells, seconds, name):
    """A backlog: every cell a probe and a state a second, sent at once."""
    made = station.Cells(binaries, folder, broker, "--cells", str(cells), "--seconds", str(seconds), "--speed", "1e6",
                         "--start-days", "1", name=name)
    made.child.wait()
    return 2 * cells * seconds


def drain_by_collector(binaries, folder, cells, seconds, pin):
    server, broker = station.Postgres(folder, lines="fsync = on\n", pin=pin), station.Broker(folder, pin=pin)
    try:
        station.new_plant(binaries, server)
        collector = station.Collector(binaries, folder, broker, server.settings(), pin=pin)
        collector.wait()
        collector.stop(signal.SIGKILL)
        count = publish(binaries, folder, broker, cells, seconds, "backlog")
        begin = time.monotonic()
        collector.start()
        stored = "SELECT coalesce(sum(next_seq - first_seq), 0) FROM plumbline.stream"
        # Not often: a question takes time of the processor that is measured.
        if not station.soon(lambda: int(server.ask(stored)) == count, 600, 0.25):
            raise RuntimeError("only %s of %d stored" % (server.ask(stored), count))
        taken = time.monotonic() - begin
        collector.stop()
        return count / taken
    finally:
        broker.stop(signal.SIGKILL)
        server.stop(signal.SIGINT)


def drain_by_script(binaries, folder, cells, seconds, pin):
    server, broker = station.Postgres(folder, lines="fsync = on\n", pin=pin), station.Broker(folder, pin=pin)
    try:
        server.ask("CREATE DATABASE plumbline", "postgres")
        server.ask("CREATE TABLE raw (line text)")
        subscribe = ["mosquitto_sub", "-h", "127.0.0.1", "-p", str(broker.port), "-V", "mqttv5", "-q", "1", "-c", "-x",
                     "1000000", "-i", "script", "-D", "connect", "receive-maximum", "60000", "-t", "plumblineV1/+/+/+"]
        subprocess.run(subscribe + ["-W", "1"], capture_output=True)
        count = publish(binaries, folder, broker, cells, seconds, "backlog")
        begin = time.monotonic()
        # The births and deaths of the cells come, too.
        reader = subprocess.Popen(["taskset", "-c", str(pin)] + subscribe + ["-C", str(count)], stdout=subprocess.PIPE)
        subprocess.run(["taskset", "-c", str(pin), "psql", "-X", "-q", "-d", server.settings(), "-c",
                        "COPY raw FROM STDIN (FORMAT csv, QUOTE E'\\x01', DELIMITER E'\\x02')"], stdin=reader.stdout,
                       check=True)
        taken = time.monotonic() - begin
        return count / taken
    finally:
        broker.stop(signal.SIGKILL)
        server.stop(signal.SIGINT)


def speed(binaries, folder):
    cells, seconds = choose((20, 50), (300, 200), (300, 1000))
    pin = os.cpu_count() - 1
    ours, scripts = [], []
    for k in range(choose(1, 2, 3)):
        for drain, results in ((drain_by_collector, ours), (drain_by_script, scripts)):
            own = os.path.join(folder, "%s%d" % (drain.__name__, k))
            os.makedirs(own)
            results.append(drain(binaries, own, cells, seconds, pin))
            station.remove(own)
    median = lambda values: sorted(values)[len(values) // 2]  # noqa: E731
    rows.report("plant: messages into the database, one core, catching up", median(ours), "1/s", ("ratio", ">=", 1.0),
                "mosquitto_sub into COPY", median(scripts))


def faults(binaries, folder):
    cells, minutes, speed_up = choose((10, 3, 12), (60, 20, 30), (300, 90, 20))
    kills = choose(2, 10, 10)
    seconds = 60 * minutes
    lines = "wal_level = replica\nmax_wal_senders = 4\nhot_standby = on\n"
    primary = station.Postgres(folder, "primary", lines)
    station.new_plant(binaries, primary)
    standby = station.Postgres(folder, "standby", "", standby_of=primary)
    # A commit that the primary alone has is lost with it.
    primary.ask("ALTER SYSTEM SET synchronous_standby_names = '*'")
    primary.ask("SELECT pg_reload_conf()")
    settings = "host=%s,%s port=%d,%d dbname=plumbline user=owner target_session_attrs=read-write" % (
        primary.sockets, standby.sockets, primary.port, standby.port)
    # A broker writes all that it keeps: often only if that is little. What a cell repeats, by its own clock, must be
    # less than the collector's burst of 5000 messages.
    save_s, repeat_s = choose(2, 2, 15), choose(10, 10, 40)
    broker = station.Broker(folder, "autosave_interval %d\n" % save_s)
    collectors = [station.Collector(binaries, folder, broker, settings, name) for name in ("1", "2")]
    for one in collectors:
        one.wait()
    broker.child.send_signal(signal.SIGUSR1)  # saves the sessions
    time.sleep(2)
    made = station.Cells(binaries, folder, broker, "--cells", str(cells), "--seconds", str(seconds), "--speed",
                         str(speed_up), "--start-days", "0.2", "--repeat-s", str(repeat_s))
    random.seed(43)
    database = primary
    try:
        wall = seconds / speed_up
        away = min(60 * 60, seconds / 2) / speed_up  # an hour of the cells' clock
        events = [(wall * (0.02 + 0.9 * random.random()), "collector") for _ in range(kills)]
        events += [(0.15 * wall, "broker"), (0.15 * wall + away, "broker back"), (0.9 * wall, "primary")]
        begin = time.monotonic()
        for at, event in sorted(events):
            time.sleep(max(0.0, begin + at - time.monotonic()))
            if event == "collector":
                victim = random.choice(collectors)
                victim.stop(signal.SIGKILL)
                victim.start()
            elif event == "broker":
                broker.stop(signal.SIGKILL)
            elif event == "broker back":
                broker.start()
            else:
                # postgres' children die with their postmaster
                primary.stop(signal.SIGKILL)
                standby.promote()
                standby.ask("ALTER SYSTEM SET synchronous_standby_names = ''")
                standby.ask("SELECT pg_reload_conf()")
                database = standby
        time.sleep(max(0.0, begin + wall - time.monotonic()))

        def all_acknowledged():
            reported = made.reported()
            return (len(reported) == cells and all(one["messages"] >= 2 * seconds and one["unacknowledged"] == 0
                                                   for one in reported))
        if not station.soon(all_acknowledged, 600, 0.5):
            raise RuntimeError("the cells could not publish everything: %s" % made.reported()[:3])
        expected = {(one["line"], one["node"], one["stream"]): one for one in made.reported()}
        total = sum(one["messages"] for one in expected.values())
        arrived = lambda: int(database.ask(  # noqa: E731
            "SELECT coalesce(sum(next_seq - 1), 0) - (SELECT coalesce(sum(last_seq - first_seq + 1), 0) FROM "
            "plumbline.gap) FROM plumbline.stream"))
        station.soon(lambda: arrived() >= total, 600, 0.5)
        lost = doubled = 0
        for line, node, stream, messages, missing, probes, distinct in database.rows(
                "SELECT line, node, stream, next_seq - 1, (SELECT coalesce(sum(last_seq - first_seq + 1), 0) FROM plumbline.gap g "
                "WHERE g.cell = s.cell AND g.stream = s.stream), (SELECT count(*) FROM plumbline.probe p WHERE p.cell = s.cell AND "
                "p.stream = s.stream), (SELECT count(DISTINCT seq) FROM plumbline.probe p WHERE p.cell = s.cell AND p.stream = "
                "s.stream) FROM plumbline.stream s JOIN plumbline.cell USING (cell)"):
            one = expected.pop((line, node, int(stream)))
            lost += one["messages"] - int(messages) + int(missing)
            lost += max(0, one["probes"] - int(probes)) if int(missing) == 0 else 0
            doubled += int(probes) - int(distinct)
        lost += sum(one["messages"] for one in expected.values())
        lost += int(database.ask("SELECT coalesce(sum(limited), 0) FROM plumbline.cell"))
        sums = int(database.ask("SELECT coalesce(sum(probes), 0) FROM plumbline.cell_day"))
        doubled += abs(sums - int(database.ask("SELECT count(*) FROM plumbline.probe")))
        states = int(database.ask("SELECT coalesce(sum(states), 0) FROM plumbline.cell_day"))
        made_states = total - sum(one["probes"] for one in made.reported())
        doubled += max(0, states - made_states)
        lost += max(0, made_states - states)
        rows.report("plant: %d messages of %d cells under faults: lost" % (total, cells), lost, "", ("ours", "<=", 0),
                    timed=False)
        rows.report("plant: the same, doubled (rows and sums)", doubled, "", ("ours", "<=", 0), timed=False)
        letters = int(database.ask("SELECT coalesce(sum(messages), 0) FROM plumbline.dead_letter"))
        rows.report("plant: the same, unexplained gaps and dead letters", letters + int(
            database.ask("SELECT count(*) FROM plumbline.gap")), "", ("ours", "<=", 0), timed=False)
        print("  cells sent %d messages, repetitions included" % sum(one["sent"] for one in made.reported()))
    finally:
        for process in [made, *collectors, broker]:
            process.stop(signal.SIGKILL)
        for server in (primary, standby):
            server.stop(signal.SIGINT)
            station.remove(server.sockets)


def flood(binaries, folder):
    """A cell that sends ten thousand messages a second beside others: how late are those?"""
    cells, seconds = choose((20, 4), (100, 15), (300, 30))
    server, broker = station.Postgres(folder), station.Broker(folder)
    processes = [broker]
    try:
        station.new_plant(binaries, server)
        collector = station.Collector(binaries, folder, broker, server.settings())
        processes.append(collector)
        collector.wait()
        bad = station.Cells(binaries, folder, broker, "--cells", "1", "--line", "flood", "--probe-s", "0.0001", "--state-s", "0",
                            "--seconds", str(seconds), name="flood")
        good = station.Cells(binaries, folder, broker, "--cells", str(cells), "--line", "good", "--seconds", str(seconds),
                             name="good")
        processes += [bad, good]
        # Age of the newest probe of the cell that is furthest behind.
        ask = ("SELECT coalesce(extract(epoch FROM now() - min(newest)), 0) FROM (SELECT max(p.utc) AS newest FROM plumbline.probe p "
               "JOIN plumbline.cell USING (cell) WHERE line = 'good' GROUP BY cell) AS each")
        begin, ages = time.monotonic(), []
        while time.monotonic() - begin < seconds:
            time.sleep(0.5)
            if time.monotonic() - begin > 2.5:
                ages.append(float(server.ask(ask)))
        station.soon(lambda: int(server.ask("SELECT count(*) FROM plumbline.probe p JOIN plumbline.cell USING (cell) WHERE line = "
                                            "'good'")) == cells * seconds, 60)
        stored = int(server.ask("SELECT count(*) FROM plumbline.probe p JOIN plumbline.cell USING (cell) WHERE line = 'good'"))
        sent = bad.reported()[0]["sent"] if bad.reported() else 0
        refused = int(server.ask("SELECT coalesce(sum(limited), 0) FROM plumbline.cell WHERE line = 'flood'"))
        print("  the flooding cell sent %d messages in %d s, %d were refused; oldest newest probe of the others: %.1f s"
              % (sent, seconds, refused, max(ages)))
        rows.report("plant: beside a flooding cell, messages of %d others lost" % cells, cells * seconds - stored, "",
                    ("ours", "<=", 0), timed=False)
        # A probe a second is at most one second old before it is sent.
        rows.report("plant: the same, age of the newest probe of the last cell, longest", max(ages), "s", ("ours", "<=", 3))
        if refused == 0:
            raise RuntimeError("the flooding cell was not limited")
    finally:
        for process in processes:
            process.stop(signal.SIGKILL)
        server.stop(signal.SIGINT)


def main():
    binaries = sys.argv[1]
    absent = station.missing()
    if absent:
        rows.skipped("plant: collector", "needs " + " and ".join(absent))
        return
    only = sys.argv[sys.argv.index("--part") + 1] if "--part" in sys.argv else None
    for part in (speed, faults, flood):
        if only and part.__name__ != only:
            continue
        folder = station.scratch_folder("plant-bench-")
        try:
            part(binaries, folder)
        finally:
            station.remove(folder)


if __name__ == "__main__":
    main()
