"""Sparkplug B payloads, written and read from the specification. No code of the product, nor of protobuf."""

import struct

INT32, INT64, UINT16, UINT32, DOUBLE, BOOLEAN, STRING = 3, 4, 6, 7, 10, 11, 12
# Field of the value by data type.
VALUE_OF = {INT32: "int", INT64: "long", UINT16: "int", UINT32: "int", DOUBLE: "double", BOOLEAN: "bool", STRING: "string"}
PAYLOAD = {1: ("timestamp", "varint"), 2: ("metrics", "metric"), 3: ("seq", "varint"), 4: ("uuid", "string"), 5: ("body", "bytes")}
METRIC = {
    1: ("name", "string"), 2: ("alias", "varint"), 3: ("timestamp", "varint"), 4: ("datatype", "varint"),
    5: ("is_historical", "bool"), 6: ("is_transient", "bool"), 7: ("is_null", "bool"), 9: ("properties", "set"),
    10: ("int", "varint"), 11: ("long", "varint"), 12: ("float", "float"), 13: ("double", "double"),
    14: ("bool", "bool"), 15: ("string", "string"), 16: ("bytes", "bytes"),
}
SET = {1: ("keys", "string"), 2: ("values", "property")}
PROPERTY = {
    1: ("type", "varint"), 2: ("is_null", "bool"), 3: ("int", "varint"), 4: ("long", "varint"), 5: ("float", "float"),
    6: ("double", "double"), 7: ("bool", "bool"), 8: ("string", "string"),
}
NESTED = {"metric": METRIC, "set": SET, "property": PROPERTY}
REPEATED = {"metrics", "keys", "values"}
WIRE = {"varint": 0, "bool": 0, "double": 1, "float": 5}


def varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            assert shift <= 70, "varint too long"
            return value, at


def decode(data, fields):
    found = {name: [] for name, _ in fields.values() if name in REPEATED}
    at = 0
    while at < len(data):
        tag, at = varint(data, at)
        assert tag >> 3 in fields, "field %d is not in the specification" % (tag >> 3)
        name, kind = fields[tag >> 3]
        assert tag & 7 == WIRE.get(kind, 2), "%s: wire type %d" % (name, tag & 7)
        if tag & 7 == 0:
            value, at = varint(data, at)
            assert kind != "bool" or value in (0, 1), name
            value = bool(value) if kind == "bool" else value
        elif tag & 7 in (1, 5):
            size, letter = (8, "<d") if tag & 7 == 1 else (4, "<f")
            value, at = struct.unpack(letter, data[at : at + size])[0], at + size
        else:
            size, at = varint(data, at)
            assert at + size <= len(data), "%s: cut off" % name
            value, at = data[at : at + size], at + size
            if kind in NESTED:
                value = decode(value, NESTED[kind])
            elif kind == "string":
                value = value.decode()
        if name in REPEATED:
            found[name].append(value)
        else:
            assert name not in found, "%s: twice" % name
            found[name] = value
    return found


def read(data):
    return decode(data, PAYLOAD)


def value_of(metric, datatype):
    """None for null. @return  (problem, value)"""
    present = [name for name in ("int", "long", "float", "double", "bool", "string", "bytes") if name in metric]
    if metric.get("is_null"):
        return ("null, and has a value" if present else None), None
    if present != [VALUE_OF.get(datatype)]:
        return "values %s for data type %s" % (present, datatype), None
    value = metric[present[0]]
    if datatype == INT32:
        assert value < 1 << 32, value
        value -= (value >> 31) << 32
    elif datatype == INT64:
        value -= (value >> 63) << 64
    elif datatype == UINT16:
        assert value < 1 << 16, value
    return None, value


def number(value):
    data = b""
    while True:
        value, digit = divmod(value, 128)
        data += bytes([digit | (128 if value else 0)])
        if not value:
            return data


def command(name, value, timestamp):
    """An NCMD that writes a Boolean."""
    metric = b"\x0a" + number(len(name)) + name.encode() + b"\x20" + number(BOOLEAN) + b"\x70" + number(int(value))
    return b"\x08" + number(timestamp) + b"\x12" + number(len(metric)) + metric
