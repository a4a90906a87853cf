"""A plant in Python: takes the simulated plant's place in an anhyst run, alone or together with the amplifier.

    y'' + 2ζω y' + ω² y = ω² g H,   ω = 2π · resonance

y displacement of the tip (m), H field in the coil (A/m), a straight line within a tick, g gain (m per A/m), ζ damping. For
such a field the motion has a closed form: y = g (H − 2ζ/ω H') + a decaying oscillation. A real rod has hysteresis and its
gain is no constant; this one shows what a plant owes the loop, not how Terfenol-D behaves. The amplifier is ideal: what is
commanded in tick k is in the coil at t_k+2. Put your own rig where `Rod.advance` is.

    anhyst run SCENARIO --external-command plant='python3 examples/plant-python/plant.py'
    anhyst run SCENARIO --set 'placement=Groups([[plant, amplifier]])' \
      --external-command plant-sim+amplifier='python3 examples/plant-python/plant.py'
"""

import argparse
import math
import os
import signal
import sys
from pathlib import Path

# The rules of docs/interface.md, shared with the amplifier; copy both files into a folder of your own.
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "amplifier-python"))

import anhyst_interface as interface
from meeting import Absent, Lost, Meeting, Taken

# No coil has more; a field that is no number is left out, too.
MAX_A_PER_M = 1e7


class Rod:
    """Two poles, at rest."""

    def __init__(self, tick_s, gain, resonance_hz, damping):
        self.tick_s, self.gain, self.omega, self.damping = tick_s, gain, 2.0 * math.pi * resonance_hz, damping
        self.displacement, self.velocity, self.field = 0.0, 0.0, 0.0

    def advance(self, field):
        """Goes on by a tick, at whose end the coil has this field."""
        if not abs(field) <= MAX_A_PER_M:
            field = self.field
        gain, omega, damping, time_s = self.gain, self.omega, self.damping, self.tick_s
        rate = (field - self.field) / time_s
        lag = 2.0 * damping / omega * rate
        # What the oscillation begins with: the distance from the motion that the field forces.
        y, v = self.displacement - gain * (self.field - lag), self.velocity - gain * rate
        slowed = omega * math.sqrt(1.0 - damping**2)
        decay = math.exp(-damping * omega * time_s)
        cosine, sine = math.cos(slowed * time_s), math.sin(slowed * time_s) / slowed
        self.displacement = gain * (field - lag) + decay * (y * cosine + (v + damping * omega * y) * sine)
        self.velocity = gain * rate + decay * (v * cosine - (omega**2 * y + damping * omega * v) * sine)
        self.field = field


class Coil:
    """The field at t_k, from whoever says it: the amplifier of the run, or an ideal one of our own."""

    def __init__(self, meeting, limit_s, tick_s):
        self.meeting, self.limit_s, self.tick_s = meeting, limit_s, tick_s
        self.own = interface.SafeField in meeting.reads
        self.source = interface.SafeField if self.own else interface.CoilField
        self.command, self.heard_tick = 0.0, -1

    def field_at(self, tick):
        """Takes the token of the tick before: in lockstep it is waited for, in real time the newest is taken."""
        if self.meeting.realtime:
            token = self.meeting.newest(self.source)
        else:
            token = self.meeting.receive(self.source, self.limit_s)
        if token is not None:
            self.heard_tick = token.tick
        if (tick - self.heard_tick) * self.tick_s > self.limit_s:
            raise TimeoutError(f"no {self.source.SERVICE} for {self.limit_s} s")
        field = token.field_a_per_m if token is not None else 0.0
        if not self.own:
            return field
        # The command of tick k−1 is in the coil a tick after its answer is due: this is that answer.
        field, self.command = self.command, field
        self.meeting.send(interface.CoilField(tick=tick - 1, field_a_per_m=field))
        return field


def run(meeting, rod, ticks, limit_s):
    """Measures at t_0, t_1, …; in real time by its own timer: what it has missed it makes up for tick by tick."""
    coil = Coil(meeting, limit_s, rod.tick_s)
    for tick in range(ticks):
        if meeting.realtime:
            meeting.wait_for_tick(tick, rod.tick_s)
        if tick > 0:
            rod.advance(coil.field_at(tick))
        seen = {"tick": tick, "displacement_m": rod.displacement, "coil_field_a_per_m": rod.field}
        meeting.send(interface.Measurement(**seen))
        # What a rig does not know stays 0.
        meeting.send(interface.Truth(**seen))
    coil.field_at(ticks)


def main():
    parser = argparse.ArgumentParser(description="A linear plant for an anhyst run.")
    parser.add_argument("--gain-m-per-a-per-m", type=float, default=5e-9)
    parser.add_argument("--resonance-hz", type=float, default=1500.0)
    parser.add_argument("--damping", type=float, default=0.3)
    given = parser.parse_args()
    environment = os.environ
    tick_s, ticks = float(environment["ANHYST_TICK_S"]), int(environment["ANHYST_TICKS"])
    limit_s = float(environment.get("ANHYST_RECEIVE_LIMIT_S", "2"))
    sends = [interface.Measurement, interface.Truth]
    if "amplifier" in environment["ANHYST_PROCESS"].split("+"):
        meeting = Meeting(reads=[interface.SafeField], sends=[*sends, interface.CoilField])
    else:
        meeting = Meeting(reads=[interface.CoilField], sends=sends)
    run(meeting, Rod(tick_s, given.gain_m_per_a_per_m, given.resonance_hz, given.damping), ticks, limit_s)
    meeting.close()


if __name__ == "__main__":
    # Told to end, the process unwinds instead of dying on the spot.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("plant: told to end"))
    try:
        main()
    except Taken as error:
        print(f"plant: {error}", file=sys.stderr)
        sys.exit(Taken.EXIT_STATUS)
    except (Absent, Lost, TimeoutError) as error:
        sys.exit(f"plant: {error}")
