"""A Sparkplug host that knows only the specification: it keeps each node's metrics, and notes whatever the
specification forbids. No code of the product."""

import json
import threading
import time

import sparkplug_b
from mqtt import Client

QUALITIES = (0, 192, 500)


def now_ms():
    return int(time.time() * 1000)


class Node:
    def __init__(self):
        self.online, self.bdSeq, self.seq, self.deaths, self.births, self.data = False, None, None, 0, 0, 0
        self.metrics = {}  # alias -> name, datatype
        self.values, self.times, self.quality, self.units = {}, {}, {}, {}  # of live values, by name
        self.history = []  # (name, timestamp, value) that arrived as historical
        self.messages = []  # (type, payload)


class Host:
    def __init__(self, port, name="host", state=None, from_start=True):
        self.from_start = from_start  # no node was born before
        self.nodes, self.faults, self.lock, self.bytes_ = {}, [], threading.RLock(), []
        self.port, self.name, self.state = port, name, state
        topic = "spBv1.0/STATE/%s" % state
        stamp = now_ms()
        offline = json.dumps({"online": False, "timestamp": stamp})
        self.client = Client(port, name, self.take, will=(topic, offline, 1, True) if state else None)
        for kind in ("NBIRTH", "NDATA", "NDEATH"):
            self.client.subscribe("spBv1.0/+/%s/+" % kind, 1)
        if state:
            self.client.publish(topic, json.dumps({"online": True, "timestamp": stamp}), 1, True)

    def say_offline(self):
        self.client.publish("spBv1.0/STATE/" + self.state, json.dumps({"online": False, "timestamp": now_ms()}), 1, True)

    def say_online(self):
        self.client.publish("spBv1.0/STATE/" + self.state, json.dumps({"online": True, "timestamp": now_ms()}), 1, True)

    def request(self, group, node, name="Node Control/Rebirth", value=True):
        self.client.publish("spBv1.0/%s/NCMD/%s" % (group, node), sparkplug_b.command(name, value, now_ms()), 0)

    def node(self, key):
        with self.lock:
            return self.nodes.setdefault(key, Node())

    def must(self, holds, what):
        if not holds:
            self.faults.append(what)

    def take(self, message):
        with self.lock:
            try:
                self.judge(message)
            except Exception as error:  # a payload that cannot be read is a fault of the node
                self.faults.append("%s: %s: %s" % (message.topic, type(error).__name__, error))

    def judge(self, message):
        space, group, kind, name = message.topic.split("/")
        where = "%s %s/%s: " % (kind, group, name)
        self.must(space == "spBv1.0", where + "namespace")
        self.must(not message.retained, where + "is retained")
        self.must(message.qos == (1 if kind == "NDEATH" else 0), where + "has QoS %d" % message.qos)
        self.bytes_.append((kind, message.payload))
        payload = sparkplug_b.read(message.payload)
        node = self.node((group, name))
        node.messages.append((kind, payload))
        if kind == "NDEATH":
            return self.death(node, payload, where)
        self.must("timestamp" in payload, where + "has no timestamp")
        self.must(abs(payload.get("timestamp", 0) - now_ms()) < 60000, where + "timestamp is not the time of sending")
        self.must("uuid" not in payload and "body" not in payload, where + "uuid or body")
        for metric in payload["metrics"]:
            self.must("timestamp" in metric, where + "metric without timestamp: %s" % metric)
            properties = metric.get("properties", {"keys": [], "values": []})
            self.must(len(properties["keys"]) == len(properties["values"]), where + "property set")
            for key, value in zip(properties["keys"], properties["values"]):
                if key == "Quality":
                    self.must(value.get("type") == 3 and value.get("int") in QUALITIES, where + "quality %s" % value)
                self.must("type" in value, where + "property %s without type" % key)
        (self.birth if kind == "NBIRTH" else self.changes)(node, payload, where)

    def death(self, node, payload, where):
        self.must("seq" not in payload, where + "has a sequence number")
        names = [metric.get("name") for metric in payload["metrics"]]
        self.must(names == ["bdSeq"], where + "metrics %s" % names)
        _, number = sparkplug_b.value_of(payload["metrics"][0], sparkplug_b.INT64)
        if node.online:
            self.must(number == node.bdSeq, where + "bdSeq %s, but %s at the birth" % (number, node.bdSeq))
        node.bdSeq, node.online, node.deaths = number, False, node.deaths + 1

    def birth(self, node, payload, where):
        self.must(payload.get("seq") == 0, where + "seq %s" % payload.get("seq"))
        node.metrics, names, number, rebirth = {}, set(), None, None
        for metric in payload["metrics"]:
            self.must("name" in metric and "datatype" in metric, where + "name or data type of %s" % metric)
            name, datatype = metric.get("name"), metric.get("datatype")
            self.must(name.lower() not in names, where + "two metrics %s" % name)
            names.add(name.lower())
            problem, value = sparkplug_b.value_of(metric, datatype)
            self.must(not problem, where + "%s: %s" % (name, problem))
            self.must(not metric.get("is_historical"), where + "%s is historical" % name)
            if name == "bdSeq":
                self.must(datatype == sparkplug_b.INT64 and 0 <= value <= 255, where + "bdSeq")
                number = value
                continue
            if name == "Node Control/Rebirth":
                self.must(datatype == sparkplug_b.BOOLEAN and value is False and "alias" not in metric, where + name)
                rebirth = metric
                continue
            self.must("alias" in metric and metric["alias"] not in node.metrics, where + "alias of %s" % name)
            node.metrics[metric.get("alias")] = (name, datatype)
            self.set(node, name, metric, value)
            properties = dict(zip(*[metric.get("properties", {"keys": [], "values": []})[key] for key in ("keys", "values")]))
            node.units[name] = properties.get("engUnit", {}).get("string")
            node.quality[name] = properties.get("Quality", {}).get("int", 192)
        self.must(number is not None, where + "no bdSeq")
        self.must(rebirth is not None, where + "no Node Control/Rebirth")
        if node.online:  # again in the same session
            self.must(number == node.bdSeq, where + "another bdSeq without a death")
        elif node.bdSeq is not None:
            self.must(number == (node.bdSeq + 1) % 256 or number == 0, where + "bdSeq %s after %s" % (number, node.bdSeq))
        node.online, node.bdSeq, node.seq, node.births = True, number, 0, node.births + 1

    def changes(self, node, payload, where):
        if node.births or self.from_start:
            self.must(node.online, where + "before a birth, or after a death")
        node.data += 1
        if node.seq is None:
            return
        node.seq = (node.seq + 1) % 256
        self.must(payload.get("seq") == node.seq, where + "seq %s, not %s" % (payload.get("seq"), node.seq))
        self.must(payload["metrics"], where + "without metrics")
        for metric in payload["metrics"]:
            self.must("name" not in metric and metric.get("alias") in node.metrics, where + "undeclared %s" % metric)
            if metric.get("alias") not in node.metrics:
                continue
            name, datatype = node.metrics[metric["alias"]]
            problem, value = sparkplug_b.value_of(metric, datatype)
            self.must(not problem, where + "%s: %s" % (name, problem))
            if metric.get("is_historical"):
                node.history.append((name, metric["timestamp"], value))
                continue
            self.set(node, name, metric, value)
            properties = dict(zip(*[metric.get("properties", {"keys": [], "values": []})[key] for key in ("keys", "values")]))
            node.quality[name] = properties.get("Quality", {}).get("int", node.quality.get(name, 192))

    @staticmethod
    def set(node, name, metric, value):
        node.values[name], node.times[name] = value, metric.get("timestamp")
