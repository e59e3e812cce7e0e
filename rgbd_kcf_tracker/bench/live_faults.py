# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Inject faults into the real tracker process and see whether it still answers good images.

    python -m rgbd_kcf_tracker.bench.live_faults --faults 2000 --seed 7

Messages that lie, storms of requests, parameters of any kind, lifecycle transitions in any order,
and signals in any state. After each fault the node must answer a good pair, have no internal error,
and keep its memory; told to stop, it must end with status 0 and no traceback. The same seed gives
the same faults.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, PointStamped, PolygonStamped
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, RegionOfInterest
from std_msgs.msg import Header, UInt32
from std_srvs.srv import Trigger

from rgbd_kcf_tracker.bench.domains import kept_to_this_machine
from rgbd_kcf_tracker.bench.rig import environment, resident_mb
from rgbd_kcf_tracker.errors import RgbdKcfError
from rgbd_kcf_tracker.live.settings import READ_ONLY, all_parameters
from rgbd_kcf_tracker.recordings.storage import NANOSECONDS
from rgbd_kcf_tracker.ros.messages import image_message, stamp_from_ns, stamp_to_ns

NAMESPACE = '/rgbd_kcf_faults'
TRACKER = f'{NAMESPACE}/tracker'
WIDTH, HEIGHT = 160, 120
PATIENCE_S = 30.0
"""For an answer or an end, on a machine however busy."""
GROWTH_MB = 150.0
AHEAD_NS = 100 * NANOSECONDS
"""Each good pair is so much later than what came before: a jump ahead, never a late image."""


class FaultFound(Exception):
    """The node did not survive a fault as it should."""


