"""PROTOCOL.md, "Numbers", "Times" and "The grid" of the haptic lane.

Vectors are tuples of floats, quaternions w, x, y, z.
"""

import math
import struct

from .sodium import Refused

MOST_I24 = 8388607


class Reader:
    """Reads a message from its begin to exactly its end; whatever is not as the page says raises Refused."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def bytes(self, n):
        if n > len(self._data) - self._at:
            raise Refused("a message that is too short")
        self._at += n
        return self._data[self._at - n:self._at]

    def left(self):
        return len(self._data) - self._at

    def end(self):
        if self.left():
            raise Refused("a message that is too long")

    def unpack(self, form):
        return struct.unpack("<" + form, self.bytes(struct.calcsize("<" + form)))

    def one(self, form):
        return self.unpack(form)[0]

    def floats(self, form, most=math.inf, least=None):
        """Finite floats of which none is beyond +-most, or outside least to most."""
        values = self.unpack(form)
        for v in values:
            if not math.isfinite(v) or not (-most if least is None else least) <= v <= most:
                raise Refused(f"a value out of range: {v}")
        return values

    def f24(self):
        value = struct.unpack("<f", b"\0" + self.bytes(3))[0]
        if not math.isfinite(value):
            raise Refused("an f24 that is not finite")
        return value

    def i24(self):
        value = int.from_bytes(self.bytes(3), "little", signed=True)
        if value < -MOST_I24:
            raise Refused("an i24 of -2^23")
        return value


def f24(value):
    bits = struct.unpack("<I", struct.pack("<f", value))[0]
    upper = bits >> 8
    low = bits & 0xFF
    if low > 0x80 or (low == 0x80 and upper & 1):
        upper += 1
    return upper.to_bytes(3, "little")


def i24(value):
    assert -MOST_I24 <= value <= MOST_I24
    return value.to_bytes(3, "little", signed=True)


def halves(values):
    return struct.pack(f"<{len(values)}e", *values)


# Vectors


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def norm(a):
    return math.sqrt(dot(a, a))


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def scaled(a, k):
    return tuple(x * k for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    return scaled(a, 1 / norm(a))


def rotate(q, v):
    """The vector turned by the unit quaternion."""
    t = scaled(cross(q[1:], v), 2)
    return add(add(v, scaled(t, q[0])), cross(q[1:], t))


# Direction


def _fold(u, v):
    return math.copysign(1 - abs(v), u), math.copysign(1 - abs(u), v)


def _signed_zero_is_positive(x):
    return x + 0.0 if x else 0.0


def write_direction(n):
    total = sum(abs(x) for x in n)
    u, v = _signed_zero_is_positive(n[0] / total), _signed_zero_is_positive(n[1] / total)
    if n[2] < 0:
        u, v = _fold(u, v)
    return i24(round(u * MOST_I24)) + i24(round(v * MOST_I24))


def read_direction(reader):
    u, v = reader.i24() / MOST_I24, reader.i24() / MOST_I24
    z = 1 - abs(u) - abs(v)
    x, y = _fold(u, v) if z < 0 else (u, v)
    return unit((x, y, z))


# Rotation

_HALF_RANGE = 2**19
_SCALE = math.sqrt(2) * (2**19 - 1)
_MASK = 2**20 - 1


def write_rotation(q):
    out = max(range(4), key=lambda i: abs(q[i]))
    if q[out] < 0:
        q = scaled(q, -1)
    word, others = out << 60, [q[i] for i in range(4) if i != out]
    for k, c in enumerate(others):
        word |= min(max(round(c * _SCALE + _HALF_RANGE), 1), _MASK) << 20 * k
    return word.to_bytes(8, "little")


def read_rotation(reader):
    word = reader.one("Q")
    if word >> 62:
        raise Refused("bits 62 and 63 of a rotation")
    out, others = word >> 60 & 3, []
    for k in range(3):
        bits = word >> 20 * k & _MASK
        if not bits:
            raise Refused("a rotation's component of 0 bits")
        others.append((bits - _HALF_RANGE) / _SCALE)
    rest = 1 - dot(others, others)
    if rest < 0:
        raise Refused("a rotation whose components are too large")
    others.insert(out, math.sqrt(rest))
    return tuple(others)


# Times


class Clock:
    """Writes and reads `times` at one end: its t_send, the echo of the other's newest, and how long that was held."""

    MOST_HOLD_US = 65535

    def __init__(self, now_us):
        self._now_us = now_us
        self._echo, self._arrived = 0, None

    def write(self):
        now = self._now_us()
        hold = self.MOST_HOLD_US if self._arrived is None else min(now - self._arrived, self.MOST_HOLD_US)
        return struct.pack("<IIH", now & 0xFFFFFFFF, self._echo, hold)

    def note(self, t_send):
        self._echo, self._arrived = t_send, self._now_us()

    def round_trip_us(self, t_echo, hold):
        """The round trip, or None where the other end has nothing to echo."""
        if hold == self.MOST_HOLD_US:
            return None
        return (self._now_us() - t_echo - hold) & 0xFFFFFFFF


# The grid


class Grid:
    """The session's grid: positions as steps from the middle."""

    BYTES = 25

    def __init__(self, middle, exponent):
        if not -24 <= exponent <= -20:
            raise Refused("a grid's exponent")
        self.middle, self.exponent, self.step = middle, exponent, 2.0**exponent

    @staticmethod
    def read(reader):
        middle = reader.floats("3d")
        return Grid(middle, reader.one("b"))

    def write(self):
        return struct.pack("<3db", *self.middle, self.exponent)

    def steps(self, vector):
        """Whole steps that are nearest to the vector, or None where they do not fit."""
        out = tuple(round(x / self.step) for x in vector)
        return out if all(abs(k) <= MOST_I24 for k in out) else None

    def position_steps(self, p):
        return self.steps(sub(p, self.middle))

    def vector(self, steps):
        return scaled(steps, self.step)

    def position(self, steps):
        return add(self.middle, self.vector(steps))


def write_steps(steps):
    return b"".join(i24(k) for k in steps)


def read_steps(reader):
    return tuple(reader.i24() for _ in range(3))
