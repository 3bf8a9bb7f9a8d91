"""PROTOCOL.md, "Datagrams" and the macs of "The handshake": heads, payloads, macs, cookies, denials."""

import hashlib
import os
import struct
from dataclasses import dataclass

from .sodium import Refused, open_x, seal_x

MOST_BYTES = 1232
INITIATION, RESPONSE, COOKIE_REPLY, DATA, DENIAL = 1, 2, 3, 4, 5
INITIATION_BYTES, RESPONSE_BYTES, COOKIE_REPLY_BYTES, DENIAL_BYTES = 224, 132, 64, 8
VERSION = 3
HAPTIC, BULK, SIDE = 0, 1, 2
WELCOME, BUSY, NO_SUCH_SESSION, NOT_ALLOWED = 0, 1, 2, 3
OTHER_SUITE, OTHER_VERSION, OTHER_KEY, UNKNOWN_OPERATOR, EXPIRED_OPERATOR, OLD_COUNTER = 1, 2, 3, 4, 5, 6
_MAC_BYTES = 16


def new_index(lane):
    """A random u32, not 0, whose lowest bit is 0 on the haptic lane alone."""
    while True:
        index = int.from_bytes(os.urandom(4), "little") & ~1 | (lane != HAPTIC)
        if index:
            return index


def prologue(initiation_head):
    return b"farfeel 3" + initiation_head[:4]


def _keyed(label, public):
    return hashlib.blake2b(label + public, digest_size=32).digest()


def mac1_of(before, receiver_public):
    return hashlib.blake2b(before, digest_size=_MAC_BYTES, key=_keyed(b"mac1----", receiver_public)).digest()


def mac2_of(before, cookie):
    return hashlib.blake2b(before, digest_size=_MAC_BYTES, key=cookie).digest() if cookie else bytes(_MAC_BYTES)


def with_macs(datagram, receiver_public, cookie=None):
    """The datagram, then mac1 and mac2 over all before each."""
    datagram += mac1_of(datagram, receiver_public)
    return datagram + mac2_of(datagram, cookie)


def check_mac1(datagram, own_public):
    if mac1_of(datagram[:-32], own_public) != datagram[-32:-16]:
        raise Refused("mac1")


def cookie_key(slave_public):
    return _keyed(b"cookie--", slave_public)


def write_cookie_reply(receiver_index, cookie, mac1, slave_public):
    nonce = os.urandom(24)
    return (struct.pack("<BBHI", COOKIE_REPLY, VERSION, 0, receiver_index) + nonce +
            seal_x(cookie_key(slave_public), nonce, mac1, cookie))


def read_cookie_reply(datagram, mac1, slave_public):
    """The cookie in an answer to the initiation that had this mac1."""
    if len(datagram) != COOKIE_REPLY_BYTES:
        raise Refused("length of a cookie reply")
    kind, version, zero, index = struct.unpack_from("<BBHI", datagram)
    if kind != COOKIE_REPLY or version != VERSION or zero:
        raise Refused("head of a cookie reply")
    return index, open_x(cookie_key(slave_public), datagram[8:32], mac1, datagram[32:])


@dataclass
class Initiation:
    """An initiation's payload, 88 bytes."""
    counter: int
    master: int
    wall_ns: int
    sender: int
    session: int

    def write(self):
        return struct.pack("<QQqII", self.counter, self.master, self.wall_ns, self.sender, self.session).ljust(88, b"\0")

    @staticmethod
    def read(payload):
        return Initiation(*struct.unpack_from("<QQqII", payload))


@dataclass
class Response:
    """A response's payload, 40 bytes."""
    epoch: int
    session: int
    verdict: int
    wall_ns: int
    sender: int
    receiver: int

    def write(self):
        return struct.pack("<QIBxxxqII", self.epoch, self.session, self.verdict, self.wall_ns, self.sender,
                           self.receiver).ljust(40, b"\0")

    @staticmethod
    def read(payload):
        return Response(*struct.unpack_from("<QIBxxxqII", payload))


def write_denial(reason, receiver_index):
    return struct.pack("<BBBBI", DENIAL, VERSION, reason, 0, receiver_index)


def read_denial(datagram):
    """Version of the slave, reason, receiver index."""
    kind, version, reason, zero, index = struct.unpack("<BBBBI", datagram)
    if kind != DENIAL or zero:
        raise Refused("a denial's head")
    return version, reason, index
