"""Broker, database and the plant's programs as processes of their own, in one folder, without root services."""
import json
import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time

POSTGRES = "/usr/lib/postgresql/15/bin/"
MOSQUITTO = next((p for p in ("/usr/sbin/mosquitto", "/usr/bin/mosquitto") if os.access(p, os.X_OK)), None)


def missing():
    """What is not installed; empty if all is."""
    absent = [] if MOSQUITTO else ["mosquitto"]
    return absent + ([] if os.access(POSTGRES + "postgres", os.X_OK) else ["postgresql-15"])


def free_port():
    with socket.socket() as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


def soon(holds, seconds=60, step=0.05):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if holds():
            return True
        time.sleep(step)
    return holds()


def as_server(words):
    """PostgreSQL refuses to run as root."""
    if os.getuid() != 0:
        return words
    return ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"] + words


class Process:
    def __init__(self, words, log, pin=None, env=None):
        self.words, self.log, self.pin, self.env, self.child = words, log, pin, env, None
        self.start()

    def start(self):
        words = (["taskset", "-c", str(self.pin)] if self.pin is not None else []) + self.words
        with open(self.log, "a") as log:
            self.child = subprocess.Popen(words, stdout=log, stderr=log, stdin=subprocess.DEVNULL, env=self.env,
                                          start_new_session=True)

    def stop(self, how=signal.SIGTERM):
        if self.child is not None and self.child.poll() is None:
            self.child.send_signal(how)
            try:
                self.child.wait(30)
            except subprocess.TimeoutExpired:
                self.child.kill()
                self.child.wait()
        self.child = None

    def running(self):
        return self.child is not None and self.child.poll() is None


class Postgres(Process):
    def __init__(self, folder, name="primary", lines="", standby_of=None, pin=None):
        self.home = os.path.join(folder, name)
        self.sockets = tempfile.mkdtemp(prefix="plumbline-pg-", dir="/tmp")  # their paths must be short
        os.makedirs(self.home)
        if os.getuid() == 0:
            user = pwd.getpwnam("postgres")
            for one in (self.home, self.sockets):
                os.chown(one, user.pw_uid, user.pw_gid)
            parent = folder
            while parent != "/":  # the server's user passes through
                os.chmod(parent, os.stat(parent).st_mode | 0o011)
                parent = os.path.dirname(parent)
        self.data = os.path.join(self.home, "data")
        self.port = free_port()
        log = os.path.join(self.home, "log")
        if standby_of is None:
            self.call(["initdb", "-D", self.data, "-U", "owner", "--no-sync", "-A", "trust", "-E", "UTF8", "--locale=C"])
        else:
            self.call(["pg_basebackup", "-D", self.data, "-h", standby_of.sockets, "-p", str(standby_of.port), "-U", "owner",
                       "-R", "-X", "stream", "-c", "fast", "--no-sync"])
        settings = ("listen_addresses = ''\nunix_socket_directories = '%s'\nport = %d\nmax_connections = 60\n"
                    % (self.sockets, self.port) + lines)
        with open(os.path.join(self.data, "postgresql.conf"), "a") as file:
            file.write(settings)
        super().__init__(as_server([POSTGRES + "postgres", "-D", self.data]), log, pin)
        if not soon(self.answers):
            raise RuntimeError("PostgreSQL does not start: " + open(log).read()[-2000:])

    def call(self, words):
        done = subprocess.run(as_server([POSTGRES + words[0]] + words[1:]), capture_output=True, text=True, cwd="/")
        if done.returncode != 0:
            raise RuntimeError("%s: %s" % (words[0], done.stderr))

    def settings(self, database="plumbline", user="owner"):
        return "host=%s port=%d dbname=%s user=%s" % (self.sockets, self.port, database, user)

    def answers(self):
        return self.ask("SELECT 1", "postgres", check=False) == "1"

    def ask(self, statement, database="plumbline", check=True):
        done = subprocess.run(["psql", "-X", "-A", "-t", "-q", "-d", self.settings(database), "-c", statement],
                              capture_output=True, text=True)
        if check and done.returncode != 0:
            raise RuntimeError("%s: %s" % (statement, done.stderr.strip()))
        return done.stdout.strip()

    def rows(self, statement):
        return [line.split("|") for line in self.ask(statement).splitlines()]

    def stop(self, how=signal.SIGINT):
        super().stop(how)
        if how != signal.SIGKILL:
            remove(self.sockets)

    def promote(self):
        self.call(["pg_ctl", "promote", "-w", "-D", self.data])


def broker_lines(port, folder, lines=""):
    return ("listener %d 127.0.0.1\nallow_anonymous true\nuser root\npersistence true\npersistence_location %s/\n"
            "max_queued_messages 0\nmax_inflight_messages 0\nset_tcp_nodelay true\n" % (port, folder) + lines)


class Broker(Process):
    def __init__(self, folder, lines="autosave_interval 5\n", pin=None):
        self.home = os.path.join(folder, "broker")
        os.makedirs(self.home)
        self.port = free_port()
        file = os.path.join(self.home, "mosquitto.conf")
        with open(file, "w") as out:
            out.write(broker_lines(self.port, self.home, lines))
        super().__init__([MOSQUITTO, "-c", file], os.path.join(self.home, "log"), pin)
        self.wait()

    def wait(self):
        def answers():
            with socket.socket() as trial:
                return trial.connect_ex(("127.0.0.1", self.port)) == 0
        if not soon(answers):
            raise RuntimeError("mosquitto does not start: " + open(self.log).read()[-2000:])

    def start(self):
        super().start()
        self.wait()


def write_config(file, broker, connection, name="1", share=None, more=""):
    with open(file, "w") as out:
        out.write('[broker]\nhost = "127.0.0.1"\nport = %d\n[database]\nconnection = "%s"\n[collect]\nname = "%s"\n%s%s'
                  % (broker.port, connection, name, 'share = "%s"\n' % share if share else "", more))


class Collector(Process):
    def __init__(self, bin_folder, folder, broker, connection, name="1", share=None, pin=None, more=""):
        os.makedirs(folder, exist_ok=True)
        file = os.path.join(folder, "collect-%s.toml" % name)
        write_config(file, broker, connection, name, share, more)
        super().__init__([os.path.join(bin_folder, "plumbline-collect"), file],
                         os.path.join(folder, "collect-%s.log" % name), pin)

    def wait(self):
        if not soon(lambda: "broker 127.0.0.1" in open(self.log).read()):
            raise RuntimeError("plumbline-collect does not connect: " + open(self.log).read()[-2000:])


class Cells(Process):
    def __init__(self, bin_folder, folder, broker, *words, name="cells"):
        self.report = os.path.join(folder, name + ".report")
        super().__init__([os.path.join(bin_folder, "plumbline-plant-cells"), "--port", str(broker.port), "--report",
                          self.report] + list(words), os.path.join(folder, name + ".log"))

    def reported(self):
        try:
            with open(self.report) as file:
                return [json.loads(line) for line in file]
        except FileNotFoundError:
            return []


def new_plant(bin_folder, server):
    """The database with tables and roles."""
    server.ask("CREATE DATABASE plumbline", "postgres")
    done = subprocess.run([os.path.join(bin_folder, "plumbline-plant"), "init", "--database", server.settings()],
                          capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stdout + done.stderr)


def scratch_folder(prefix):
    """A folder that PostgreSQL's user can reach."""
    return tempfile.mkdtemp(prefix=prefix, dir=os.environ.get("TMPDIR"))


def remove(folder):
    shutil.rmtree(folder, ignore_errors=True)
