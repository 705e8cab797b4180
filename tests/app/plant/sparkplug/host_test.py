"""plumbline-sparkplug with Debian's broker, simulated cells, and a host that knows only the specification.

    host_test.py PLUMBLINE_SPARKPLUG"""

import signal
import subprocess
import sys
import tempfile
import time

import sparkplug_b
from host import Host
from mqtt import CONNECT, DISCONNECT, PUBLISH, SUBSCRIBE, Client, Connect, Message, Relay, soon, subscriptions
from plant import Bridge, Broker, Cell, free_port, mosquitto, now_ms

PROGRAM = sys.argv[1]
if not mosquitto():
    print("SKIPPED: no mosquitto here")
    sys.exit(77)
faults, checks = [], 0


def check(holds, what):
    global checks
    checks += 1
    if not holds:
        faults.append(what)
        print("FAILED:", what, flush=True)
    return holds


def await_(condition, what, seconds=30):
    return check(soon(condition, seconds), what)


def check_host(host, case):
    for fault in host.faults:
        check(False, "%s: the specification forbids: %s" % (case, fault))


def check_wire(relay):
    """What only the broker sees of an edge node."""
    sessions = {}
    for packets in list(relay.connections):
        if not packets:
            continue
        kind, _, body = packets[0]
        check(kind == CONNECT, "the first packet of a connection is %d" % kind)
        connect = Connect(body)
        node = connect.will_topic.split("/")[-1]
        check(connect.clean, node + ": clean session")
        check(connect.will_qos == 1 and not connect.will_retained, node + ": QoS and retain of the will")
        check(connect.will_topic == "spBv1.0/plumbline/NDEATH/" + node, node + ": topic of the will")
        will = sparkplug_b.read(connect.will)
        check("seq" not in will and len(will["metrics"]) == 1, node + ": content of the will")
        _, number = sparkplug_b.value_of(will["metrics"][0], sparkplug_b.INT64)
        before = sessions.get(node)
        check(number == (0 if before is None else (before + 1) % 256), "%s: bdSeq %s after %s" % (node, number, before))
        sessions[node] = number
        topics, death = [], False
        for kind, flags, body in packets[1:]:
            if kind == SUBSCRIBE:
                topics += subscriptions(body)
            elif kind == PUBLISH:
                message = Message(flags, body)
                kinds = message.topic.split("/")[2]
                check(("spBv1.0/plumbline/NCMD/" + node, 1) in topics, node + ": publishes before it subscribes to NCMD with QoS 1")
                check(not death, node + ": publishes after its NDEATH")
                death = kinds == "NDEATH"
                if kinds == "NBIRTH":
                    values = {metric.get("name"): metric for metric in sparkplug_b.read(message.payload)["metrics"]}
                    check(values["bdSeq"]["long"] == number, node + ": bdSeq of birth and will")
            elif kind == DISCONNECT:
                check(death, node + ": disconnects without an NDEATH")
    return sessions


