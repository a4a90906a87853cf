"""A current amplifier in Python: takes the simulated amplifier's place in an anhyst run.

    τ dH/dt = s − H,  |ds/dt| ≤ slew limit,  s → clip(u, ± field limit),  τ = 1/(2π bandwidth)

H coil field, s slew-limited target, u command one tick (plus `--delay-ticks`) ago, all A/m. The lag is propagated exactly
for a target that is a straight line within a tick: H' = E H + (g − E) s + (1 − g) s',  E = e^(−T/τ),  g = (τ/T)(1 − E).
The same arithmetic, in the same order, as model/src/amplifier.rs: with equal settings the run's digest is the same.
Put your own process where `Amplifier.step` is.

    anhyst run SCENARIO --external-command amplifier='python3 examples/amplifier-python/amplifier.py'
"""

import argparse
import math
import os
import signal
import sys
import time
from collections import deque

import anhyst_interface as interface
from meeting import Absent, Lost, Meeting, Taken

AMPLITUDE_LIMITED = 1 << 0
SLEW_LIMITED = 1 << 1
RAMPING = 1 << 2
SAFE = 1 << 3
RETURNING = 1 << 4
# The way to the safe field when nobody commands, and in real time the way back.
RAMP_S = 0.02
# In real time nobody has commanded for so long: unless AMPLIFIER_WATCHDOG_S tells otherwise, 20 ticks.
SILENT_TICKS = 20
# No pause is made up for tick by tick for longer.
MAX_TICKS = 100_000
# Bits 16 to 31 are a driver's own.
NOT_A_NUMBER = 1 << 16


class Amplifier:
    """At rest at zero field."""

    def __init__(self, tick_s, bandwidth_hz=None, field_limit=None, slew_limit=None, delay_ticks=0):
        self.tick_s, self.field_limit, self.slew_limit = tick_s, field_limit, slew_limit
        self.decay, self.weight_to = 0.0, 1.0
        if bandwidth_hz is not None:
            lag_s = 1.0 / (2.0 * math.pi * bandwidth_hz)
            fallen = -math.expm1(-tick_s / lag_s)
            self.decay, self.weight_to = 1.0 - fallen, 1.0 - fallen * lag_s / tick_s
        self.commands = deque([0.0] * (delay_ticks + 1))
        self.target = 0.0
        self.field = 0.0

    def step(self, command):
        """Takes the command of tick k; the coil's field at t_k+1 and a status."""
        status = 0
        if not math.isfinite(command):
            command, status = self.commands[-1], NOT_A_NUMBER
        due = self.commands.popleft()
        self.commands.append(command)
        clipped = due
        if self.field_limit is not None:
            clipped = min(max(due, -self.field_limit), self.field_limit)
        source, target = self.target, clipped
        if self.slew_limit is not None:
            step = self.slew_limit * self.tick_s
            target = min(max(clipped, source - step), source + step)
        weight_from = 1.0 - self.decay - self.weight_to
        self.field = self.decay * self.field + weight_from * source + self.weight_to * target
        self.target = target
        status |= AMPLITUDE_LIMITED if clipped != due else 0
        status |= SLEW_LIMITED if target != clipped else 0
        return self.field, status


def ramp_to_safety(amplifier, meeting, tick):
    """The amplifier's own watchdog: nobody commands any more, so the field goes to zero, and whoever still listens hears it."""
    begin, ticks = amplifier.commands[-1], max(1, math.ceil(RAMP_S / amplifier.tick_s))
    # What is still on its way through the lag has settled to 1e-9 after 21 of its time constants.
    settling = 0 if amplifier.decay == 0.0 else math.ceil(-21.0 / math.log(amplifier.decay))
    last = ticks + len(amplifier.commands) + settling
    for k in range(1, last + 1):
        field, status = amplifier.step(begin * max(0.0, 1.0 - k / ticks))
        status |= SAFE if k == last else RAMPING
        try:
            meeting.send(interface.CoilField(tick=tick + k, field_a_per_m=field, status=status))
        except Lost:
            pass  # Readers that are gone need no field.


def follow(amplifier, meeting, limit_s):
    """Real time: the newest command counts, for all ticks that have passed since the last. While nobody commands, the
    amplifier's own clock goes on: the command fades to zero, and back when somebody commands again. Silence of `limit_s` ends it.
    """
    tick_s = amplifier.tick_s
    silent_s = float(os.environ.get("AMPLIFIER_WATCHDOG_S", SILENT_TICKS * tick_s))
    tick, command, share, alone_ticks, heard_s = -1, 0.0, 1.0, 0, time.monotonic()
    while True:
        patience_s = silent_s + alone_ticks * tick_s if tick >= 0 else limit_s
        try:
            safe = meeting.receive(interface.SafeField, max(0.0, heard_s + patience_s - time.monotonic()))
            if safe is None:
                return
            passed, tick, command = max(1, safe.tick - tick), safe.tick, safe.field_a_per_m
            share, fading = min(1.0, share + tick_s / RAMP_S), 0.0
            alone_ticks, heard_s = 0, time.monotonic()
        except TimeoutError:
            silence_s = time.monotonic() - heard_s
            if silence_s >= limit_s:
                raise
            passed, fading = max(1, int((silence_s - silent_s) / tick_s) - alone_ticks), tick_s / RAMP_S
            tick, alone_ticks = tick + passed, alone_ticks + passed
        for _ in range(min(passed, MAX_TICKS)):
            share = max(0.0, share - fading)
            field, status = amplifier.step(share * command)
        if share < 1.0:
            status |= RETURNING if fading == 0.0 else RAMPING if share > 0.0 else SAFE
        meeting.send(interface.CoilField(tick=tick, field_a_per_m=field, status=status))


def arguments():
    parser = argparse.ArgumentParser(description="A current amplifier for an anhyst run.")
    parser.add_argument("--bandwidth-hz", type=float)
    parser.add_argument("--field-limit-a-per-m", type=float)
    parser.add_argument("--slew-limit-a-per-m-s", type=float)
    parser.add_argument("--delay-ticks", type=int, default=0)
    return parser.parse_args()


def main():
    given = arguments()
    tick_s = float(os.environ["ANHYST_TICK_S"])
    limit_s = float(os.environ.get("ANHYST_RECEIVE_LIMIT_S", "2"))
    amplifier = Amplifier(
        tick_s, given.bandwidth_hz, given.field_limit_a_per_m, given.slew_limit_a_per_m_s, given.delay_ticks
    )
    meeting = Meeting(reads=[interface.SafeField], sends=[interface.CoilField])
    tick = -1
    try:
        if meeting.realtime:
            follow(amplifier, meeting, limit_s)
        # In lockstep: one token a tick, until there are no more.
        while not meeting.realtime and (safe := meeting.receive(interface.SafeField, limit_s)) is not None:
            field, status = amplifier.step(safe.field_a_per_m)
            meeting.send(interface.CoilField(tick=safe.tick, field_a_per_m=field, status=status))
            tick = safe.tick
    except (Lost, TimeoutError):
        if not meeting.realtime:
            ramp_to_safety(amplifier, meeting, tick)
        raise
    finally:
        pass  # A real amplifier's output goes to zero here, whatever ended the loop.
    meeting.close()


if __name__ == "__main__":
    # Told to end, the process unwinds instead of dying on the spot.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("amplifier: told to end"))
    try:
        main()
    except Taken as error:
        print(f"amplifier: {error}", file=sys.stderr)
        sys.exit(Taken.EXIT_STATUS)
    except (Absent, Lost, TimeoutError) as error:
        sys.exit(f"amplifier: {error}")
