"""PROTOCOL.md, "A session" (types of messages) and the small messages of "Messages of the bulk lane"."""

import math
import struct
from dataclasses import dataclass

from .sodium import Refused

BYE, KEEP_ALIVE, CHALLENGE, CHALLENGE_ANSWER, STATUS, TILE_REQUEST = 1, 2, 3, 4, 9, 10
EDIT_REQUEST, EDIT_ANSWER, SCENE_NEWS, SAVE_REQUEST, SAVE_ANSWER = 11, 12, 13, 14, 15
TILES_HELD = 18
REFUSED, DONE, TO_BE_KEPT, DURABLE = 0, 1, 2, 3
STAMP, SPAWN, MOVE, REMOVE, REVERT = 1, 2, 3, 4, 5
DONE, NOT_TRUSTED, LIED = 1, 2, 3
KEEP_ALIVE_S = 0.020
BYES = 3
CHALLENGE_BYTES = 8


def write_bye(reason=DONE):
    return bytes([reason])


def read_bye(message):
    if len(message) != 1 or message[0] not in (DONE, NOT_TRUSTED, LIED):
        raise Refused("a bye")
    return message[0]


def write_tile_request(round_=1):
    return struct.pack("<I", round_)


def read_tile_request(message):
    if len(message) != 4 or message == bytes(4):
        raise Refused("a tile request")
    return struct.unpack("<I", message)[0]


def write_tiles_held(surface, first, hashes):
    return struct.pack(f"<II{len(hashes)}I", surface, first, *hashes)


@dataclass
class Course:
    """What an object does from a scene time on, 137 bytes."""
    object: int
    version: int
    begin_s: float
    takes_s: float
    is_there: bool
    begin: tuple  # position and quaternion
    end: tuple

    @staticmethod
    def read(message):
        if len(message) != 137:
            raise Refused("length of a course")
        object_, version, begin_s, takes_s, there, *poses = struct.unpack("<IIddB14d", message)
        begin, end = tuple(poses[:7]), tuple(poses[7:])
        if version == 0 or not 0 <= begin_s <= 1e9 or not 0 <= takes_s <= 3600 or there > 1:
            raise Refused("a value of a course")
        for pose in (begin, end):
            if not all(math.isfinite(x) for x in pose) or abs(math.hypot(*pose[3:]) - 1) > 1e-6:
                raise Refused("a pose of a course")
        return Course(object_, version, begin_s, takes_s, there == 1, begin, end)


@dataclass
class EditRequest:
    number: int
    kind: int
    name: str
    place: tuple = (0.0, 0.0, 0.0)
    radius_m: float = 0.0
    depth_m: float = 0.0
    takes_s: float = 0.0
    pose: tuple = ()  # position and quaternion

    def write(self):
        name = self.name.encode()
        return (struct.pack("<QBBB", self.number, self.kind, bool(self.pose), len(name)) + name +
                struct.pack("<6d", *self.place, self.radius_m, self.depth_m, self.takes_s) +
                struct.pack(f"<{len(self.pose)}d", *self.pose))


def _words(message, at):
    size = int.from_bytes(message[at:at + 2], "little")
    if size > 400 or len(message) != at + 2 + size:
        raise Refused("length of words")
    return message[at + 2:].decode()


@dataclass
class EditAnswer:
    number: int
    outcome: int
    version: int
    words: str

    @property
    def is_done(self):
        return self.outcome != REFUSED

    @staticmethod
    def read(message):
        number, done, version = struct.unpack_from("<QBI", message)
        if done > DURABLE or number == 0:
            raise Refused("an edit answer")
        return EditAnswer(number, done, version, _words(message, 13))


def write_save_request(number):
    return struct.pack("<Q", number)


@dataclass
class SaveAnswer:
    number: int
    outcome: int  # 0 refused, 1 offered, 2 ask again later
    version: int
    hash: bytes
    words: str

    @staticmethod
    def read(message):
        number, outcome, version, hash_ = struct.unpack_from("<QBI32s", message)
        if outcome > 2 or number == 0 or (outcome != 1 and any(hash_)):
            raise Refused("a save answer")
        return SaveAnswer(number, outcome, version, hash_, _words(message, 45))


def read_scene_news(message):
    """Version and words."""
    version, durable = struct.unpack_from("<II", message)
    if durable > version:
        raise Refused("what is not made yet is not durable")
    return version, _words(message, 8)


@dataclass
class Status:
    """The slave's status, 84 bytes, over the live session."""
    sets_per_second: float
    answer_us: tuple  # p50, p99, maximum
    waiting_us: tuple  # likewise
    received: int
    lost: int
    late: int
    duplicate: int
    malformed: int
    sets_sent: int
    contacts_left_out: int

    def write(self):
        return struct.pack("<7f7Q", self.sets_per_second, *self.answer_us, *self.waiting_us, self.received, self.lost, self.late,
                           self.duplicate, self.malformed, self.sets_sent, self.contacts_left_out)

    @staticmethod
    def read(message):
        if len(message) != 84:
            raise Refused("length of a status")
        v = struct.unpack("<7f7Q", message)
        if not all(math.isfinite(x) and x >= 0 for x in v[:7]):
            raise Refused("a value of a status")
        return Status(v[0], v[1:4], v[4:7], *v[7:])