def life_of_a_cell():
    broker = Broker()
    relay = Relay(broker.port)
    host = Host(broker.port)
    cell, gone = Cell(broker.port, "cell-7"), Cell(broker.port, "gone")
    for one in (cell, gone):
        one.connect()
    gone.stop()
    bridge = Bridge(PROGRAM, broker.port, relay.port)
    node = host.node(("plumbline", "cell-7"))

    await_(lambda: node.births == 1, "a cell that is online is born")
    check(node.values["Publisher/Version"] == "0.1.0" and node.values["Cell/Joints"] == 6, "values of the birth")
    check(node.values["Points/2/Correction/X"] is None and node.quality["Points/2/Correction/X"] == 500, "unknown: null and stale")
    check(node.units["Points/2/Correction/X"] == "mm" and node.units["Payload/Mass"] == "kg", "units")
    check("Alarms/alarms/robot input stale" in node.values and "Probe/Residual/Size" in node.values, "all metrics are declared")

    cell.state()
    await_(lambda: node.births == 2 and node.values.get("Cameras/left/Lens") == "valid", "a new camera needs a new birth")
    check(node.values["Health/Reason"] == "ok" and node.values["Joints/6"] == 10.5, "state")
    check(node.values["Monitoring/Drift statistic"] == -0.25, "negative number")
    check(node.values["Cell/Temperature"] is None and node.quality["Cell/Temperature"] == 0, "reported as unknown: null and bad")
    check(node.values["Alarms/alarms/robot input stale"] is False, "no alarm, from the state's word")
    time.sleep(1.1)  # births of one connection are a second apart; then data
    cell.state(temp_C=20.25, q=None)
    await_(lambda: node.values["Cell/Temperature"] == 20.25 and node.quality["Cell/Temperature"] == 192, "known again")
    check(node.values["Joints/6"] is None, "unknown joints")
    data = node.data
    cell.state(temp_C=20.25, q=None)
    cell.point(1, 0.75)
    await_(lambda: node.values["Points/1/Correction/X"] == 0.75 and node.quality["Points/1/Correction/X"] == 192, "point")
    check(node.data == data + 1, "what has not changed is not published")
    cell.alarm(True)
    await_(lambda: node.values["Alarms/alarms/robot input stale"] is True, "alarm begins")
    cell.probe(1, 0.5)
    cell.probe(2, 0.5)
    await_(lambda: node.values["Probe/Id"] == 2 and node.values["Probe/Residual/Size"] == 0.5, "probe")

    host.request("plumbline", "cell-7")
    await_(lambda: node.births == 3, "rebirth on request")
    check(node.values["Points/1/Correction/X"] == 0.75 and node.values["Probe/Id"] == 2, "the rebirth holds the last values")
    host.request("plumbline", "cell-7", "Node Control/Reboot")
    host.request("plumbline", "cell-7", "Node Control/Rebirth", False)
    host.client.publish("spBv1.0/plumbline/NCMD/cell-7", b"\xff\x00\xff not protobuf", 1)
    Client(broker.port, "vandal").publish(cell.topic("NDATA"), "{\"stream\":", 1)
    await_(lambda: "Node Control/Reboot" in bridge.log() and "not understood" in bridge.log(), "ignored commands and messages are logged")
    data = node.data
    for k in range(300):
        cell.probe(3 + k, 1 + k, wait=k % 50 == 49)
    await_(lambda: node.values["Probe/Id"] == 302, "three hundred probes")
    check(node.data == data + 300 and node.births == 3, "each probe is a message; seq passes 255: %d" % (node.data - data))

    # Away for a while: the queue is historical, and ends as live values.
    cell.stop(clean=False)
    await_(lambda: node.deaths == 1 and not node.online, "the cell's connection breaks: NDEATH")
    messages = len(node.messages)
    old = now_ms() - 3600000
    cell.probe(400, 2.5, old)
    cell.alarm(False, timestamp=old + 1)
    cell.connect()
    await_(lambda: node.births == 4 and node.online, "the cell is back: NBIRTH")
    check(node.messages[messages][0] == "NBIRTH", "silence between death and birth")
    await_(lambda: ("Probe/Id", old, 400) in node.history, "a queued probe is historical")
    check(node.values["Probe/Id"] == 302, "and does not change the live value yet")
    cell.state()
    await_(lambda: node.values["Probe/Id"] == 400 and node.values["Alarms/alarms/robot input stale"] is False, "then it does")
    check(node.times["Probe/Id"] == old, "with its time")

    # A gap in the numbers: points may be out of date.
    cell.seq += 1
    cell.state(model=5)
    await_(lambda: node.quality["Points/1/Correction/X"] == 500 and node.values["Model/In force"] == 5, "missing messages: stale points")
    cell.point(1, 0.75)
    await_(lambda: node.quality["Points/1/Correction/X"] == 192, "reported again: good")

    cell.stop()
    await_(lambda: node.deaths == 2, "a clean stop: NDEATH")
    cell.connect()
    await_(lambda: node.births == 5, "and a birth")
    check(bridge.kill(signal.SIGTERM) == 0, "the bridge ends on SIGTERM")
    await_(lambda: node.deaths == 3, "whose end is a death")
    check(not host.node(("plumbline", "gone")).messages, "a cell that is offline has no node")
    check(len(check_wire(relay)) == 1, "one node at the broker")
    late = Host(broker.port, "late")
    time.sleep(0.3)
    check(not late.nodes, "nothing of Sparkplug is retained")
    check_host(host, "life of a cell")
    bridge.close()
    broker.close()


