"""A lane at either end: its handshakes and the keys in use, without sockets.

PROTOCOL.md, "Two lanes, one port" and "The handshake".
"""

import time

from . import datagrams as d
from .keys import Keys
from .noise import NO_PSK, Initiator, Responder
from .sodium import SUITES, Refused, public_key


class Counter:
    """Handshake counters: the greater of the wall clock and the last one + 1."""

    def __init__(self):
        self._last = 0

    def __call__(self):
        self._last = max(time.time_ns(), self._last + 1)
        return self._last


class _Lane:
    """Both ends listen to the newest keys and to the ones before."""

    def __init__(self):
        self.keys, self.before = None, None

    def _renew(self, keys):
        self.before, self.keys = self.keys, keys

    def open(self, datagram):
        for keys in (self.keys, self.before):
            if keys and datagram[4:8] == keys.own_index.to_bytes(4, "little"):
                return keys, *keys.open(datagram)
        raise Refused("data for no keys of this lane")


class MasterLane(_Lane):
    """Begins handshakes. `cookie` and `response` are what the last ones brought."""

    def __init__(self, lane, suite, secret, slave_public, counter, master, psk=NO_PSK):
        super().__init__()
        self.lane, self.suite, self.cookie, self.response, self.denial = lane, suite, None, None, None
        self._secret, self._slave, self._counter, self._master, self._psk = secret, slave_public, counter, master, psk
        self._noise = None

    def initiation(self, session=0, version=d.VERSION, slave=None, counter=None):
        """A new initiation; what is not the page's own are wrong things that a test wants to send."""
        slave = slave or self._slave
        self._index = d.new_index(self.lane)
        head = bytes([d.INITIATION, version, self.suite.number, self.lane]) + self._index.to_bytes(4, "little")
        self._noise = Initiator(self.suite, d.prologue(head), self._secret, slave, self._psk)
        payload = d.Initiation(counter or self._counter(), self._master, time.time_ns(), self._index, session)
        out = d.with_macs(head + self._noise.write(payload.write()), slave, self.cookie)
        self._mac1 = out[-32:-16]
        return out

    def read(self, datagram):
        """Takes a response, a cookie reply or a denial of the last initiation; what it was."""
        kind = datagram[0] if datagram else None
        if self._noise is None:
            raise Refused("an answer to no initiation")
        if kind == d.RESPONSE and len(datagram) == d.RESPONSE_BYTES:
            self._read_response(datagram)
        elif kind == d.COOKIE_REPLY:
            index, cookie = d.read_cookie_reply(datagram, self._mac1, self._slave)
            if index != self._index:
                raise Refused("a cookie reply for another initiation")
            self.cookie = cookie
        elif kind == d.DENIAL and len(datagram) == d.DENIAL_BYTES:
            version, reason, index = d.read_denial(datagram)
            if index != self._index:
                raise Refused("a denial of another initiation")
            self.denial = reason
        else:
            raise Refused("neither response nor cookie reply nor denial")
        return kind

    def _read_response(self, datagram):
        head = bytes([d.RESPONSE, d.VERSION, self.suite.number, self.lane])
        other, own = (int.from_bytes(datagram[i:i + 4], "little") for i in (4, 8))
        if datagram[:4] != head or own != self._index or other & 1 != (self.lane != d.HAPTIC) or not other:
            raise Refused("head of a response")
        d.check_mac1(datagram, public_key(self._secret))
        if datagram[-16:] != bytes(16):
            raise Refused("mac2 of a response is not zeros")
        response = d.Response.read(self._noise.read(datagram[12:100]))
        if (response.sender, response.receiver) != (other, own):
            raise Refused("indices in a response")
        if response.verdict > d.NOT_ALLOWED or (response.verdict != d.WELCOME) != (response.session == 0):
            raise Refused("verdict and session of a response")
        self.response = response
        if response.verdict == d.WELCOME:
            first, second = self._noise.keys()
            self._renew(Keys(self.suite, first, second, own, other))
        self._noise = None

    def seal(self, kind, message):
        return self.keys.seal(kind, message)


class SlaveLane(_Lane):
    """Answers handshakes; sends with new keys once a datagram sealed with them has come."""

    def __init__(self):
        super().__init__()
        self._next = None

    def expect(self, keys):
        self._next = keys

    def open(self, datagram):
        if self._next and datagram[4:8] == self._next.own_index.to_bytes(4, "little"):
            kind, message = self._next.open(datagram)
            keys, self._next = self._next, None
            self._renew(keys)
            return keys, kind, message
        return super().open(datagram)

    def seal(self, kind, message):
        return self.keys.seal(kind, message)


def read_initiation(datagram, secret):
    """The suite, the handshake and the payload of an initiation for the slave with this secret key."""
    if len(datagram) != d.INITIATION_BYTES or datagram[0] != d.INITIATION or datagram[1] != d.VERSION or datagram[3] > 1:
        raise Refused("head of an initiation")
    suite = next((s for s in SUITES if s.number == datagram[2]), None)
    if suite is None:
        raise Refused("another suite")
    d.check_mac1(datagram, public_key(secret))
    noise = Responder(suite, d.prologue(datagram), secret)
    payload = d.Initiation.read(noise.read(datagram[8:192]))
    if payload.sender.to_bytes(4, "little") != datagram[4:8] or payload.sender & 1 != datagram[3] or not payload.sender:
        raise Refused("index of an initiation")
    return suite, noise, payload


def write_response(suite, lane, noise, initiation, epoch, session, verdict, psk=NO_PSK):
    """The response, and the keys it makes."""
    index = d.new_index(lane)
    head = (bytes([d.RESPONSE, d.VERSION, suite.number, lane]) + index.to_bytes(4, "little") +
            initiation.sender.to_bytes(4, "little"))
    payload = d.Response(epoch, session, verdict, time.time_ns(), index, initiation.sender)
    out = d.with_macs(head + noise.write(payload.write(), psk), noise.initiator)
    first, second = noise.keys()
    return out, Keys(suite, second, first, index, initiation.sender)
