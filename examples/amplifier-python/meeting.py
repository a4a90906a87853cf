"""A Python process's place in an anhyst loop: the rules of docs/interface.md on top of PyPI's iceoryx2."""

import ctypes
import os
import time

import iceoryx2 as iox2

import anhyst_interface as interface

STEP_S = 0.002
# A sleeper looks up at least this often, should a bell be missed; in real time a missed one must not cost many ticks.
NAP_MS = 20
NAP_REALTIME_MS = 1
# From saying when tick 0 begins to that tick: the others need to hear of it.
RUN_UP_NS = 20_000_000
# The recorder may be so many ticks behind a plant: half of what its buffer takes.
CREDIT_TICKS = 4096
# How many successors of a process that died are looked for at the end.
MAX_STARTS = 10


class Absent(Exception):
    """A process did not come in time."""


class Taken(Exception):
    """Another process has this one's place."""

    # As of every process that could not take part.
    EXIT_STATUS = 3


class Lost(Exception):
    """A token was lost, or did not reach its readers."""


class Peer:
    """Another process: its status, and its bell."""

    def __init__(self, node, name, status):
        self.name = name
        reader = status.reader_builder().create()
        entry = lambda key: reader.entry(ctypes.c_uint64(key), ctypes.c_uint64)
        self._phase, self._asleep, self._tick = map(entry, (interface.PHASE, interface.ASLEEP, interface.TICK))
        # Both must live as long as their entries.
        self._keep = (status, reader)
        self.bell = listened_bell(event(node, name))

    def phase(self):
        return value(self._phase)

    def asleep(self):
        return value(self._asleep) != 0

    def tick(self):
        return value(self._tick)


def listened_bell(service):
    """A bell that could not connect to its listener when it was made never tries again: make one until it can."""
    for _ in range(1000):
        bell = service.notifier_builder().create()
        if bell.notify() > 0:
            break
        time.sleep(0.002)
    return bell


def value(entry):
    return entry.get().decode_as(ctypes.c_uint64).value


def event(node, process):
    name = iox2.ServiceName.new(interface.BELL_SERVICE.format(process))
    builder = node.service_builder(name).event()
    builder = builder.max_notifiers(interface.MAX_NOTIFIERS).max_listeners(interface.MAX_LISTENERS)
    return builder.max_nodes(interface.MAX_NODES).open_or_create()


def channel(node, message):
    builder = node.service_builder(iox2.ServiceName.new(message.SERVICE)).publish_subscribe(message)
    builder = builder.enable_safe_overflow(True).history_size(0)
    builder = builder.subscriber_max_buffer_size(interface.DEEPEST_BUFFER)
    builder = builder.subscriber_max_borrowed_samples(interface.MAX_BORROWED)
    builder = builder.max_publishers(interface.MAX_PUBLISHERS).max_subscribers(interface.MAX_SUBSCRIBERS)
    return patiently(builder.max_nodes(interface.MAX_NODES).open_or_create)


def patiently(open_service, limit_s=2.0):
    """While another process creates the same service, opening fails for a moment."""
    start = time.monotonic()
    while True:
        try:
            return open_service()
        except Exception:
            if time.monotonic() - start > limit_s:
                raise
            time.sleep(STEP_S)


