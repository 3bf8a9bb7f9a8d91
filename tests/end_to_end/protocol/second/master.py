"""A master (PROTOCOL.md, "A session"): two lanes, keep-alives, the session object, poses up, answers down."""

import os
import select
import socket
import time

from . import control, haptic, numbers
from . import datagrams as d
from .lane import Counter, MasterLane
from .noise import NO_PSK
from .sodium import SUITES, Refused, public_key

_SAID_AGAIN_S = 0.020
_PATIENCE_S = 30.0  # with whatever is waited for: a busy machine may stand still now and then


def now_us():
    return time.monotonic_ns() // 1000


class Denied(Exception):
    """The slave's denial; the argument is its reason."""


class Refusal(Exception):
    """The slave's response with a verdict that is not welcome; the argument is the verdict."""


class Master:
    def __init__(self, port, secret, slave_public, suite=SUITES[0], psk=NO_PSK, host="127.0.0.1", counter=None):
        self.address, self.slave_public, self.secret = (host, port), slave_public, secret
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.sockets = [socket.socket(family, socket.SOCK_DGRAM) for _ in range(2)]
        for s in self.sockets:
            s.connect(self.address)
            s.setblocking(False)
        self.number = int.from_bytes(os.urandom(8), "little")
        counter = counter or Counter()
        self.lanes = [MasterLane(lane, suite, secret, slave_public, counter, self.number, psk) for lane in range(2)]
        self.session = 0
        self.refused = []  # what came and was not as the page says
        self.came, self.sent = [0, 0], [0, 0]  # datagrams a lane
        self.status, self.bye, self.challenges = None, None, 0
        self.on_bulk = {}  # type -> function of the message
        self.answers, self.round_trips_us = [], []
        self.grid, self.read, self.clock = None, haptic.AnswersRead(), numbers.Clock(now_us)
        self.pose_number, self._began = 0, now_us()
        self._next_keep_alive = 0.0
        self.steps = []  # what else to do in each step: functions of the time [s]

    def close(self):
        for s in self.sockets:
            s.close()

    def move(self, lane):
        """The lane's datagrams come from another port from now on."""
        old, self.sockets[lane] = self.sockets[lane], socket.socket(self.sockets[lane].family, socket.SOCK_DGRAM)
        self.sockets[lane].connect(self.address)
        self.sockets[lane].setblocking(False)
        old.close()

    def send_raw(self, lane, datagram):
        self.sent[lane] += 1
        try:
            self.sockets[lane].send(datagram)
        except ConnectionRefusedError:
            pass

    def send(self, lane, kind, message=b""):
        self.send_raw(lane, self.lanes[lane].seal(kind, message))

    def receive_raw(self, lane, seconds):
        """The next datagram of a lane, whatever it is, or None."""
        if not select.select([self.sockets[lane]], [], [], seconds)[0]:
            return None
        try:
            return self.sockets[lane].recv(2048)
        except OSError:
            return None

    # Handshakes

    def greet(self, lane, seconds=_PATIENCE_S):
        """A handshake of a lane, begun anew. The very same initiation is said again until it is answered."""
        mine = self.lanes[lane]
        session, end, next_say = self.session if lane == d.HAPTIC else 0, time.monotonic() + seconds, 0.0
        initiation = mine.initiation(session)
        while time.monotonic() < end:
            if time.monotonic() >= next_say:
                self.send_raw(lane, initiation)
                next_say = time.monotonic() + _SAID_AGAIN_S
            datagram = self.receive_raw(lane, _SAID_AGAIN_S)
            if not datagram:
                continue
            if datagram[0] == d.DATA:
                self._data(lane, datagram)
                continue
            try:
                kind = mine.read(datagram)
            except Refused as error:
                self.refused.append(f"while greeting: {error}")
                continue
            if kind == d.DENIAL:
                raise Denied(mine.denial)
            if kind == d.COOKIE_REPLY:
                initiation, next_say = mine.initiation(session), 0.0
                continue
            if mine.response.verdict != d.WELCOME:
                raise Refusal(mine.response.verdict)
            self.send(lane, control.KEEP_ALIVE) if lane == d.BULK else None
            return mine.response
        raise TimeoutError(f"no response on lane {lane}")

    def begin(self):
        """Both lanes, the bulk lane first."""
        self.session = self.greet(d.BULK).session
        self.greet(d.HAPTIC)

    # Data

    def step(self, seconds=0.001):
        """Waits so long at most for datagrams, reads what came, says what is due."""
        for s in select.select(self.sockets, [], [], seconds)[0]:
            self._drain(self.sockets.index(s))
        now = time.monotonic()
        for other in self.steps:
            other(now)
        if self.lanes[d.BULK].keys and now >= self._next_keep_alive:
            self._next_keep_alive = now + control.KEEP_ALIVE_S / 2
            self.send(d.BULK, control.KEEP_ALIVE)

    def run(self, seconds, wish=lambda: False):
        """Steps until the wish comes true, or so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not wish():
            self.step()
        return wish()

    def until(self, wish):
        """Steps until the wish comes true, or until nobody would wait any longer."""
        return self.run(_PATIENCE_S, wish)

    def told_anew(self):
        """Steps until two more statuses have come: all that was sent before is in the second."""
        for _ in range(2):
            before = self.status
            if not self.until(lambda b=before: self.status is not b):
                raise TimeoutError("no status of the slave")

    def _drain(self, lane):
        while True:
            try:
                datagram = self.sockets[lane].recv(2048)
            except OSError:
                return
            if datagram and datagram[0] == d.DATA:
                self._data(lane, datagram)

    def _data(self, lane, datagram):
        try:
            _, kind, message = self.lanes[lane].open(datagram)
            self.came[lane] += 1
            self._take(lane, kind, message)
        except Refused as error:
            self.refused.append(str(error))

    def _take(self, lane, kind, message):
        if kind == control.CHALLENGE:
            if len(message) != control.CHALLENGE_BYTES:
                raise Refused("length of a challenge")
            self.challenges += 1
            self.send(lane, control.CHALLENGE_ANSWER, message)
        elif lane == d.HAPTIC and kind == haptic.ANSWER:
            answer = self.read.take(haptic.Answer.read(message, self.grid))
            self.clock.note(answer.times[0])
            round_trip = self.clock.round_trip_us(*answer.times[1:])
            if round_trip is not None:
                self.round_trips_us.append(round_trip)
            self.answers.append(answer)
        elif lane == d.BULK and kind == control.KEEP_ALIVE:
            if message:
                raise Refused("length of a keep-alive")
        elif lane == d.BULK and kind == control.BYE:
            self.bye = control.read_bye(message)
        elif lane == d.BULK and kind == control.STATUS:
            self.status = control.Status.read(message)
        elif lane == d.BULK and kind in self.on_bulk:
            self.on_bulk[kind](message)
        else:
            raise Refused(f"type {kind} on lane {lane}")

    def pose(self, p_WT, R_WT=(1.0, 0.0, 0.0, 0.0), twist=(0.0,) * 6, **more):
        """Sends a pose; the pose as it was told."""
        self.pose_number += 1
        self.read.sent_pose(self.pose_number)
        message = haptic.Pose(self.pose_number, now_us() - self._began, self._times(), p_WT, R_WT, twist,
                              self.read.heard(self.pose_number), **more).write(self.grid)
        self.send(d.HAPTIC, haptic.POSE, message)
        return haptic.Pose.read(message, self.grid)

    def _times(self):
        return numbers.Reader(self.clock.write()).unpack("IIH")

    def say_bye(self):
        for _ in range(control.BYES):
            self.send(d.BULK, control.BYE, control.write_bye())

    @property
    def public(self):
        return public_key(self.secret)
