#!/usr/bin/env python3
"""A master made from the page alone against the real farfeel-slave."""

import os
import random
import sys
import time

from support import expect, expect_raises, main

from second import control
from second import datagrams as d
from second.bulk_ends import BulkAtMaster
from second.lane import Counter
from second.master import Denied, Master, Refusal
from second.programs import key_bytes
from second.sodium import SUITES, public_key

_SCENE = "block-block"
_GARBAGE = 4000
_FREE_AGAIN_S = 0.01  # under load a slave greets once in so long without a cookie, at most


def new_master(*arguments, **more):
    """A master that takes objects, too."""
    master = Master(*arguments, **more)
    master.bulk = BulkAtMaster(master)
    return master


def _drained(master, lane, seconds=0.3):
    """All datagrams that come on a lane until it is silent for so long."""
    out = []
    while datagram := master.receive_raw(lane, seconds):
        out.append(datagram)
    return out


def _answered(master, datagram, lane=d.BULK):
    master.send_raw(lane, datagram)
    return master.receive_raw(lane, 30)


def _reason(datagram):
    expect(datagram and datagram[0] == d.DENIAL, "not a denial:", datagram)
    return d.read_denial(datagram)


def denied_as_the_page_says(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    public = public_key(slave)
    stranger = new_master(port, os.urandom(32), public)
    expect(expect_raises(Denied, stranger.begin).args == (d.UNKNOWN_OPERATOR,))
    lost = new_master(port, secret, public_key(os.urandom(32)))
    expect(expect_raises(Denied, lost.begin).args == (d.OTHER_KEY,))
    master = new_master(port, secret, public)
    lane = master.lanes[d.BULK]
    version, reason, _ = _reason(_answered(master, lane.initiation(version=2)))
    expect((version, reason) == (d.VERSION, d.OTHER_VERSION), version, reason)
    other_suite = bytearray(lane.initiation())
    other_suite[2] = 3
    expect(_reason(_answered(master, d.with_macs(bytes(other_suite[:192]), public)))[1] == d.OTHER_SUITE)
    expect_raises(Refusal, _greet_haptic, master)
    expect(master.lanes[d.HAPTIC].response.verdict == d.NO_SUCH_SESSION)
    master.begin()
    expect(master.lanes[d.HAPTIC].response.session == master.session != 0)
    second = new_master(port, secret, public)
    expect(expect_raises(Refusal, second.begin).args == (d.BUSY,))
    master.say_bye()
    time.sleep(0.1)
    second.begin()
    second.say_bye()
    with open(os.path.join(run.programs.path("slave"), "operators"), "w") as operators:
        operators.write(f"anna {_word(run)} expires=2001-01-01\n")
    third = new_master(port, secret, public)
    expect(wait_for_denial(third) == d.EXPIRED_OPERATOR, third.lanes[d.BULK].denial)


def wait_for_denial(master):
    """The slave looks at its list four times a second."""
    for _ in range(40):
        try:
            master.begin()
            master.say_bye()
        except Denied as denied:
            return denied.args[0]
        except Refusal:
            pass
        time.sleep(0.05)
    return None


def _word(run):
    return run.programs.key("master", "show", "--key-only").strip()


def _greet_haptic(master):
    master.session = 12345
    try:
        master.greet(d.HAPTIC)
    finally:
        master.session = 0


def every_suite_and_psk(run):
    psk = run.programs.key("", "psk").split()[-1]
    slave, secret = run.two_keys(psk)
    _, port = run.slave(_SCENE)
    for suite in SUITES:
        without = new_master(port, secret, public_key(slave), suite)
        expect_raises(TimeoutError, without.greet, d.BULK, 0.5)
        master = new_master(port, secret, public_key(slave), suite, key_bytes(psk))
        master.begin()
        expect(master.until(lambda: master.status is not None), "no status of the slave")
        master.say_bye()
        expect(not master.refused, master.refused)


def garbage_is_ignored(run):
    slave, secret = run.two_keys()
    process, port = run.slave(_SCENE)
    public = public_key(slave)
    master, source = new_master(port, secret, public), random.Random(1)
    master.begin()
    stranger = new_master(port, secret, public)
    good = stranger.lanes[d.BULK].initiation()
    bytes_out = 0
    for i in range(_GARBAGE):
        size = source.choice((0, 1, 7, 8, 16, 33, 64, 131, 132, 223, 224, 225, 1232, 1400, source.randrange(1400)))
        datagram = bytearray(os.urandom(size))
        if size and i % 2:
            datagram[0] = source.randrange(8)
        if i % 5 == 0:  # an initiation with a bit that is wrong, under right macs
            datagram = bytearray(good)
            datagram[source.randrange(4, 192)] ^= 1 << source.randrange(8)
            datagram = bytearray(d.with_macs(bytes(datagram[:192]), public))
        if i % 7 == 0:  # data for the live lanes
            index = master.lanes[i % 2].keys.other_index
            datagram[:8] = bytes([d.DATA, 0, 0, 0]) + index.to_bytes(4, "little")
        bytes_out += len(datagram)
        stranger.send_raw(i % 2, bytes(datagram))
        if i % 20 == 0:
            master.step(0.002)
    expect(process.poll() is None, "the slave ended")
    bytes_back = 0
    for lane in range(2):
        for datagram in _drained(stranger, lane, 0.05):
            bytes_back += len(datagram)
            expect(datagram[0] in (d.DENIAL, d.COOKIE_REPLY), "an answer to garbage: type", datagram[0])
    expect(bytes_back < bytes_out / 10, bytes_back, bytes_out)
    came = master.came[d.BULK]
    expect(master.until(lambda: master.came[d.BULK] > came + 20), "the session has ended")
    expect(not master.refused, master.refused[:3])
    master.say_bye()


def replays_are_refused(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    public, counter = public_key(slave), Counter()
    master = new_master(port, secret, public, counter=counter)
    lane = master.lanes[d.BULK]
    first = lane.initiation()
    responses = [_answered(master, first) for _ in range(3)]
    expect(responses[0] and responses[0][0] == d.RESPONSE and responses.count(responses[0]) == 3,
           "the very same initiation did not get the very same response")
    lane.read(responses[0])
    master.session = lane.response.session
    second = lane.initiation()
    expect(_answered(master, second)[0] == d.RESPONSE)
    version, reason, index = _reason(_answered(master, first))
    expect(reason == d.OLD_COUNTER and index.to_bytes(4, "little") == first[4:8], reason)
    elsewhere = new_master(port, secret, public)
    expect(_reason(_answered(elsewhere, first))[1] == d.OLD_COUNTER)
    expect(_reason(_answered(master, lane.initiation(counter=counter() - 10**12)))[1] == d.OLD_COUNTER)
    master.begin()
    sealed = master.lanes[d.BULK].seal(control.BYE, control.write_bye())
    master.send_raw(d.BULK, sealed)
    again = new_master(port, secret, public)
    time.sleep(0.1)
    again.begin()
    for _ in range(3):
        master.send_raw(d.BULK, sealed)
    came = again.came[d.BULK]
    expect(again.until(lambda: again.came[d.BULK] > came + 20), "a replayed bye ended another session")
    again.say_bye()


def cookies_under_load(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    public = public_key(slave)
    flood = new_master(port, os.urandom(32), public)
    got, end = None, time.monotonic() + 30
    while got is None and time.monotonic() < end:
        for _ in range(50):
            flood.send_raw(d.BULK, d.with_macs(flood.lanes[d.BULK].initiation()[:192], public))
        got = next((x for x in _drained(flood, d.BULK, 0) if x[0] == d.COOKIE_REPLY), None)
    expect(got, "no cookie reply under load")
    spoofed = flood.lanes[d.BULK].initiation()
    began, free = time.monotonic(), 0
    while True:
        master = new_master(port, secret, public)
        for _ in range(1000):
            flood.send_raw(d.BULK, spoofed)
        said = time.monotonic()
        master.session = master.greet(d.BULK).session
        if master.lanes[d.BULK].cookie:
            break
        # Each greeting that comes when a free one is due again is free: so many are due by now.
        free += 1
        due = 1 + (time.monotonic() - began) / _FREE_AGAIN_S
        expect(free <= due, free, "greetings under load without a cookie, where", due, "were due")
        expect(said < end, "no greeting under load needed a cookie")
        master.say_bye()
    master.greet(d.HAPTIC)
    for _ in range(2000):
        flood.send_raw(d.BULK, spoofed)
    expect(master.until(lambda: master.came[d.BULK] > 10) and not master.refused, master.refused[:3])
    master.say_bye()


def a_master_that_moves(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    expect(master.until(lambda: master.came[d.BULK] > 20))
    for _ in range(3):
        challenges, came = master.challenges, master.came[d.BULK]
        master.move(d.BULK)
        expect(master.until(lambda: master.challenges > challenges and master.came[d.BULK] > came + 20),
               "after the move nothing comes", master.challenges, challenges, master.came)
    expect(not master.refused, master.refused[:3])
    master.say_bye()


def unproven_place_gets_no_more_than_came(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    master.run(0.3)
    _drained(master, d.BULK, 0.02)
    master.move(d.BULK)
    datagram = master.lanes[d.BULK].seal(control.KEEP_ALIVE, b"")
    master.send_raw(d.BULK, datagram)
    back = sum(len(x) for x in _drained(master, d.BULK, 0.4))
    expect(back <= len(datagram), back, len(datagram))


def keys_renewed(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    for _ in range(20):
        session = master.session
        master.greet(d.BULK)
        master.greet(d.HAPTIC)
        expect(master.lanes[d.BULK].response.session == session)
        came = master.came[d.BULK]
        expect(master.until(lambda: master.came[d.BULK] > came + 2))
    expect(not master.refused, master.refused[:3])
    master.say_bye()


def a_silent_master_goes_on(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    master.run(0.3)
    for _ in range(2):
        time.sleep(3)
        came = master.came[d.BULK]
        expect(master.until(lambda: master.came[d.BULK] > came + 20), "a session ended for silence")
    expect(not master.refused, master.refused[:3])
    master.say_bye()


def a_silent_master_gives_way(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    first, second = (new_master(port, secret, public_key(slave)) for _ in range(2))
    first.begin()
    first.run(0.2)
    expect(expect_raises(Refusal, second.begin).args == (d.BUSY,))
    time.sleep(2.5)
    second.begin()
    expect(second.session != first.session)
    second.say_bye()


def whoever_is_revoked_is_shown_out(run):
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    expect(master.until(lambda: master.came[d.BULK] > 20))
    run.programs.key("slave", "revoke", "anna")
    expect(master.until(lambda: master.bye), "no bye")
    expect(master.bye == control.NOT_TRUSTED, master.bye)
    expect(expect_raises(Denied, master.begin).args == (d.UNKNOWN_OPERATOR,))


def old_keys_serve_until_new_ones_do(run):
    """The slave seals with new keys only once it has read something that is sealed with them."""
    slave, secret = run.two_keys()
    _, port = run.slave(_SCENE)
    master = new_master(port, secret, public_key(slave))
    master.begin()
    expect(master.until(lambda: master.came[d.BULK] > 20))
    lane, seen = master.lanes[d.BULK], []
    old = lane.keys
    opens = lane.open
    lane.open = lambda datagram: seen.append(datagram[4:8]) or opens(datagram)
    send, master.send = master.send, lambda *message: None  # nothing is sealed with the new ones yet
    master.greet(d.BULK)
    master.run(0.2)
    expect(len(seen) > 3 and set(seen) == {old.own_index.to_bytes(4, "little")}, "new keys before they were confirmed")
    master.send, seen[:] = send, []
    expect(master.until(lambda: lane.keys.own_index.to_bytes(4, "little") in seen), "new keys are not used")
    expect(not master.refused, master.refused[:3])
    master.say_bye()


if __name__ == "__main__":
    sys.exit(main([denied_as_the_page_says, every_suite_and_psk, garbage_is_ignored, replays_are_refused,
                   cookies_under_load, a_master_that_moves, unproven_place_gets_no_more_than_came, keys_renewed,
                   a_silent_master_goes_on, a_silent_master_gives_way, whoever_is_revoked_is_shown_out,
                   old_keys_serve_until_new_ones_do]))
