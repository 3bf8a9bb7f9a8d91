"""PROTOCOL.md, "Messages of the haptic lane": pose message and answer, to bytes and back."""

import struct
from dataclasses import dataclass, field, replace
from typing import Optional, Union

from . import numbers as n
from .sodium import Refused

POSE, ANSWER = 16, 17  # types
MOST_CONTACTS, PLACES, IN_FULL = 32, 64, 255
_FAR, _MOST_WRENCH, _MOST_CURVATURE = 1e4, 65504.0, 1e8


def _u48(value):
    return value.to_bytes(6, "little")


@dataclass
class Line:
    """What a tool that the slave simulates needs: six numbers, and the energy put in so far [J]."""
    values: tuple
    energy_J: float

    def write(self):
        return struct.pack("<7d", *self.values, self.energy_J)

    @staticmethod
    def read(reader):
        return Line(reader.floats("6d", 1e6), reader.floats("d", 1e12, 0)[0])


@dataclass
class Pose:
    number: int
    scene_time_us: int
    times: tuple  # t_send, t_echo, hold
    p_WT: tuple
    R_WT: tuple
    twist: tuple
    heard: Optional[int] = None
    felt: Optional[tuple] = None
    ahead_us: Optional[int] = None
    waves: Optional[Line] = None
    passivity: Optional[Line] = None
    in_full: bool = False
    steps: Optional[tuple] = None

    def write(self, grid):
        steps = grid.position_steps(self.p_WT) if grid else None
        flags = ((self.heard is not None) | (steps is None) << 1 | (self.felt is not None) << 2 |
                 (self.ahead_us is not None) << 3 | (self.waves is not None) << 4 | (self.passivity is not None) << 5)
        out = struct.pack("<BI", flags, self.number) + _u48(self.scene_time_us) + struct.pack("<IIH", *self.times)
        out += struct.pack("<H", self.heard or 0)
        out += n.write_steps(steps) if steps else struct.pack("<3d", *self.p_WT)
        out += n.write_rotation(self.R_WT) + n.halves(self.twist)
        if self.felt is not None:
            out += n.halves(self.felt)
        if self.ahead_us is not None:
            out += struct.pack("<H", self.ahead_us)
        line = self.waves or self.passivity
        return out + (line.write() if line else b"")

    @staticmethod
    def read(message, grid):
        reader = n.Reader(message)
        flags, number = reader.unpack("BI")
        if flags & 0xC0 or flags & 0x30 == 0x30:
            raise Refused("flags of a pose")
        if not number:
            raise Refused("a pose with number 0")
        scene_time = int.from_bytes(reader.bytes(6), "little")
        times, heard = reader.unpack("IIH"), reader.one("H")
        if heard and not flags & 1:
            raise Refused("heard without flag 0")
        steps = None
        if flags & 2:
            p = reader.floats("3d", _FAR)
        else:
            steps = n.read_steps(reader)
            p = grid.position(steps)
            if any(abs(x) > _FAR for x in p):
                raise Refused("a position out of range")
        pose = Pose(number, scene_time, times, p, n.read_rotation(reader), reader.floats("6e", _FAR),
                    heard if flags & 1 else None, in_full=bool(flags & 2), steps=steps)
        if flags & 4:
            pose.felt = reader.floats("6e")
        if flags & 8:
            pose.ahead_us = reader.one("H")
            if pose.ahead_us > 10000:
                raise Refused("ahead")
        if flags & 16:
            pose.waves = Line.read(reader)
        if flags & 32:
            pose.passivity = Line.read(reader)
        reader.end()
        return pose


@dataclass(frozen=True)
class Identity:
    id: int
    object: int
    stiffness: float
    damping: float
    static_friction: float
    dynamic_friction: float

    def write(self):
        return struct.pack("<BII4f", IN_FULL, self.id, self.object, self.stiffness, self.damping, self.static_friction,
                           self.dynamic_friction)

    def is_like(self, other):
        """Whether they differ in the id at most."""
        return other is not None and replace(self, id=other.id) == other


