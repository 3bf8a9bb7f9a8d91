#!/usr/bin/env python3
"""The second implementation's two ends against each other, so that a fault of the programs is told from one of its own."""

import os
import random
import sys

from support import expect, expect_raises, main

from second import bulk, haptic
from second import datagrams as d
from second import numbers as n
from second.bulk_ends import BulkAtMaster, BulkAtSlave
from second.master import Denied, Master, Refusal
from second.plane import Plane
from second.slave import Slave
from second.sodium import SUITES, Refused, public_key

_GRID = n.Grid((0.0, 0.0, 0.0), -24)
_PLANE = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -0.02))


class _Pair:
    """Both ends in one thread: whenever the master steps or waits, the slave steps, too."""

    def __init__(self, suite=SUITES[0], psk=None, masters_psk=None, loss=0.0):
        self.slave_secret, self.master_secret = os.urandom(32), os.urandom(32)
        self.plane = Plane(*_PLANE)
        self.slave = Slave(self.slave_secret, {public_key(self.master_secret): psk}, _GRID, self.plane.respond)
        self.master = self.new_master(suite, masters_psk or psk, loss)

    def new_master(self, suite=SUITES[0], psk=None, loss=0.0, secret=None, slave_public=None):
        master = Master(self.slave.port, secret or self.master_secret, slave_public or self.slave.public, suite,
                        psk or bytes(32))
        master.grid = _GRID
        master.steps.append(lambda _: self.slave.step(0))
        plain, send, source = master.receive_raw, master.send_raw, random.Random(1)

        def receive_raw(lane, seconds):
            self.slave.step(0)
            return plain(lane, seconds)

        master.receive_raw = receive_raw
        master.send_raw = lambda lane, datagram: None if source.random() < loss else send(lane, datagram)
        return master

    def close(self):
        self.master.close()
        self.slave.close()


def sessions(_):
    for suite in SUITES:
        for psk in (None, bytes(range(32))):
            pair = _Pair(suite, psk)
            master, slave = pair.master, pair.slave
            master.begin()
            for i in range(200):
                master.pose((0.0, 0.0, 0.021 - 2e-5 * i))
                master.step()
            master.run(1, lambda: master.answers[-1].pose_number == 200)
            told = [c for a in master.answers for c in a.contacts]
            expect(len(told) > 50 and pair.plane.touches > 30 and len(slave.poses) == 200, len(told))
            expect(abs(told[-1].depth_m - (199 - 50) * 2e-5) < 1e-6, told[-1].depth_m)
            words = [slave.challenge(lane) for lane in range(2)]
            master.run(1, lambda: all(slave.challenge_answers))
            expect([w[0] for w in slave.challenge_answers] == words)
            master.say_bye()
            expect(master.run(1, lambda: slave.byes), "no bye")
            expect(not master.refused and not slave.refused, master.refused, slave.refused)
            pair.close()


def objects_through_loss(_):
    for loss in (0.0, 0.2):
        pair = _Pair(loss=loss)
        data = os.urandom(200_003)
        at_master, at_slave = BulkAtMaster(pair.master), BulkAtSlave(pair.slave, data)
        plain, source = pair.slave.send, random.Random(2)
        pair.slave.send = lambda *message: None if source.random() < loss else plain(*message)
        pair.master.begin()
        expect(pair.master.until(at_slave.is_given), "the object was not given")
        expect(at_master.session_object() == data)
        expect(at_slave.numbered.believes and at_master.receipts > 5)
        expect((at_slave.lost > 10) == (loss > 0), at_slave.lost)
        expect(not pair.master.refused and not pair.slave.refused, pair.master.refused, pair.slave.refused)
        pair.close()


def receipts_that_lie(_):
    sender = bulk.Numbered(lambda: 5, random.Random(1))
    heads = [bulk.Arrivals(lambda: 5) for _ in range(1)]
    for _ in range(100):
        heads[0].take(sender.head("piece") + b"x")
    honest = heads[0].receipt()
    wrong = bulk.Receipt(honest.newest, honest.echo ^ 1, 0, 0, [(0, 1)], [])
    expect_raises(Refused, sender.believe, wrong)
    expect(len(sender.believe(honest)) == 100 and sender.believes)
    everything = bulk.Receipt(honest.newest, honest.echo, 0, 0, [(0, 50)], [])
    expect_raises(Refused, sender.believe, everything)
    expect(sender.believe(honest) == [] and not sender.believes, "a liar is believed again")


def denials(_):
    pair = _Pair()
    pair.slave.suites = [SUITES[-1]]
    if len(SUITES) > 1:
        expect(expect_raises(Denied, pair.master.begin).args == (d.OTHER_SUITE,))
    pair.slave.suites = SUITES
    stranger = pair.new_master(secret=os.urandom(32))
    expect(expect_raises(Denied, stranger.begin).args == (d.UNKNOWN_OPERATOR,))
    lost = pair.new_master(slave_public=public_key(os.urandom(32)))
    expect(expect_raises(Denied, lost.begin).args == (d.OTHER_KEY,))
    pair.master.session = 99
    expect(expect_raises(Refusal, pair.master.greet, d.HAPTIC).args == (d.NO_SUCH_SESSION,))
    expect_raises(TimeoutError, _Pair(psk=bytes(32), masters_psk=bytes([1]) * 32).master.greet, d.BULK, 0.3)
    pair.close()


def cookies(_):
    pair = _Pair()
    pair.slave.under_load = True
    pair.master.begin()
    expect(pair.slave.cookies_sent >= 2 and pair.slave.cookies_come_back >= 2)
    pair.close()


def replays(_):
    pair = _Pair()
    master, slave = pair.master, pair.slave
    master.begin()
    first = master.lanes[d.BULK].initiation()
    for _ in range(2):
        master.send_raw(d.BULK, first)
    pair.slave.run(0.05)
    responses = [master.receive_raw(d.BULK, 0.2) for _ in range(4)]
    responses = [r for r in responses if r and r[0] == d.RESPONSE]
    expect(len(responses) == 2 and responses[0] == responses[1], "not the very same response")
    master.greet(d.BULK)
    master.send_raw(d.BULK, first)
    pair.slave.run(0.05)
    expect(slave.denied == [d.OLD_COUNTER], slave.denied)
    message = haptic.Pose(1, 0, (0, 0, 0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0,) * 6).write(_GRID)
    datagram = master.lanes[d.HAPTIC].seal(haptic.POSE, message)
    for _ in range(3):
        master.send_raw(d.HAPTIC, datagram)
    pair.slave.run(0.05)
    expect(len(slave.poses) == 1, "a datagram counted more than once")
    pair.close()


if __name__ == "__main__":
    sys.exit(main([sessions, objects_through_loss, receipts_that_lie, denials, cookies, replays]))