class Target:
    """The tracker's process, and a camera and a user beside it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.env = environment()
        rclpy.init()
        self.node = Node('injector', namespace=NAMESPACE)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        qos = QoSProfile(depth=50)
        make = self.node.create_publisher
        self.color = make(Image, 'color/image', qos)
        self.depth = make(Image, 'depth/image', qos)
        self.info = make(CameraInfo, 'color/camera_info', qos)
        self.init = make(RegionOfInterest, f'{TRACKER}/init', qos)
        self.point = make(PointStamped, f'{TRACKER}/init_point', qos)
        self.add = make(RegionOfInterest, f'{TRACKER}/add', qos)
        self.remove = make(UInt32, f'{TRACKER}/remove', qos)
        self.clock = make(Clock, '/clock', qos)
        self.answers: Counter[int] = Counter()
        self.values: dict[str, str] = {}
        self.node.create_subscription(PolygonStamped, f'{TRACKER}/box', self._answered, qos)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, qos)
        client = self.node.create_client
        self._change = client(ChangeState, f'{TRACKER}/change_state')
        self._state = client(GetState, f'{TRACKER}/get_state')
        self._set = client(SetParameters, f'{TRACKER}/set_parameters')
        self._reset = client(Trigger, f'{TRACKER}/reset')
        self.now_ns = 1_700_000_000 * NANOSECONDS
        self.process: subprocess.Popen[bytes] | None = None
        self._log = Path(tempfile.mkstemp(prefix='rgbd_kcf_faults_', suffix='.log')[1])
        self.settled_mb = 0.0

    def _answered(self, message: Any) -> None:
        self.answers[stamp_to_ns(message.header.stamp)] += 1

    def _diagnosed(self, message: Any) -> None:
        for status in message.status:
            if status.name.startswith(TRACKER):
                self.values = {pair.key: pair.value for pair in status.values}

    # --- the process -----------------------------------------------------------------------------

    def start(self) -> None:
        """Start the node, and wait until it answers."""
        self._log.write_bytes(b'')
        with self._log.open('ab') as log:
            self.process = subprocess.Popen(
                [
                    *(sys.executable, '-m', 'rgbd_kcf_tracker.ros.tracker_main', '--ros-args'),
                    *('-r', f'__ns:={NAMESPACE}', '-p', 'queue_policy:=all'),
                ],
                env=self.env,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        self.values = {}
        self.check()
        self.settled_mb = resident_mb(self.process.pid)

    def stop(self, number: int) -> None:
        """Send a signal; the node must end well, or at once where it is killed.

        Raises:
            FaultFound: where it does not.
        """
        assert self.process is not None
        self.process.send_signal(number)
        try:
            status = self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise FaultFound(f'it did not end on signal {number}') from None
        wanted = -signal.SIGKILL if number == signal.SIGKILL else 0
        if status != wanted:
            raise FaultFound(
                f'it ended with status {status} on signal {number}: {self.last_words()}'
            )
        self._check_log()

    def last_words(self) -> str:
        """The end of what it printed."""
        return self._log.read_text(encoding='utf-8', errors='replace')[-500:]

    def _check_log(self) -> None:
        text = self._log.read_text(encoding='utf-8', errors='replace')
        if 'Traceback' in text:
            raise FaultFound(f'it printed a traceback: {text[text.index("Traceback") :][:2000]}')
        # Diagnostics come once a second: what goes wrong just before an end is told here alone.
        errors = [line[:500] for line in text.splitlines() if 'internal error' in line]
        if errors:
            raise FaultFound('\n'.join(errors))

    def close(self) -> None:
        """End everything."""
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._log.unlink(missing_ok=True)
        self.node.destroy_node()
        rclpy.try_shutdown()

    # --- what a good camera and a good user do ---------------------------------------------------

    def spin(self, seconds: float) -> None:
        """Listen for so long."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.executor.spin_once(timeout_sec=left)

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Listen until something is so.

        Raises:
            FaultFound: where it does not become so, or the node ends.
        """
        end = time.monotonic() + PATIENCE_S
        while not condition():
            if self.process is not None and self.process.poll() is not None:
                raise FaultFound(f'the node ended by itself: {self.last_words()}')
            if time.monotonic() > end:
                raise FaultFound(f'waited in vain for {what}; diagnostics {self.values}')
            self.spin(0.02)

    def call(self, client: Any, request: Any, what: str) -> Any:
        """Call a service of the node; it must answer."""
        self.until(client.service_is_ready, what)
        answer = client.call_async(request)
        self.until(answer.done, what)
        return answer.result()

    def transition(self, number: int) -> bool:
        """Ask for a transition; says whether it was made."""
        request = ChangeState.Request()
        request.transition.id = number
        return bool(self.call(self._change, request, f'transition {number}').success)

    def state(self) -> int:
        """The lifecycle state."""
        return int(self.call(self._state, GetState.Request(), 'get_state').current_state.id)

    def set(self, name: str, value: ParameterValue) -> Any:
        """Set a parameter; says how that went."""
        request = SetParameters.Request(parameters=[ParameterMessage(name=name, value=value)])
        return self.call(self._set, request, f'set_parameters {name}').results[0]

    def choose(self) -> None:
        """Choose the textured thing of :meth:`pair` as the target."""
        self.init.publish(RegionOfInterest(x_offset=60, y_offset=30, width=40, height=60))
        self.now_ns += 33_000_000
        self.send()
        self.spin(0.05)

    def reset(self) -> None:
        """Ask to drop the target, without waiting for the answer."""
        if self._reset.service_is_ready():
            self._reset.call_async(Trigger.Request())

    def header(self, stamp_ns: int | None = None) -> Header:
        """Of an image of now, or of another stamp."""
        stamp = self.now_ns if stamp_ns is None else stamp_ns
        return Header(stamp=stamp_from_ns(stamp), frame_id='camera')

    def pair(self, stamp_ns: int | None = None) -> tuple[Image, Image]:
        """A good picture: something textured at 2 m before a wall at 4 m."""
        header = self.header(stamp_ns)
        color = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
        color[30:90, 60:100] = np.random.default_rng(1).integers(0, 255, (60, 40, 3), np.uint8)
        depth = np.full((HEIGHT, WIDTH), 4000, np.uint16)
        depth[30:90, 60:100] = 2000
        return image_message(header, color, 'bgr8'), image_message(header, depth, '16UC1')

    def send(self, stamp_ns: int | None = None) -> None:
        """A good pair."""
        for publisher, message in zip((self.color, self.depth), self.pair(stamp_ns), strict=True):
            publisher.publish(message)

    def check(self) -> None:
        """A good pair must be answered, and nothing be wrong inside.

        Raises:
            FaultFound: where it is not so.
        """
        end = time.monotonic() + PATIENCE_S
        while True:
            # Again and again: the first may find the node not yet listening.
            self.now_ns += AHEAD_NS
            self.answers.clear()
            sent = self.now_ns
            self.send()
            self.spin(0.02)
            wait = time.monotonic() + 1.0
            while not self.answers[sent] and time.monotonic() < wait:
                self.spin(0.01)
            if self.answers[sent]:
                break
            if self.process is not None and self.process.poll() is not None:
                raise FaultFound(f'the node ended by itself: {self.last_words()}')
            if time.monotonic() > end:
                raise FaultFound(f'a good pair was not answered; diagnostics {self.values}')
        self._check_log()
        if int(self.values.get('internal_errors', 0)):
            raise FaultFound(f'internal error, not logged: {self.values}')
        assert self.process is not None
        grown = resident_mb(self.process.pid) - self.settled_mb
        if self.settled_mb and grown > GROWTH_MB:
            raise FaultFound(f'its memory grew by {grown:.0f} MB')


# --- the faults ----------------------------------------------------------------------------------

ODD_NUMBERS = (0, 1, 2, 3, 7, 2**16, 2**31 - 1, 2**31, 2**32 - 50, 2**32 - 1)
ODD_FLOATS = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-300,
    1e308,
    -1e308,
    float('nan'),
    float('inf'),
    -float('inf'),
)
ODD_TEXTS = ('', 'bgr8', 'jpeg', '16UC1', '32FC1', 'x' * 100_000, '\x00', '8UC4', 'kcf', '1,2,3,4')


def _pick(rng: np.random.Generator, values: tuple[Any, ...]) -> Any:
    return values[int(rng.integers(len(values)))]


def lying_images(at: Target) -> None:
    """Fields of an image that do not belong together."""
    for _ in range(int(at.rng.integers(1, 6))):
        at.now_ns += 33_000_000
        for publisher, message in zip((at.color, at.depth), at.pair(), strict=True):
            for name in ('height', 'width', 'step'):
                if at.rng.random() < 0.4:
                    setattr(message, name, _pick(at.rng, ODD_NUMBERS))
            if at.rng.random() < 0.4:
                message.encoding = _pick(at.rng, ODD_TEXTS)
            if at.rng.random() < 0.3:
                message.is_bigendian = int(at.rng.integers(256))
            if at.rng.random() < 0.4:
                message.data = message.data[: int(at.rng.integers(len(message.data) + 1))]
            publisher.publish(message)


def corrupt_bytes(at: Target) -> None:
    """Messages whose serialised bytes are flipped, and half of them cut off as well."""
    for publisher, message in zip((at.color, at.depth), at.pair(), strict=True):
        raw = bytearray(serialize_message(message))
        head = min(len(raw), 100)
        for _ in range(int(at.rng.integers(1, 8))):
            raw[int(at.rng.integers(4, head))] ^= int(at.rng.integers(1, 256))
        # One that is cut off never reaches the node: its middleware cannot read it.
        cut = at.rng.random() < 0.5
        publisher.publish(bytes(raw[: int(at.rng.integers(20, len(raw)))] if cut else raw))


def odd_stamps(at: Target) -> None:
    """Stamps that stand still, jump, or are of another age."""
    odd = (0, 1, at.now_ns, at.now_ns - 3600 * NANOSECONDS, (2**31 - 1) * NANOSECONDS)
    for _ in range(6):
        stamp = _pick(at.rng, odd)
        color, depth = at.pair(stamp)
        if at.rng.random() < 0.3:
            depth.header.stamp = stamp_from_ns(_pick(at.rng, odd))
        at.color.publish(color)
        at.depth.publish(depth)


def lonely_streams(at: Target) -> None:
    """Colour or depth alone, twice, or in another order."""
    for _ in range(10):
        at.now_ns += 33_000_000
        messages = list(zip((at.color, at.depth), at.pair(), strict=True))
        at.rng.shuffle(messages)  # type: ignore[arg-type]
        for publisher, message in messages[: int(at.rng.integers(1, 3))]:
            for _ in range(int(at.rng.integers(1, 3))):
                publisher.publish(message)


def burst(at: Target) -> None:
    """Many pairs at once."""
    for _ in range(int(at.rng.integers(50, 300))):
        at.now_ns += 1_000_000
        at.send()


def odd_cameras(at: Target) -> None:
    """Intrinsics that are none, or fit the image and are of no camera, of a followed target."""
    at.choose()
    for _ in range(5):
        info = CameraInfo(header=at.header())
        if at.rng.random() < 0.5:
            info.width, info.height = _pick(at.rng, ODD_NUMBERS), _pick(at.rng, ODD_NUMBERS)
            info.k = [float(_pick(at.rng, ODD_FLOATS)) for _ in range(9)]
            info.p = [float(_pick(at.rng, ODD_FLOATS)) for _ in range(12)]
        else:
            focal, middle = (float(_pick(at.rng, ODD_FLOATS)) for _ in range(2))
            info.width, info.height = WIDTH, HEIGHT
            info.k = [focal, 0.0, middle, 0.0, focal, middle, 0.0, 0.0, 1.0]
        info.distortion_model = _pick(at.rng, ('plumb_bob', 'equidistant', *ODD_TEXTS))
        info.d = [float(_pick(at.rng, (0.1, *ODD_FLOATS)))] * _pick(at.rng, (0, 4, 5, 8, 100))
        at.info.publish(info)
        at.now_ns += 33_000_000
        at.send()
        at.spin(0.02)
    at.info.publish(CameraInfo(header=at.header()))


def other_pictures(at: Target) -> None:
    """Pictures of other sizes, down to nothing, and of other frames, while a target is followed."""
    at.choose()
    for _ in range(6):
        at.now_ns += 33_000_000
        width, height = (int(_pick(at.rng, (0, 1, 2, 3, 8, 40, WIDTH, 500))) for _ in range(2))
        color, depth = at.pair()
        for message, size in ((color, 3), (depth, 2)):
            message.width, message.height, message.step = width, height, size * width
            message.data = at.rng.bytes(size * width * height)
            message.header.frame_id = _pick(at.rng, ('camera', *ODD_TEXTS))
        at.color.publish(color)
        at.depth.publish(depth)
        at.spin(0.02)


def additions(at: Target) -> None:
    """Further targets that come and go by the hundred, of ids that nobody has."""
    for _ in range(int(at.rng.integers(20, 200))):
        x, y, width, height = (int(at.rng.integers(most)) for most in (WIDTH, HEIGHT, 60, 60))
        at.add.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))
        at.remove.publish(UInt32(data=_pick(at.rng, (1, 2, 3, *ODD_NUMBERS))))
        if at.rng.random() < 0.1:
            at.now_ns += 33_000_000
            at.send()
            at.spin(0.01)
    at.reset()


def clocks(at: Target) -> None:
    """A clock on /clock that jumps and stops, taken up and left while images come."""
    at.set('use_sim_time', ParameterValue(type=1, bool_value=True))
    for _ in range(5):
        seconds = int(_pick(at.rng, (0, 1, 5, 10**9, 2**31 - 1)))
        at.clock.publish(Clock(clock=Time(sec=seconds)))
        at.now_ns += 33_000_000
        at.send()
        at.spin(0.1)
    at.set('use_sim_time', ParameterValue(type=1, bool_value=False))


def odd_boxes(at: Target) -> None:
    """Boxes and clicks of any size and place, some of them good, many at once."""
    for _ in range(int(at.rng.integers(1, 40))):
        numbers = [
            _pick(at.rng, ODD_NUMBERS) if at.rng.random() < 0.5 else int(at.rng.integers(200))
            for _ in range(4)
        ]
        x, y, width, height = numbers
        at.init.publish(RegionOfInterest(x_offset=x, y_offset=y, width=width, height=height))
        place = Point(x=float(_pick(at.rng, ODD_FLOATS)), y=float(at.rng.integers(-10, 200)))
        at.point.publish(PointStamped(header=at.header(), point=place))
        if at.rng.random() < 0.2:
            at.reset()
        if at.rng.random() < 0.5:
            at.now_ns += 33_000_000
            at.send()


def odd_parameters(at: Target) -> None:
    """Parameters of any name, type and value; afterwards those of the node are as before."""
    infos = [info for info in all_parameters() if info.name not in READ_ONLY]
    for _ in range(8):
        info = infos[int(at.rng.integers(len(infos)))]
        value = _pick(
            at.rng,
            (
                ParameterValue(type=1, bool_value=bool(at.rng.integers(2))),
                ParameterValue(type=2, integer_value=int(_pick(at.rng, ODD_NUMBERS))),
                ParameterValue(type=3, double_value=float(_pick(at.rng, ODD_FLOATS))),
                ParameterValue(type=4, string_value=_pick(at.rng, ODD_TEXTS)),
                ParameterValue(type=8, double_array_value=[float(_pick(at.rng, ODD_FLOATS))] * 4),
                ParameterValue(type=0),
            ),
        )
        name = info.name if at.rng.random() < 0.9 else _pick(at.rng, ('', 'x' * 1000, '.', 'a.b.c'))
        at.set(name, value)
        at.now_ns += 33_000_000
        at.send()
    for info in infos:
        if '.' not in info.name:
            at.set(info.name, _parameter_value(info.default))


def _parameter_value(value: Any) -> ParameterValue:
    if isinstance(value, bool):
        return ParameterValue(type=1, bool_value=value)
    if isinstance(value, int):
        return ParameterValue(type=2, integer_value=value)
    if isinstance(value, float):
        return ParameterValue(type=3, double_value=value)
    return ParameterValue(type=4, string_value=value)


def odd_transitions(at: Target) -> None:
    """Transitions in any order, while images come; afterwards the node is active again."""
    for _ in range(6):
        at.now_ns += 33_000_000
        at.send()
        if at.rng.random() < 0.5:
            at.reset()
        at.transition(int(_pick(at.rng, (0, 1, 2, 3, 4, 5, 6, 7, 8, 99, 250))))
        if at.state() == State.PRIMARY_STATE_FINALIZED:  # as 5, 6 and 7 ask, each from its state
            at.stop(signal.SIGINT)
            at.start()
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        at.transition(transition)
    if at.state() != State.PRIMARY_STATE_ACTIVE:
        raise FaultFound(f'it cannot be activated again: {at.values}')


def signals(at: Target) -> None:
    """The end, in any state, by any signal, once or twice; then a new start."""
    number = _pick(at.rng, (signal.SIGINT, signal.SIGTERM, signal.SIGKILL))
    if at.rng.random() < 0.5:
        burst(at)
    if at.rng.random() < 0.5 and number != signal.SIGKILL and at.process is not None:
        at.process.send_signal(number)
        time.sleep(float(at.rng.uniform(0, 0.05)))
    at.stop(number)
    at.start()


FAULTS: dict[Callable[[Target], None], float] = {
    lying_images: 4,
    corrupt_bytes: 3,
    odd_stamps: 3,
    lonely_streams: 2,
    burst: 2,
    odd_cameras: 2,
    other_pictures: 2,
    additions: 1,
    clocks: 1,
    odd_boxes: 4,
    odd_parameters: 2,
    odd_transitions: 2,
    signals: 0.5,
}
"""Each fault, and how often it comes beside the others."""


@dataclass
class Injection:
    """What came of a run.

    Attributes:
        done: how often each fault was injected.
        found: what went wrong, with the number of the fault; empty where nothing did.
    """

    done: Counter[str] = field(default_factory=Counter)
    found: list[str] = field(default_factory=list)


def inject(number: int, seed: int, say: Callable[[str], None] = lambda _: None) -> Injection:
    """Inject so many faults, each kind once before any comes again; start anew after a find."""
    rng = np.random.default_rng(seed)
    kinds = list(FAULTS)
    shares = np.array(list(FAULTS.values()))
    order = list(rng.permutation(len(kinds)))
    order += list(rng.choice(len(kinds), max(number - len(kinds), 0), p=shares / shares.sum()))
    outcome = Injection()
    target = Target(rng)
    try:
        target.start()
        for count, kind in enumerate(order[:number]):
            fault = kinds[kind]
            outcome.done[fault.__name__] += 1
            try:
                fault(target)
                target.check()
            except FaultFound as error:
                outcome.found.append(f'fault {count}, {fault.__name__}: {error}')
                say(outcome.found[-1])
                if target.process is not None and target.process.poll() is None:
                    target.process.kill()
                    target.process.wait()
                target.start()
            if count % 100 == 99:
                say(f'{count + 1} faults, {len(outcome.found)} not survived')
        target.stop(signal.SIGINT)
    except FaultFound as error:
        outcome.found.append(f'at the end: {error}')
    finally:
        target.close()
    return outcome


def main(arguments: list[str] | None = None) -> int:
    """Inject and report; status 1 where a fault was not survived."""
    parser = argparse.ArgumentParser(
        prog='python -m rgbd_kcf_tracker.bench.live_faults',
        description=(__doc__ or '').split('\n')[0],
    )
    parser.add_argument('--faults', type=int, default=500, help='how many')
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args(arguments)
    if options.faults < 1 or options.seed < 0:
        parser.error('--faults must be 1 or more, and --seed 0 or more')
    try:
        with kept_to_this_machine():
            outcome = inject(options.faults, options.seed, lambda text: print(text, flush=True))
    except RgbdKcfError as error:
        parser.error(str(error))
    for name, count in sorted(outcome.done.items()):
        print(f'{count:6d} {name}')
    print(f'{sum(outcome.done.values())} faults, {len(outcome.found)} not survived')
    return 1 if outcome.found else 0


if __name__ == '__main__':
    sys.exit(main())
