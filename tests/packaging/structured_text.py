"""Runs IEC 61131-3 structured text, as much of it as packaging/examples/plc uses. What it does not
know, a name that is not declared and a value that does not fit its type are errors with a line."""

import re

WORD = re.compile(r"\(\*.*?\*\)|\s+|(T#\d+m?s|16#[0-9A-Fa-f]+|\d+\.\d+|\d+|\w+|:=|<>|<=|>=|\.\.|[-+*()\[\],;:.=<>])", re.S)
RANGES = {"BOOL": (0, 1), "WORD": (0, 65535), "UINT": (0, 65535), "DWORD": (0, 2**32 - 1),
          "INT": (-32768, 32767), "DINT": (-2**31, 2**31 - 1)}


class Fault(Exception):
    pass


class Parser:
    """Recursive descent; each function takes what its name says off the front."""

    def __init__(self, text):
        self.tokens, at, line = [], 0, 1
        while at < len(text):
            found = WORD.match(text, at)
            if not found:
                raise Fault("line %d: %r" % (line, text[at:at + 20]))
            if found.group(1):
                self.tokens.append((found.group(1), line))
            line += found.group(0).count("\n")
            at = found.end()
        self.tokens.append(("", line))
        self.at = 0

    def next(self):
        return self.tokens[self.at][0]

    def line(self):
        return self.tokens[self.at][1]

    def take(self, wanted=None):
        token, line = self.tokens[self.at]
        if wanted and token != wanted:
            raise Fault("line %d: %s expected, not %r" % (line, wanted, token))
        self.at += 1
        return token

    def taken(self, wanted):
        if self.next() != wanted:
            return False
        self.at += 1
        return True

    def unit(self):
        kind, name = self.take(), self.take()
        if kind not in ("FUNCTION", "FUNCTION_BLOCK", "PROGRAM"):
            raise Fault("line %d: %s" % (self.line(), kind))
        answer = self.type() if kind == "FUNCTION" and self.taken(":") else None
        variables = {}
        while self.next().startswith("VAR"):
            section = self.take()
            constant = self.taken("CONSTANT")
            while not self.taken("END_VAR"):
                variable = self.take()
                if variable in variables:
                    raise Fault("line %d: %s twice" % (self.line(), variable))
                self.take(":")
                kind_of = self.type()
                start = self.expression() if self.taken(":=") else None
                self.take(";")
                variables[variable] = (section, constant, kind_of, start)
        return name, {"kind": kind, "answer": answer, "variables": variables,
                      "body": self.statements("END_" + kind)}

    def type(self):
        if not self.taken("ARRAY"):
            return self.take()
        self.take("["), self.take("0"), self.take("..")
        last = int(self.take())
        self.take("]"), self.take("OF")
        return ("ARRAY", last + 1, self.take())

    def statements(self, *ends):
        found = []
        while self.next() not in ends:
            found.append(self.statement())
        if len(ends) == 1:
            self.take()
        return found

    def statement(self):
        line = self.line()
        if self.taken("IF"):
            branches, other = [], []
            while True:
                condition = self.expression()
                self.take("THEN")
                branches.append((condition, self.statements("ELSIF", "ELSE", "END_IF")))
                if self.taken("ELSIF"):
                    continue
                if self.taken("ELSE"):
                    other = self.statements("END_IF")
                else:
                    self.take("END_IF")
                self.take(";")
                return ("if", line, branches, other)
        name = self.take()
        if self.taken("("):
            arguments = self.arguments()
            self.take(";")
            return ("call", line, name, arguments)
        index = None
        if self.taken("["):
            index = self.expression()
            self.take("]")
        self.take(":=")
        value = self.expression()
        self.take(";")
        return ("set", line, name, index, value)

    def arguments(self):
        found = []
        while not self.taken(")"):
            name = None
            if self.tokens[self.at + 1][0] == ":=":
                name = self.take()
                self.take(":=")
            found.append((name, self.expression()))
            self.taken(",")
        return found

    LEVELS = [("OR",), ("AND",), ("=", "<>"), ("<", "<=", ">", ">="), ("+", "-"), ("*", "MOD")]

    def expression(self, level=0):
        if level == len(self.LEVELS):
            return self.factor()
        left = self.expression(level + 1)
        while self.next() in self.LEVELS[level]:
            line, sign = self.line(), self.take()
            left = ("binary", line, sign, left, self.expression(level + 1))
        return left

    def factor(self):
        line, token = self.line(), self.take()
        if token in ("NOT", "-"):
            return (token, line, self.factor())
        if token == "(":
            inner = self.expression()
            self.take(")")
            return inner
        if token.startswith("16#"):
            return ("value", int(token[3:], 16))
        if token.startswith("T#"):
            return ("value", int(token[2:-2]) * 1e-3 if token.endswith("ms") else float(token[2:-1]))
        if token in ("TRUE", "FALSE"):
            return ("value", token == "TRUE")
        if token[0].isdigit():
            return ("value", float(token) if "." in token else int(token))
        if self.taken("("):
            return ("function", line, token, self.arguments())
        if self.taken("["):
            index = self.expression()
            self.take("]")
            return ("element", line, token, index)
        if self.taken("."):
            return ("member", line, token, self.take())
        return ("name", line, token)


class Timer:
    """TON: Q once IN has been true for PT."""

    def __init__(self, clock):
        self.clock, self.since, self.values = clock, None, {"Q": False, "IN": False, "PT": 0.0}

    def call(self, inputs):
        self.values.update(inputs)
        if not self.values["IN"]:
            self.since = None
        elif self.since is None:
            self.since = self.clock()
        self.values["Q"] = self.since is not None and self.clock() - self.since >= self.values["PT"]