def kills():
    broker = Broker()
    relay = Relay(broker.port)
    host = Host(broker.port)
    cells = [Cell(broker.port, "cell-%d" % k) for k in range(20)]
    for cell in cells:
        cell.connect()
    bridge = Bridge(PROGRAM, broker.port, relay.port)
    nodes = [host.node(("plumbline", cell.node)) for cell in cells]
    await_(lambda: all(node.births == 1 for node in nodes), "twenty births")
    bridge.kill()
    await_(lambda: all(node.deaths == 1 for node in nodes), "kill -9 of the bridge: the broker publishes the wills")
    cells[0].state()  # while the bridge is away
    bridge.start()
    await_(lambda: all(node.online for node in nodes), "the bridge is back: births")
    await_(lambda: nodes[0].values.get("Model/In force") == 4, "with what the broker kept")
    check_host(host, "bridge killed")
    relay.connections.clear()

    broker.kill()
    broker.start()
    again = Host(broker.port, "again", from_start=False)
    for cell in cells:
        cell.connect()  # as plumbline-fleet: a new connection, a new birth
    nodes = [again.node(("plumbline", cell.node)) for cell in cells]
    await_(lambda: all(node.online for node in nodes), "kill -9 of the broker: births at the next connection")
    cells[3].state(model=9)
    await_(lambda: nodes[3].values.get("Model/In force") == 9, "and data")
    check_host(again, "broker killed")
    bridge.close()
    await_(lambda: all(not node.online for node in nodes), "the end is a death for all")
    broker.close()


def primary_host():
    cells_broker, broker = Broker(), Broker()
    watcher = Host(broker.port, "watcher")
    cell = Cell(cells_broker.port, "cell-7")
    cell.connect()
    bridge = Bridge(PROGRAM, cells_broker.port, broker.port, 'primary_host = "scada"')
    node = watcher.node(("plumbline", "cell-7"))
    time.sleep(1)
    check(node.births == 0, "no birth without the primary host")
    primary = Host(broker.port, "primary", "scada")
    await_(lambda: node.births == 1, "a birth when the primary host is online")
    primary.client.publish("spBv1.0/STATE/scada", '{"online": false, "timestamp": 1}', 1, True)
    primary.client.publish("spBv1.0/STATE/scada", "nonsense", 1, False)
    cell.state()
    await_(lambda: node.births == 2, "an old STATE does not count")
    primary.say_offline()
    await_(lambda: node.deaths == 1, "the primary host goes offline: NDEATH, once")
    time.sleep(0.5)
    check(node.births == 2, "and no birth")
    primary.say_online()
    await_(lambda: node.births == 3, "until it is back")
    # The cells' broker goes: no cell is known to be online.
    cells_broker.kill()
    await_(lambda: node.deaths == 2, "the cells' broker is gone: NDEATH after the grace time")
    check_host(watcher, "primary host")
    check_host(primary, "primary host")
    bridge.close()
    broker.close()


def restart():
    """Points are kept; after a crash they are stale."""
    broker = Broker()
    host = Host(broker.port)
    cell = Cell(broker.port, "cell-7")
    cell.connect()
    bridge = Bridge(PROGRAM, broker.port)
    node = host.node(("plumbline", "cell-7"))
    point = "Points/1/Correction/X"
    await_(lambda: node.births == 1, "birth")
    cell.point(1, 0.75)
    await_(lambda: node.values[point] == 0.75, "point")
    bridge.kill(signal.SIGTERM)
    cell.point(2, 0.5)  # while the bridge is away
    cell.state()
    bridge.start()
    await_(lambda: node.online and node.births == 2, "birth after a restart")
    check(node.values[point] == 0.75 and node.quality[point] == 192, "the point is known")
    await_(lambda: node.values["Points/2/Correction/X"] == 0.5, "and the one that changed meanwhile")
    cell.point(1, 1.5)
    await_(lambda: node.values[point] == 1.5, "changed again")
    bridge.kill()
    bridge.start()
    await_(lambda: node.online and node.deaths == 2, "birth after a crash")
    cell.state(model=8)
    await_(lambda: node.values["Model/In force"] == 8 and node.quality[point] == 500, "stale after a crash: %s" % node.quality[point])
    bridge.kill()
    with open(bridge.folder.name + "/points.json", "w") as damaged:
        damaged.write("{")
    bridge.start()
    await_(lambda: "is not JSON" in bridge.log() and node.online, "a damaged file is named, and the bridge runs")
    check_host(host, "restart")
    bridge.close()
    broker.close()