class Meeting:
    """Opens a process's channels and meets the others; then `receive` and `send`, and at the end `close`."""

    def __init__(self, reads, sends, start_limit_s=None):
        environment = os.environ
        self.process = environment["ANHYST_PROCESS"]
        processes = environment.get("ANHYST_PROCESSES") or ",".join(interface.NODES)
        self._processes = processes.split(",")
        self._limit_s = start_limit_s or float(environment.get("ANHYST_START_LIMIT_S", "60"))
        self._yields = int(environment.get("ANHYST_YIELDS", "20"))
        clock = environment.get("ANHYST_CLOCK", "lockstep")
        if clock not in ("lockstep", "free_running", "paced_by_measurement"):
            raise ValueError(f"ANHYST_CLOCK={clock} is no way to keep time")
        self.realtime = clock != "lockstep"
        self._epoch_ns = 0
        self._node = self._create_node(environment["ANHYST_SERVICE_PREFIX"], environment["ANHYST_ROOT"])
        self._bell = event(self._node, self.process).listener_builder().create()
        self._create_status()
        self._peers = {name: self._find(name) for name in self._processes if name != self.process}
        self._inputs = {message: self._subscribe(message) for message in reads}
        self._outputs = {message: channel(self._node, message).publisher_builder().create() for message in sends}
        self.reads = tuple(reads)
        self._due = dict.fromkeys(reads, 0)
        self._newest = dict.fromkeys(reads)
        self._meet(1)
        for publisher in self._outputs.values():
            publisher.update_connections()
        self._meet(2)
        # Who must be reached, and who may have to be woken: fixed from here on.
        self._readers = {message: self._readers_of(message) for message in sends}

    def _create_node(self, prefix, root):
        iox2.set_log_level(iox2.LogLevel.Error)
        # A configuration file in the working directory must not change where the run lives: both are set here.
        config = iox2.config.default()
        config.global_cfg.prefix = iox2.FileName.new(prefix)
        config.global_cfg.root_path = iox2.Path.new(root)
        builder = iox2.NodeBuilder.new().name(iox2.NodeName.new(self.process)).config(config)
        builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        return builder.create(iox2.ServiceType.Ipc)

    def _create_status(self):
        name = iox2.ServiceName.new(interface.STATUS_SERVICE.format(self.process))
        builder = self._node.service_builder(name).blackboard_creator(ctypes.c_uint64)
        builder = builder.max_readers(interface.MAX_STATUS_READERS).max_nodes(interface.MAX_NODES)
        zeros = (interface.PHASE, interface.ASLEEP, interface.TICK, interface.EPOCH)
        for key, first in {**dict.fromkeys(zeros, 0), interface.AGREEMENT: interface.ANY_AGREEMENT}.items():
            builder = builder.add(ctypes.c_uint64(key), ctypes.c_uint64(first))
        try:
            self._status = builder.create()
        except iox2.BlackboardCreateError as error:
            if "AlreadyExists" not in repr(error) + str(error):
                raise
            prefix = os.environ["ANHYST_SERVICE_PREFIX"]
            sentence = f"another process is there as {self.process} under {prefix}: end it, or choose another prefix"
            raise Taken(sentence) from error
        self._writer = self._status.writer_builder().create()
        entry = lambda key: self._writer.entry(ctypes.c_uint64(key), ctypes.c_uint64)
        self._phase, self._asleep, self._tick, self._epoch = map(entry, zeros)

    def _find(self, name):
        service = iox2.ServiceName.new(interface.STATUS_SERVICE.format(name))
        opener = lambda: self._node.service_builder(service).blackboard_opener(ctypes.c_uint64).open()
        start = time.monotonic()
        while True:
            try:
                return Peer(self._node, name, opener())
            except Exception as error:  # not there yet, or half made
                if time.monotonic() - start > self._limit_s:
                    raise Absent(f"{name} did not come within {self._limit_s} s (phase 0: start)") from error
                time.sleep(STEP_S)

    def _subscribe(self, message):
        builder = channel(self._node, message).subscriber_builder().buffer_size(interface.LOOP_BUFFER)
        return builder.name(iox2.PortName.new(self.process.split("+")[0])).create()

    def _readers_of(self, message):
        mine = self.process.split("+")
        nodes = [node for node in message.READERS if node not in mine]
        peers = {name: peer for name, peer in self._peers.items() if set(name.split("+")) & set(nodes)}
        return len(nodes), list(peers.values())

    def _meet(self, phase):
        """Says that this process has finished `phase`, and waits until all have."""
        self._phase.update_with_copy(ctypes.c_uint64(phase))
        start = time.monotonic()
        for peer in self._peers.values():
            while peer.phase() < phase:
                if phase == 3 and self.realtime and self._successor_at_end(peer):
                    break
                if time.monotonic() - start > self._limit_s:
                    raise Absent(f"{peer.name} did not come within {self._limit_s} s (phase {phase})")
                time.sleep(STEP_S)

    def _successor_at_end(self, peer):
        """In real time a process that died may have been started again: under another status."""
        for start in range(1, MAX_STARTS + 1):
            service = iox2.ServiceName.new(interface.STATUS_SERVICE.format(peer.name) + f"/{start}")
            try:
                status = self._node.service_builder(service).blackboard_opener(ctypes.c_uint64).open()
                reader = status.reader_builder().create()
                if value(reader.entry(ctypes.c_uint64(interface.PHASE), ctypes.c_uint64)) >= 3:
                    return True
            except Exception:
                continue  # There is none of that number.
        return False

    def _poll(self, message):
        sample = self._inputs[message].receive()
        if sample is None:
            return None
        # Copied: the sample goes back to its sender.
        token = message.from_buffer_copy(sample.payload().contents)
        sample.delete()
        return token

    def receive(self, message, limit_s):
        """The next token; None at the end of the run. TimeoutError on silence, Lost on a gap.

        In real time: the newest, which is newer than the one taken last; those between are dropped.
        """
        token = self._wait(message, limit_s)
        if self.realtime:
            last = self._newest[message]
            while token is not None and self.newest(message, token) is last:
                token = self._wait(message, limit_s)
            return token and self._newest[message]
        if token is not None:
            due, self._due[message] = self._due[message], token.tick + 1
            if token.tick != due:
                raise Lost(f"{self.process} expected tick {due} of {message.SERVICE}, but {token.tick} came")
        return token

    def _wait(self, message, limit_s):
        for _ in range(self._yields):
            token = self._poll(message)
            if token is not None:
                return token
            os.sched_yield()
        start = time.monotonic()
        producer = next(peer for name, peer in self._peers.items() if message.PRODUCER in name.split("+"))
        while True:
            # Looked at before the channel: what was sent before the end is then found.
            ended = producer.phase() >= 3
            self._asleep.update_with_copy(ctypes.c_uint64(1))
            token = self._poll(message)
            if token is None and not ended:
                self._bell.timed_wait(iox2.Duration.from_millis(NAP_REALTIME_MS if self.realtime else NAP_MS))
                token = self._poll(message)
            self._asleep.update_with_copy(ctypes.c_uint64(0))
            if token is not None or ended:
                return token
            if time.monotonic() - start > limit_s:
                tick = self._due[message]
                raise TimeoutError(f"{message.PRODUCER} has been silent for {limit_s} s: no {message.SERVICE} of tick {tick}")

    def newest(self, message, token=None):
        """In real time: the newest token there is, without waiting; None before the first."""
        token = token or self._poll(message)
        while token is not None:
            if self._newest[message] is None or token.tick > self._newest[message].tick:
                self._newest[message], self._due[message] = token, token.tick + 1
            token = self._poll(message)
        return self._newest[message]

    def wait_for_tick(self, tick, tick_s):
        """For a plant in real time: sleeps until a tick begins; tick 0 does so 20 ms after the first call."""
        if self._epoch_ns == 0:
            self._say_epoch(time.monotonic_ns() + RUN_UP_NS)
        due_s = self._epoch_ns * 1e-9 + tick * tick_s
        while (left_s := due_s - time.monotonic()) > 0.0:
            time.sleep(left_s)

    def _say_epoch(self, epoch_ns):
        self._epoch_ns = epoch_ns
        self._epoch.update_with_copy(ctypes.c_uint64(epoch_ns))

    def send(self, token):
        """Sends a token to every reader."""
        message = type(token)
        expected, readers = self._readers[message]
        token.sent_ns = time.monotonic_ns()
        if message is interface.Measurement:
            self._pace(token)
        reached = self._outputs[message].send_copy(token)
        if reached < expected and not self.realtime:
            raise Lost(f"{message.SERVICE} of tick {token.tick} reached {reached} of {expected} readers")
        for peer in readers:
            if peer.asleep():
                try:
                    peer.bell.notify()
                except Exception:
                    if not self.realtime:  # There it may be the bell of a process that has just died.
                        raise
        # After the bells: a tick is finished when its readers are told.
        self._tick.update_with_copy(ctypes.c_uint64(token.tick + 1))

    def _pace(self, token):
        """What the sender of measurements owes the others."""
        if self.realtime:
            if self._epoch_ns == 0:
                self._say_epoch(token.sent_ns)
            return
        recorder = next((peer for name, peer in self._peers.items() if "recorder" in name.split("+")), None)
        start = time.monotonic()
        while recorder is not None and recorder.tick() + CREDIT_TICKS < token.tick:
            if time.monotonic() - start > self._limit_s:
                raise Absent(f"{recorder.name} has been {CREDIT_TICKS} ticks behind for {self._limit_s} s")
            time.sleep(STEP_S / 10)

    def close(self):
        """Waits until all have come to the end: who left earlier could not be sent its last tokens."""
        self._meet(3)
        self._phase.update_with_copy(ctypes.c_uint64(4))