@dataclass(frozen=True)
class Alike:
    """An identity as it may be told: that of a place in all but the id."""
    id: int
    place: int

    def write(self):
        return struct.pack("<BI", self.place, self.id)


def read_identity(reader):
    like, id = reader.unpack("BI")
    if like < PLACES:
        return Alike(id, like)
    if like != IN_FULL:
        raise Refused("a place of the table that is none")
    return Identity(id, reader.one("I"), *reader.floats("f", 1e8, 0), *reader.floats("f", 1e6, 0),
                    *reader.floats("2f", 100, 0))


@dataclass
class Contact:
    place: int
    doubts: int
    r: tuple  # [m] from To, in W
    depth_m: float
    n: tuple
    a: tuple
    c: tuple
    holds_m: float
    share: float = 1.0
    identity: Union[Identity, Alike, None] = None
    curvature: Optional[tuple] = None

    def translation_gradient(self):
        """d depth / d translation of T, in W."""
        return n.sub(self.a, self.n)

    def rotation_gradient(self):
        """d depth / d rotation of T about To, in W."""
        return n.add(n.cross(self.r, self.translation_gradient()), self.c)

    def write(self, grid, in_full):
        out = bytes([self.place | (self.share != 1) << 6 | (self.identity is not None) << 7, self.doubts])
        out += struct.pack("<3d", *self.r) if in_full else n.write_steps(grid.steps(self.r))
        out += struct.pack("<f", self.depth_m) + n.write_direction(self.n) + n.halves(self.a + self.c)
        out += n.f24(self.holds_m)
        if self.share != 1:
            out += n.halves((self.share,))
        if self.identity:
            out += self.identity.write()
        return out + b"".join(n.f24(x) for x in self.curvature or ())

    @staticmethod
    def read(reader, grid, in_full, has_curvature):
        head, doubts = reader.unpack("BB")
        if doubts & 1:
            raise Refused("bit 0 of the doubts")
        r = reader.floats("3d", _FAR) if in_full else grid.vector(n.read_steps(reader))
        contact = Contact(head & 63, doubts, r, reader.floats("f", _FAR)[0], n.read_direction(reader),
                          reader.floats("3e", _FAR), reader.floats("3e"), reader.f24())
        if not 0 <= contact.holds_m <= 1e4:
            raise Refused("how far a contact holds")
        if head & 64:
            contact.share = reader.floats("e", least=0)[0]
        if head & 128:
            contact.identity = read_identity(reader)
        if has_curvature:
            contact.curvature = tuple(reader.f24() for _ in range(21))
            if any(abs(x) > _MOST_CURVATURE for x in contact.curvature):
                raise Refused("a curvature")
        for gradient in (contact.translation_gradient(), contact.rotation_gradient()):
            if any(abs(x) > _FAR for x in gradient):
                raise Refused("a gradient out of range")
        return contact


@dataclass
class Answer:
    number: int
    pose_number: int
    times: tuple
    wrench: tuple  # torque on T about To, force, in W
    contacts: list = field(default_factory=list)
    left_out: int = 0
    pairs_near: int = 0
    X_WT: Optional[tuple] = None  # (p, R), where it is told
    line: Optional[Line] = None

    def write(self, grid, told_in_full=False):
        in_full = any(grid.steps(c.r) is None for c in self.contacts)
        curved = any(c.curvature for c in self.contacts)
        where = 0 if self.X_WT is None else 2 if told_in_full else 1
        out = struct.pack("<BBBHII", where | in_full << 2 | curved << 3 | (self.line is not None) << 4,
                          len(self.contacts), self.left_out, self.pairs_near, self.number, self.pose_number)
        out += struct.pack("<IIH", *self.times) + n.halves(self.wrench)
        if where == 1:
            out += n.write_steps(grid.position_steps(self.X_WT[0])) + n.write_rotation(self.X_WT[1])
        elif where == 2:
            out += struct.pack("<7d", *self.X_WT[0], *self.X_WT[1])
        out += self.line.write() if self.line else b""
        return out + b"".join(c.write(grid, in_full) for c in self.contacts)

    @staticmethod
    def read(message, grid):
        reader = n.Reader(message)
        flags, count, left_out, pairs, number, pose_number = reader.unpack("BBBHII")
        where = flags & 3
        if flags & 0xE0 or where == 3 or count > MOST_CONTACTS or not number:
            raise Refused("head of an answer")
        answer = Answer(number, pose_number, reader.unpack("IIH"), reader.floats("6e", _MOST_WRENCH),
                        left_out=left_out, pairs_near=pairs)
        if where == 1:
            answer.X_WT = grid.position(n.read_steps(reader)), n.read_rotation(reader)
        elif where == 2:
            p, q = reader.floats("3d", _FAR), reader.floats("4d")
            if abs(n.norm(q) - 1) > 1e-6:
                raise Refused("a quaternion that is not of length 1")
            answer.X_WT = p, q
        if flags & 16:
            answer.line = Line.read(reader)
        answer.contacts = [Contact.read(reader, grid, flags & 4, flags & 8) for _ in range(count)]
        reader.end()
        if len({c.place for c in answer.contacts}) != count:
            raise Refused("two contacts at one place")
        return answer