def rights():
    """TLS, a password, and no more rights than the documents name."""
    keys = tempfile.TemporaryDirectory()
    at = keys.name + "/"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout",
                    at + "key", "-out", at + "ca.pem", "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"],
                   check=True, capture_output=True)
    port = free_port()
    with open(at + "acl", "w") as acl:
        acl.write("user sparkplug\ntopic read plumblineV1/#\ntopic read spBv1.0/+/NCMD/+\ntopic read spBv1.0/STATE/+\n"
                  "topic write spBv1.0/+/NBIRTH/+\ntopic write spBv1.0/+/NDATA/+\ntopic write spBv1.0/+/NDEATH/+\n")
    with open(at + "password", "w") as password:
        password.write("secret\n")
    subprocess.run(["mosquitto_passwd", "-c", "-b", at + "passwords", "sparkplug", "secret"], check=True, capture_output=True)
    broker = Broker("listener %d 127.0.0.1\nallow_anonymous false\ncertfile %sca.pem\nkeyfile %skey\npassword_file %spasswords\n"
                    "acl_file %sacl\n" % (port, at, at, at, at))
    host = Host(broker.port)
    cells = [Cell(broker.port, "cell-%d" % k) for k in range(40)]
    for cell in cells:
        cell.connect()
    login = 'username = "sparkplug"\ntls_ca = "%sca.pem"\npassword_file = "%spassword"\n' % (at, at)
    bridge = Bridge(PROGRAM, port, more='[broker]\nhost = "localhost"\nport = %d\n%s' % (port, login), whole=True)
    nodes = [host.node(("plumbline", cell.node)) for cell in cells]
    await_(lambda: all(node.births == 1 for node in nodes), "births over TLS: " + bridge.log())
    for cell in cells:
        cell.probe(1, 0.5, wait=False)
    await_(lambda: all(node.values.get("Probe/Id") == 1 for node in nodes), "data over TLS")
    host.request("plumbline", "cell-3")
    await_(lambda: nodes[3].births == 2, "rebirth over TLS")
    bridge.close()
    await_(lambda: all(node.deaths == 1 for node in nodes), "deaths over TLS")
    with open(at + "password", "w") as password:
        password.write("wrong\n")
    bridge = Bridge(PROGRAM, port, more='[broker]\nhost = "localhost"\nport = %d\n%s' % (port, login), whole=True)
    await_(lambda: "ot authori" in bridge.log(), "a wrong password is logged")
    check_host(host, "rights")
    bridge.close()
    broker.close()


def flood():
    """A cell that publishes as fast as it can: the others' data pass it."""
    broker = Broker()
    host = Host(broker.port)
    loud, calm = Cell(broker.port, "loud"), Cell(broker.port, "calm")
    loud.connect()
    calm.connect()
    bridge = Bridge(PROGRAM, broker.port)
    nodes = {name: host.node(("plumbline", name)) for name in ("loud", "calm")}
    await_(lambda: all(node.births for node in nodes.values()), "births")
    for k in range(20000):
        loud.probe(k, 0.5, wait=False)
        if k % 4000 == 0:
            calm.probe(k, 0.5)
    await_(lambda: nodes["calm"].values["Probe/Id"] == 16000, "the calm cell's data arrive")
    await_(lambda: nodes["loud"].values["Probe/Id"] == 19999, "and the newest of the loud one")
    check(nodes["loud"].data < 10000, "merged: %d messages" % nodes["loud"].data)
    check_host(host, "flood")
    bridge.close()
    broker.close()


CASES = {"restart": restart, "rights": rights, "flood": flood, "life": life_of_a_cell, "kills": kills, "primary": primary_host}
for name in sys.argv[2:] or CASES:
    CASES[name]()
print("%d checks, %d failed" % (checks, len(faults)))
sys.exit(1 if faults else 0)
