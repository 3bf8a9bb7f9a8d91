"""PROTOCOL.md, "data": the keys of one handshake, their counter, and the window of those that came."""

import struct

from .datagrams import DATA, MOST_BYTES
from .sodium import TAG_BYTES, Refused

_HEAD = struct.Struct("<B3xIQ")
WINDOW = 2048


class Window:
    """Which of the last 2048 counters came."""

    def __init__(self):
        self._newest, self._bits = -1, 0

    def take(self, counter):
        """Notes a counter; refuses one that came before or is too old to know."""
        if counter > self._newest:
            self._bits = (self._bits << counter - self._newest | 1) & (1 << WINDOW) - 1
            self._newest = counter
            return
        behind = self._newest - counter
        if behind >= WINDOW:
            raise Refused("a counter older than the window")
        if self._bits >> behind & 1:
            raise Refused("a counter that came before")
        self._bits |= 1 << behind


class Keys:
    """Seals what goes to the other end of a lane, opens what comes from there."""

    def __init__(self, suite, send_key, receive_key, own_index, other_index):
        self.suite, self.own_index, self.other_index = suite, own_index, other_index
        self._send_key, self._receive_key = send_key, receive_key
        self._counter, self._window = 0, Window()

    def seal(self, kind, message):
        head = _HEAD.pack(DATA, self.other_index, self._counter)
        datagram = head + self.suite.seal(self._send_key, self._counter, head, bytes([kind]) + message)
        assert len(datagram) <= MOST_BYTES, "a message that does not fit a datagram"
        self._counter += 1
        return datagram

    def open(self, datagram):
        """Type and bytes of a message. Looks at size, index and tag, and only then at the counter."""
        if not _HEAD.size + 1 + TAG_BYTES <= len(datagram) <= MOST_BYTES:
            raise Refused("length of a data datagram")
        kind, index, counter = _HEAD.unpack_from(datagram)
        if kind != DATA or datagram[1:4] != bytes(3) or index != self.own_index:
            raise Refused("head of a data datagram")
        plain = self.suite.open(self._receive_key, counter, datagram[:_HEAD.size], datagram[_HEAD.size:])
        self._window.take(counter)
        return plain[0], plain[1:]
