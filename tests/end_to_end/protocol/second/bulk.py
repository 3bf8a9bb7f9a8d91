"""PROTOCOL.md, "Numbered messages, receipts and objects": heads and receipts.

What is sent under which number, what came, and what is believed of receipts. Messages here are without their type byte.
"""

import random
import struct
from dataclasses import dataclass

from .numbers import Reader
from .sodium import Refused

RECEIPT, OFFER, OBJECT_ANSWER, WITHDRAWAL = 0x20, 0x21, 0x22, 0x23
PADDING, PIECE, TILE, COURSE = 0x28, 0x29, 0x2A, 0x2B
NUMBERED = range(0x28, 0x30)
MOST_BYTES = 1200  # of a message with its type
_HEAD = struct.Struct("<IIB")  # after the type
HEAD_BYTES = 1 + _HEAD.size
_RECEIPT = struct.Struct("<IIIIBB")
_MOST_RANGES, _MOST_STAMPS = 32, 16
_SPACING_UNIT_US = 250
_MASK = 0xFFFFFFFF
_LEAVE_OUT_EVERY = 32


def _behind(newest, number):
    """How far the number is behind the newest; negative where it is ahead."""
    d = (newest - number) & _MASK
    return d if d < 1 << 31 else d - (1 << 32)


@dataclass
class Receipt:
    newest: int
    echo: int
    arrival: int
    hold: int
    ranges: list  # (gap, length), downwards from newest
    stamps: list  # (back, earlier)

    def write(self):
        out = _RECEIPT.pack(self.newest, self.echo, self.arrival, self.hold, len(self.ranges), len(self.stamps))
        out += b"".join(struct.pack("<HH", *r) for r in self.ranges)
        return out + b"".join(struct.pack("<Bh", *s) for s in self.stamps)

    @staticmethod
    def read(message):
        reader = Reader(message)
        newest, echo, arrival, hold, ranges, stamps = reader.unpack("IIIIBB")
        if not 1 <= ranges <= _MOST_RANGES or stamps > _MOST_STAMPS:
            raise Refused("counts of a receipt")
        out = Receipt(newest, echo, arrival, hold, [reader.unpack("HH") for _ in range(ranges)],
                      [reader.unpack("Bh") for _ in range(stamps)])
        reader.end()
        for i, (gap, length) in enumerate(out.ranges):
            if not length or (gap == 0) != (i == 0):
                raise Refused("a range of a receipt")
        if any(not back for back, _ in out.stamps):
            raise Refused("a stamp of a receipt")
        return out

    def numbers(self):
        at = self.newest
        for gap, length in self.ranges:
            at -= gap
            for _ in range(length):
                yield at & _MASK
                at -= 1


class Arrivals:
    """The receiver of numbered messages: which came, and the receipts that are due."""

    def __init__(self, now_us):
        self._now_us = now_us
        self.newest, self.echo, self.count = None, 0, 0
        self._came = {}  # number -> time of arrival [us]
        self._reported = set()
        self._due, self._last_us, self._spacing_us = False, None, _SPACING_UNIT_US

    KEPT = 8192

    def span(self):
        """From the oldest number that is remembered to the newest."""
        return max(_behind(self.newest, number) for number in self._came) + 1 if self._came else 0

    def take(self, message):
        """The number of a message (without its type) and what follows the head; None of one that came before."""
        if len(message) < _HEAD.size or len(message) + 1 > MOST_BYTES:
            raise Refused("length of a numbered message")
        number, t_send, spacing = _HEAD.unpack_from(message)
        if number in self._came or (self.newest is not None and _behind(self.newest, number) >= self.KEPT):
            return None
        now = self._now_us()
        self._came[number] = now
        self.count += 1
        if self.newest is None or _behind(self.newest, number) < 0:
            self.newest, self.echo, self._arrival = number, t_send, now
            self._spacing_us = min(max(spacing, 1), 100) * _SPACING_UNIT_US
            for old in [n for n in list(self._came)[:16] if _behind(number, n) >= self.KEPT]:
                del self._came[old]
                self._reported.discard(old)
        self._due = True
        return number, message[_HEAD.size:]

    def receipt(self):
        """The receipt that is due now, or None."""
        now = self._now_us()
        if not self._due or (self._last_us is not None and now - self._last_us < self._spacing_us):
            return None
        self._due, self._last_us = False, now
        ranges, gap, length, back = [], 0, 0, 0
        span = self.span()
        while back < span and len(ranges) < _MOST_RANGES:
            if (self.newest - back) & _MASK in self._came:
                length += 1
            elif length:
                ranges.append((gap, length))
                gap, length = 1, 0
            else:
                gap += 1
            back += 1
            if gap > 0xFFFF or length == 0xFFFF:
                break
        if length and len(ranges) < _MOST_RANGES:
            ranges.append((gap, length))
        stamps = []
        for back in range(1, 256):
            number = (self.newest - back) & _MASK
            if number in self._came and number not in self._reported and len(stamps) < _MOST_STAMPS:
                earlier = self._arrival - self._came[number]
                if abs(earlier) < 1 << 15:
                    stamps.append((back, earlier))
        self._reported.update((self.newest - back) & _MASK for back in range(256))
        return Receipt(self.newest, self.echo, self._arrival & _MASK, now - self._arrival, ranges, stamps)


class Numbered:
    """The sender of numbered messages: heads them, leaves numbers out, believes receipts or not."""

    def __init__(self, now_us, random_source=random):
        self._now_us, self._random = now_us, random_source
        self._next = self._first = 1
        self._sent, self.open = {}, {}  # number -> t_send; number -> what it was, while not receipted
        self._left_out = set()
        self.believes, self.round_trip_us = True, None

    def head(self, what, spacing=4):
        """The head of a new message, after its type; `what` comes back from receipts and from lost()."""
        if self._random.randrange(_LEAVE_OUT_EVERY // 2) == 0:
            self._left_out.add(self._next)
            self._next += 1
        number, now = self._next, self._now_us()
        self._next += 1
        self._sent[number], self.open[number] = now, what
        return _HEAD.pack(number & _MASK, now & _MASK, spacing)

    def believe(self, receipt):
        """What was receipted for the first time. A receipt that is not believed changes nothing."""
        if not self.believes:
            return []
        numbers = list(receipt.numbers())
        if any(n in self._left_out for n in numbers):
            self.believes = False
            raise Refused("a receipt of a number that was left out")
        if self._sent.get(receipt.newest) is None or self._sent[receipt.newest] & _MASK != receipt.echo:
            raise Refused("a receipt whose echo is not what was sent")
        if any(n not in self._sent for n in numbers):
            raise Refused("a receipt of a number that was not sent")
        self.round_trip_us = max(0, self._now_us() - self._sent[receipt.newest] - receipt.hold)
        return [self.open.pop(n) for n in numbers if n in self.open]

    def lost(self, after_us):
        """What was sent so long ago without a receipt; it is given up, and is to be sent under a new number."""
        now = self._now_us()
        old = [n for n in self.open if now - self._sent[n] > after_us]
        return [self.open.pop(n) for n in old]