FUNCTIONS = {
    "SHR": lambda value, count: value >> count,
    "EXPT": lambda base, exponent: float(base) ** exponent,
    "DINT_TO_REAL": float,
    "WORD_TO_INT": int, "WORD_TO_UINT": int, "WORD_TO_DINT": int, "UINT_TO_WORD": int,
    "DINT_TO_DWORD": lambda value: value & 0xFFFFFFFF,
    "DWORD_TO_WORD": lambda value: value & 0xFFFF,
}


class Instance:
    """A function block or program with its values; `library` holds every unit that was parsed."""

    def __init__(self, name, library, clock):
        self.name, self.library, self.clock = name, library, clock
        self.unit = library[name]
        self.values, self.types = {}, {}
        for variable, (_, _, kind, start) in self.unit["variables"].items():
            self.types[variable] = kind
            self.values[variable] = self.first(kind) if start is None else self.value(start)

    def first(self, kind):
        if isinstance(kind, tuple):
            return [self.first(kind[2])] * kind[1]
        if kind == "TON":
            return Timer(self.clock)
        if kind in self.library:
            return Instance(kind, self.library, self.clock)
        if kind not in RANGES and kind not in ("REAL", "TIME"):
            raise Fault("%s: type %s" % (self.name, kind))
        return {"BOOL": False, "REAL": 0.0, "TIME": 0.0}.get(kind, 0)

    def call(self, inputs):
        for name, value in inputs.items():
            if self.unit["variables"].get(name, ("",))[0] != "VAR_INPUT":
                raise Fault("%s has no input %s" % (self.name, name))
            self.store(0, name, None, value)
        self.run(self.unit["body"])

    def store(self, line, name, index, value):
        if name == self.name and self.unit["answer"]:
            self.values[name] = float(value)
            return
        if name not in self.types or self.unit["variables"][name][1]:
            raise Fault("%s, line %d: %s cannot be set" % (self.name, line, name))
        kind = self.types[name]
        if isinstance(kind, tuple):
            if index is None:
                if len(value) != kind[1]:
                    raise Fault("%s, line %d: %s has %d elements" % (self.name, line, name, kind[1]))
                self.values[name] = list(value)
                return
            kind = kind[2]
        if kind in RANGES:
            low, high = RANGES[kind]
            if not low <= value <= high or isinstance(value, float) or isinstance(value, bool) != (kind == "BOOL"):
                raise Fault("%s, line %d: %s := %r is no %s" % (self.name, line, name, value, kind))
        elif kind == "REAL" and not isinstance(value, float):
            raise Fault("%s, line %d: %s := %r is no REAL" % (self.name, line, name, value))
        if index is None:
            self.values[name] = value
        else:
            self.values[name][index] = value

    def run(self, statements):
        for kind, line, *parts in statements:
            if kind == "if":
                chosen = next((body for condition, body in parts[0] if self.truth(line, condition)), parts[1])
                self.run(chosen)
            elif kind == "set":
                index = None if parts[1] is None else self.value(parts[1])
                self.store(line, parts[0], index, self.value(parts[2]))
            else:
                self.values[parts[0]].call({name: self.value(value) for name, value in parts[1]})

    def truth(self, line, expression):
        value = self.value(expression)
        if not isinstance(value, bool):
            raise Fault("%s, line %d: %r is no condition" % (self.name, line, value))
        return value

    def value(self, expression):
        kind = expression[0]
        if kind == "value":
            return expression[1]
        line = expression[1]
        if kind in ("name", "element", "member"):
            if expression[2] not in self.values:
                raise Fault("%s, line %d: %s is not declared" % (self.name, line, expression[2]))
            found = self.values[expression[2]]
            if kind == "element":
                return found[self.value(expression[3])]
            return found.values[expression[3]] if kind == "member" else found
        if kind == "NOT":
            return not self.truth(line, expression[2])
        if kind == "-":
            return -self.value(expression[2])
        if kind == "function":
            return self.function(line, expression[2], expression[3])
        return self.binary(line, expression[2], self.value(expression[3]), self.value(expression[4]))

    def function(self, line, name, arguments):
        if name in FUNCTIONS:
            return FUNCTIONS[name](*(self.value(value) for _, value in arguments))
        if name not in self.library:
            raise Fault("%s, line %d: no function %s" % (self.name, line, name))
        called = Instance(name, self.library, self.clock)
        called.call({given: self.value(value) for given, value in arguments})
        return called.values[name]

    def binary(self, line, sign, left, right):
        both_bool = isinstance(left, bool) and isinstance(right, bool)
        if isinstance(left, bool) != isinstance(right, bool):
            raise Fault("%s, line %d: %r %s %r" % (self.name, line, left, sign, right))
        if sign in ("AND", "OR"):
            both = (left and right, left or right) if both_bool else (left & right, left | right)
            return both[sign == "OR"]
        return {"=": lambda: left == right, "<>": lambda: left != right, "<": lambda: left < right,
                "<=": lambda: left <= right, ">": lambda: left > right, ">=": lambda: left >= right,
                "+": lambda: left + right, "-": lambda: left - right, "*": lambda: left * right,
                "MOD": lambda: left % right}[sign]()


def load(texts):
    """Every unit of the texts, by name."""
    library = {}
    for text in texts:
        parser = Parser(text)
        while parser.next():
            name, unit = parser.unit()
            library[name] = unit
    return library
