"""PROTOCOL.md, "Objects": offers, answers, pieces, withdrawals. Messages here are without their type byte."""

import hashlib
import struct
from dataclasses import dataclass, field

from .bulk import HEAD_BYTES, MOST_BYTES, OBJECT_ANSWER, OFFER, PIECE, WITHDRAWAL
from .numbers import Reader
from .sodium import Refused

GRANULE = 16
MOST_OBJECT_BYTES = 64 << 20
RECEIVING, COMPLETE, REFUSED, GONE = range(4)
TOO_LARGE, NO_ROOM, TOO_MANY, CORRUPT = 1, 2, 3, 4
_MOST_RANGES, _MOST_ROUNDS = 128, 3
_PIECE_HEAD = struct.Struct("<II")
PIECE_BYTES = (MOST_BYTES - 32 - HEAD_BYTES - _PIECE_HEAD.size) // GRANULE * GRANULE  # fits where 1232 vanish
_LEAST_AGAIN_US, _MOST_AGAIN_US = 20_000, 1_000_000


def hash_of(data):
    return hashlib.blake2b(data, digest_size=32).digest()


def granules(size):
    return -(-size // GRANULE)


@dataclass
class Offer:
    id: int
    slot: int
    ask: int
    size: int
    hash: bytes

    def write(self):
        return struct.pack("<IIHQ", self.id, self.slot, self.ask, self.size) + self.hash

    @staticmethod
    def read(message):
        reader = Reader(message)
        offer = Offer(*reader.unpack("IIHQ"), reader.bytes(32))
        reader.end()
        if not offer.id or not offer.size:
            raise Refused("an offer's id or size")
        return offer


@dataclass
class ObjectAnswer:
    id: int
    revision: int
    ask: int
    state: int
    reason: int = 0
    round: int = 0
    ranges: list = field(default_factory=list)  # [begin, end) in granules

    def write(self):
        return (struct.pack("<IIHBBBB", self.id, self.revision, self.ask, self.state, self.reason, self.round,
                            len(self.ranges)) + b"".join(struct.pack("<II", *r) for r in self.ranges))

    @staticmethod
    def read(message):
        reader = Reader(message)
        *head, count = reader.unpack("IIHBBBB")
        answer = ObjectAnswer(*head, [reader.unpack("II") for _ in range(count)])
        reader.end()
        end = -1
        for begin, next_end in answer.ranges:
            if begin <= end or next_end <= begin:
                raise Refused("ranges of an object answer")
            end = next_end
        if (answer.state > GONE or answer.reason > CORRUPT or (answer.reason != 0) != (answer.state == REFUSED) or
                count > _MOST_RANGES or (count and answer.state != RECEIVING)):
            raise Refused("an object answer")
        return answer


class _Incoming:
    def __init__(self, offer):
        self.offer, self.data = offer, bytearray(offer.size)
        self.here, self.missing, self.round = bytearray(granules(offer.size)), granules(offer.size), 0

    def put(self, granule, data):
        for i in range(granules(len(data))):
            if not self.here[granule + i]:
                self.here[granule + i] = 1
                self.missing -= 1
                at = (granule + i) * GRANULE
                part = data[i * GRANULE:(i + 1) * GRANULE]
                self.data[at:at + len(part)] = part

    def ranges(self):
        out, at = [], 0
        while len(out) < _MOST_RANGES and (begin := self.here.find(1, at)) >= 0:
            at = self.here.find(0, begin)
            at = len(self.here) if at < 0 else at
            out.append((begin, at))
        return out


class ObjectsIn:
    """Receives objects. `send(kind, message)` sends a statement; `delivered` has the last object of each slot."""

    def __init__(self, send):
        self._send, self._revision = send, 0
        self._newest = {}  # slot -> greatest id
        self._incoming = {}  # id -> _Incoming
        self._ask = {}
        self._corrupt = set()
        self.delivered, self.answered = {}, set()
        self.most_round, self.spoil_rounds = 0, 0  # so many times a byte is changed when all is here

    def _answer(self, id, state, reason=0, round_=0, ranges=()):
        self._revision += 1
        self.answered.add(state)
        self.most_round = max(self.most_round, round_)
        self._send(OBJECT_ANSWER, ObjectAnswer(id, self._revision, self._ask.get(id, 0), state, reason, round_,
                                               list(ranges)).write())

    def refuse(self, offer, reason):
        self._ask[offer.id] = offer.ask
        self._answer(offer.id, REFUSED, reason)

    def on_offer(self, message):
        offer = Offer.read(message)
        self._ask[offer.id] = offer.ask
        if offer.id < self._newest.get(offer.slot, 0):
            self._answer(offer.id, GONE)
        elif offer.size > MOST_OBJECT_BYTES:
            self._answer(offer.id, REFUSED, TOO_LARGE)
        elif offer.id in self._corrupt:
            self._answer(offer.id, REFUSED, CORRUPT, _MOST_ROUNDS)
        else:
            self._take_offer(offer)

    def _take_offer(self, offer):
        before = self._newest.get(offer.slot)
        if before is not None and before < offer.id:
            self._incoming.pop(before, None)
        self._newest[offer.slot] = offer.id
        last = self.delivered.get(offer.slot)
        if last is not None and hash_of(last) == offer.hash:
            self._answer(offer.id, COMPLETE)
            return
        mine = self._incoming.setdefault(offer.id, _Incoming(offer))
        if (mine.offer.size, mine.offer.hash) != (offer.size, offer.hash):
            raise Refused("another object under the same id")
        self._answer(offer.id, RECEIVING, 0, mine.round, mine.ranges())

    def on_piece(self, body):
        """What follows the bulk head of a piece."""
        reader = Reader(body)
        id, granule = reader.unpack("II")
        data, mine = reader.bytes(reader.left()), self._incoming.get(id)
        if mine is None:
            return
        end = granule * GRANULE + len(data)
        if not data or end > mine.offer.size or (len(data) % GRANULE and end != mine.offer.size):
            raise Refused("a piece beyond its object, or not of whole granules")
        mine.put(granule, data)
        if mine.missing:
            return
        if mine.round < self.spoil_rounds:
            mine.data[0] ^= 1
        if hash_of(bytes(mine.data)) == mine.offer.hash:
            del self._incoming[id]
            self.delivered[mine.offer.slot] = bytes(mine.data)
            self._answer(id, COMPLETE)
            return
        again = _Incoming(mine.offer)
        again.round = mine.round + 1
        if again.round >= _MOST_ROUNDS:
            del self._incoming[id]
            self._corrupt.add(id)
            self._answer(id, REFUSED, CORRUPT, again.round)
        else:
            self._incoming[id] = again
            self._answer(id, RECEIVING, 0, again.round)

    def on_withdrawal(self, message):
        reader = Reader(message)
        id = reader.one("I")
        reader.end()
        self._incoming.pop(id, None)
        self._answer(id, GONE)


class ObjectOut:
    """Sends one object. `send(kind, message)` sends a statement, `numbered` heads the pieces."""

    def __init__(self, id, slot, data, send, numbered, now_us, hash_=None):
        self.id, self.data = id, data
        self._send, self._numbered, self._now_us = send, numbered, now_us
        self._offer = Offer(id, slot, 0, len(data), hash_ or hash_of(data))
        self._next_offer_us, self._pause_us = 0, _LEAST_AGAIN_US
        self._revision, self._round = 0, 0
        self._wanted = None  # granules to send, as [begin, end), or None while none are asked for
        self.state, self.reason = None, 0

    def _say(self):
        self._offer.ask = (self._offer.ask + 1) & 0xFFFF
        self._send(OFFER, self._offer.write())
        self._next_offer_us = self._now_us() + self._pause_us
        self._pause_us = min(2 * self._pause_us, _MOST_AGAIN_US)

    def on_answer(self, answer):
        if answer.id != self.id or answer.revision <= self._revision:
            return
        self._revision, self.state, self.reason = answer.revision, answer.state, answer.reason
        if answer.state != RECEIVING:
            return
        if answer.ask == self._offer.ask or answer.round > self._round:
            self._round = answer.round
            self._wanted, at, total = [], 0, granules(len(self.data))
            for begin, end in answer.ranges + [(total, total)]:
                if end > total:
                    raise Refused("granules beyond the object")
                if begin > at:
                    self._wanted.append((at, begin))
                at = end
            self._numbered.open.clear()

    def is_done(self):
        return self.state in (COMPLETE, GONE) or (self.state == REFUSED and self.reason != NO_ROOM)

    def again(self, what):
        """Pieces that were lost."""
        if self._wanted is not None:
            self._wanted.extend(what)

    def step(self):
        """Sends the offer if it is due, or one piece."""
        if self.is_done():
            return
        if self.state == RECEIVING and self._wanted:
            self._piece()
            self._next_offer_us = self._now_us() + _LEAST_AGAIN_US
            self._pause_us = _LEAST_AGAIN_US
        elif not self._numbered.open and self._now_us() >= self._next_offer_us:
            self._say()

    def _piece(self):
        begin, end = self._wanted.pop(0)
        most = PIECE_BYTES // GRANULE
        if end - begin > most:
            self._wanted.insert(0, (begin + most, end))
            end = begin + most
        head = self._numbered.head((begin, end))
        self._send(PIECE, head + _PIECE_HEAD.pack(self.id, begin) + self.data[begin * GRANULE:end * GRANULE])


__all__ = ["GONE", "COMPLETE", "ObjectAnswer", "ObjectOut", "ObjectsIn", "Offer", "WITHDRAWAL", "hash_of"]
