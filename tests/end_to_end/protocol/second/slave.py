"""A slave (PROTOCOL.md, "The handshake", "Where the master is", "A session"): one port, one master, its poses answered."""

import os
import select
import socket
import time

from . import control, haptic, numbers
from . import datagrams as d
from .lane import SlaveLane, read_initiation, write_response
from .master import now_us
from .noise import NO_PSK
from .sodium import SUITES, Refused, public_key

_EPOCH = int.from_bytes(os.urandom(8), "little")
_ANSWER_PAUSE_S = 0.001
_MOST_AT_ONCE = 64


class Slave:
    """`operators`: public key -> psk. `respond(pose)` makes the answer's contacts and wrench."""

    def __init__(self, secret, operators, grid=None, respond=None, suites=SUITES, host="127.0.0.1"):
        self.secret, self.public, self.operators = secret, public_key(secret), operators
        self.suites, self.grid, self.respond = suites, grid, respond
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((host, 0))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]
        self.under_load, self.denies = False, True
        self._cookie_secret = os.urandom(32)
        self.cookies_sent = self.cookies_come_back = 0
        self._counters, self._last = {}, {}  # (operator, lane) -> newest counter; lane -> last initiation and response
        self.denied = []  # reasons
        self.refused, self.lengths, self.arrivals = [], [[], []], [[], []]
        self.pose_lengths, self.after_answer = [], lambda pose, answer: None
        self._new_session()
        self.session, self.master = 0, None
        self.steps, self.on_bulk, self.challenge_answers = [], {}, [[], []]
        self._next_keep_alive = 0.0

    def _new_session(self):
        self.lanes, self.where = [SlaveLane(), SlaveLane()], [None, None]
        self.clock, self.told = numbers.Clock(now_us), haptic.IdentitiesTold()
        self.poses, self.newest_pose, self.answer_number = [], 0, 0
        self.byes, self.keep_alives = [], 0
        self._asked, self._next_answer = None, 0.0
        self.numbers_seen, self.round_trips_us, self.forces = set(), [], {}

    def close(self):
        self.socket.close()

    # Handshakes

    def _deny(self, datagram, where, reason):
        self.denied.append(reason)
        if self.denies:
            self.socket.sendto(d.write_denial(reason, int.from_bytes(datagram[4:8], "little")), where)

    def _cookie(self, where):
        return d.mac2_of(repr(where).encode(), self._cookie_secret)

    def _initiation(self, datagram, where):
        if len(datagram) < 40 or (datagram[1] == d.VERSION and len(datagram) != d.INITIATION_BYTES):
            raise Refused("length of an initiation")
        is_for_us = d.mac1_of(datagram[:-32], self.public) == datagram[-32:-16]
        if datagram[1] != d.VERSION:
            return self._deny(datagram, where, d.OTHER_VERSION) if is_for_us else None
        if not is_for_us:
            return self._deny(datagram, where, d.OTHER_KEY)
        if datagram[2] not in (suite.number for suite in self.suites):
            return self._deny(datagram, where, d.OTHER_SUITE)
        if self.under_load:
            if d.mac2_of(datagram[:-16], self._cookie(where)) != datagram[-16:]:
                self.cookies_sent += 1
                index = int.from_bytes(datagram[4:8], "little")
                reply = d.write_cookie_reply(index, self._cookie(where), datagram[-32:-16], self.public)
                return self.socket.sendto(reply, where)
            self.cookies_come_back += 1
        lane = datagram[3]
        if lane in self._last and self._last[lane][0] == datagram[:-16]:
            return self.socket.sendto(self._last[lane][1], where)
        suite, noise, initiation = read_initiation(datagram, self.secret)
        if noise.initiator not in self.operators:
            return self._deny(datagram, where, d.UNKNOWN_OPERATOR)
        if initiation.counter <= self._counters.get((noise.initiator, lane), 0):
            return self._deny(datagram, where, d.OLD_COUNTER)
        self._counters[noise.initiator, lane] = initiation.counter
        self._welcome(datagram, where, lane, suite, noise, initiation)

    def _welcome(self, datagram, where, lane, suite, noise, initiation):
        verdict = d.WELCOME
        if lane == d.BULK:
            if initiation.session:
                raise Refused("a session on the bulk lane")
            if initiation.master != self.master:
                self._new_session()
                self.master, self.session = initiation.master, int.from_bytes(os.urandom(4), "little") or 1
        elif not self.session or (initiation.session, initiation.master) != (self.session, self.master):
            verdict = d.NO_SUCH_SESSION
        session = self.session if verdict == d.WELCOME else 0
        response, keys = write_response(suite, lane, noise, initiation, _EPOCH, session, verdict,
                                        self.operators[noise.initiator] or NO_PSK)
        if verdict == d.WELCOME:
            self.lanes[lane].expect(keys)
        self._last[lane] = datagram[:-16], response
        self.socket.sendto(response, where)

    # Data

    def send(self, lane, kind, message=b""):
        if self.where[lane]:
            self.socket.sendto(self.lanes[lane].seal(kind, message), self.where[lane])

    def step(self, seconds=0.001):
        if select.select([self.socket], [], [], seconds)[0]:
            self._drain()
        self._answer()
        now = time.monotonic()
        for other in self.steps:
            other(now)
        if now >= self._next_keep_alive:
            self._next_keep_alive = now + control.KEEP_ALIVE_S / 2
            self.send(d.BULK, control.KEEP_ALIVE)

    def run(self, seconds, wish=lambda: False):
        end = time.monotonic() + seconds
        while time.monotonic() < end and not wish():
            self.step()
        return wish()

    def _drain(self):
        for _ in range(_MOST_AT_ONCE):  # so that on a busy machine answers leave between
            try:
                datagram, where = self.socket.recvfrom(2048)
            except OSError:
                return
            try:
                if datagram and datagram[0] == d.INITIATION:
                    self._initiation(datagram, where)
                elif datagram and datagram[0] == d.DATA:
                    self._data(datagram, where)
            except Refused as error:
                self.refused.append(str(error))

    def _data(self, datagram, where):
        if len(datagram) < 8:
            raise Refused("length of data")
        lane = datagram[4] & 1
        _, kind, message = self.lanes[lane].open(datagram)
        self.where[lane] = where
        self.lengths[lane].append(len(datagram))
        self.arrivals[lane].append(time.monotonic())
        self._take(lane, kind, message)

    def _take(self, lane, kind, message):
        if kind == control.CHALLENGE_ANSWER and len(message) == control.CHALLENGE_BYTES:
            self.challenge_answers[lane].append(message)
        elif lane == d.HAPTIC and kind == haptic.POSE:
            self.pose_lengths.append(len(message))
            self._pose(haptic.Pose.read(message, self.grid))
        elif lane == d.BULK and kind == control.KEEP_ALIVE and not message:
            self.keep_alives += 1
        elif lane == d.BULK and kind == control.BYE:
            self.byes.append(control.read_bye(message))
        elif lane == d.BULK and kind in self.on_bulk:
            self.on_bulk[kind](message)
        else:
            raise Refused(f"type {kind} of {len(message)} bytes on lane {lane}")

    def _pose(self, pose):
        if pose.number in self.numbers_seen:
            raise Refused("a pose's number that came before")
        self.numbers_seen.add(pose.number)
        self.poses.append(pose)
        if pose.number <= self.newest_pose:
            return
        self.newest_pose = pose.number
        self.clock.note(pose.times[0])
        round_trip = self.clock.round_trip_us(*pose.times[1:])
        if round_trip is not None:
            self.round_trips_us.append(round_trip)
        self.told.heard(pose.heard)
        self._asked = pose

    def _answer(self):
        """Answers the newest pose, once, a millisecond after the answer before at the earliest."""
        pose, now = self._asked, time.monotonic()
        if pose is None or now < self._next_answer:
            return
        self._asked, self._next_answer = None, now + _ANSWER_PAUSE_S
        contacts, wrench = self.respond(pose)
        self.answer_number += 1
        answer = haptic.Answer(self.answer_number, pose.number, numbers.Reader(self.clock.write()).unpack("IIH"), wrench,
                               contacts)
        self.told.tell(answer, {c.place: c.identity for c in contacts})
        self.forces[pose.number] = wrench[3:]
        self.send(d.HAPTIC, haptic.ANSWER, answer.write(self.grid))
        self.after_answer(pose, answer)

    def challenge(self, lane):
        """Asks where the master is; the bytes that have to come back."""
        word = os.urandom(control.CHALLENGE_BYTES)
        self.send(lane, control.CHALLENGE, word)
        return word
