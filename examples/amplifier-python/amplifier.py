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
from collections import deque

import anhyst_interface as interface
from meeting import Absent, Lost, Meeting

AMPLITUDE_LIMITED = 1 << 0
SLEW_LIMITED = 1 << 1
RAMPING = 1 << 2
SAFE = 1 << 3
# The way to the safe field when nobody commands.
RAMP_S = 0.02
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
        while (safe := meeting.receive(interface.SafeField, limit_s)) is not None:
            field, status = amplifier.step(safe.field_a_per_m)
            meeting.send(interface.CoilField(tick=safe.tick, field_a_per_m=field, status=status))
            tick = safe.tick
    except (Lost, TimeoutError):
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
    except (Absent, Lost, TimeoutError) as error:
        sys.exit(f"amplifier: {error}")