class AnswersRead:
    """The master's side of an answer's acceptance: order, poses sent, and the table of identities."""

    POSES_KEPT = 4096

    def __init__(self):
        self.places, self.newest, self.newest_pose = [None] * PLACES, None, None
        self._first_pose, self._last_pose = 1, 0

    def sent_pose(self, number):
        self._last_pose = number
        self._first_pose = max(1, number - self.POSES_KEPT + 1)

    def take(self, answer):
        """Completes the contacts' identities; refuses what may not be read."""
        if self.newest is not None and not 0 < (answer.number - self.newest) & 0xFFFFFFFF < 1 << 31:
            raise Refused("an answer that is not newer")
        if not self._first_pose <= answer.pose_number <= self._last_pose:
            raise Refused("an answer about a pose that was not sent")
        told = {}  # by this answer, whose contacts are read in their order
        for c in answer.contacts:
            identity = self.places[c.place] if c.identity is None else c.identity
            if isinstance(identity, Alike):
                model = told.get(identity.place, self.places[identity.place])
                identity = model and replace(model, id=identity.id)
            if identity is None:
                raise Refused("an empty place of the table")
            told[c.place] = c.identity = identity
        for place, identity in told.items():
            self.places[place] = identity
        self.newest, self.newest_pose = answer.number, answer.pose_number
        return answer

    def heard(self, next_pose):
        """The field of a pose message: None where flag 0 may not be set."""
        if self.newest is None or next_pose - self.newest_pose >= self.POSES_KEPT:
            return None
        return self.newest & 0xFFFF


class IdentitiesTold:
    """The slave's side of the table: an identity is left out once a pose heard an answer that held it at its place."""

    ANSWERS_KEPT = 2048

    def __init__(self):
        self._held = [None] * PLACES  # the identity at a place, and the number of the answer that first told it
        self._known = [False] * PLACES
        self._answers = {}  # number -> places

    def heard(self, lower_half):
        """From each pose message that is taken: flag 0's number, or None."""
        if lower_half is None:
            self._known = [False] * PLACES
            return
        for number in reversed(self._answers):
            if number & 0xFFFF == lower_half:
                for place in self._answers[number]:
                    if number >= self._held[place][1]:
                        self._known[place] = True
                return

    def tell(self, answer, identities):
        """Leaves out what is known at the other end, and says of the rest what it is like; identities: by place."""
        told = {}
        for c in answer.contacts:
            identity = identities[c.place]
            if self._held[c.place] is None or self._held[c.place][0] != identity:
                self._held[c.place], self._known[c.place] = (identity, answer.number), False
            c.identity = None if self._known[c.place] else self._as_told(identity, told)
            told[c.place] = identity
        self._answers[answer.number] = [c.place for c in answer.contacts]
        while len(self._answers) > self.ANSWERS_KEPT:
            del self._answers[next(iter(self._answers))]

    def _as_told(self, identity, told):
        for place in range(PLACES):
            has = told.get(place, self._held[place][0] if self._known[place] else None)
            if identity.is_like(has):
                return Alike(identity.id, place)
        return identity
