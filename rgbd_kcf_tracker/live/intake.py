# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Receiving: messages in, captures out. Only stores, never decodes, so that it takes no time.

Pairing itself is the recordings' (:class:`StampPairer`), so that live and recorded images are
paired by one rule. What a live stream needs beyond it is here: stamps that say nothing (always the
same, mostly zero) are replaced by the arrival, a colour image waits only so long for its depth, and
the first ones wait for the camera_info that comes with them.
"""

from __future__ import annotations

from collections import Counter, deque
from typing import Any

from rgbd_kcf_tracker.live.processor import Capture
from rgbd_kcf_tracker.live.settings import NodeParameters
from rgbd_kcf_tracker.live.statistics import Statistics
from rgbd_kcf_tracker.live.timeline import StampRepair
from rgbd_kcf_tracker.recordings.camera_info import Camera
from rgbd_kcf_tracker.recordings.messages import stamp_of
from rgbd_kcf_tracker.recordings.pairing import Pair, StampPairer, patient_pairer

MISSES = 3
"""Colour images in a row without depth after which depth is not waited for any more."""
PATIENT_WAIT_NS = 1_000_000_000
"""Least wait for depth where every pair counts and speed does not."""
HELD = 5
"""Images that wait for the first intrinsics: a sixth of a second at 30 Hz, tracked at once then."""
PATIENT_DEPTHS = 60
"""Depth images that wait for their colour where every pair counts: two seconds at 30 Hz, twice as
long as colour waits for depth, and a quarter of a gigabyte of 1920x1080."""
GAPS = 8
"""Steps between depth stamps of which the shortest is the period: one that is lost is none."""
REMEMBERED = 60
"""Colour images that went out alone and are remembered: two seconds at 30 Hz."""


class DepthFit:
    """Whether depth is worth waiting for, and if not, why it never fits.

    Args:
        tolerance_ns: of stamps within a pair.
        wait_ns: how long colour would wait.
    """

    def __init__(self, tolerance_ns: int, wait_ns: int) -> None:
        self._tolerance_ns, self._wait_ns = tolerance_ns, wait_ns
        self._misses = self._unused = 0
        self._alone: deque[tuple[int, int]] = deque(maxlen=REMEMBERED)
        self._newest: int | None = None
        self._gaps: deque[int] = deque(maxlen=GAPS)
        self._apart_ns = 0
        self._late_ns: int | None = None

    @property
    def hopeless(self) -> bool:
        """Several colour images in a row found no depth, and none came soon after them."""
        return self._misses >= MISSES

    @property
    def fault(self) -> str:
        """Why depth does not fit, in words; empty where it does or nothing is known."""
        if not self.hopeless or self._newest is None:
            return ''
        if self._late_ns is not None:
            return (
                f'depth comes {self._late_ns * 1e-9:.2f} s after its colour image: see depth_wait'
            )
        return (
            f'stamps of depth are {self._apart_ns * 1e-9:.3f} s from those of colour: are the '
            'streams synchronised (see pair_tolerance)?'
        )

    def paired(self) -> None:
        """A colour image found its depth."""
        self._misses = self._unused = 0

    def missed(self, stamp_ns: int, arrival_ns: int) -> None:
        """A colour image went out alone."""
        self._misses += 1
        self._alone.append((stamp_ns, arrival_ns))
        if self._newest is not None:
            self._apart_ns = abs(stamp_ns - self._newest)

    def came(self, stamp_ns: int, arrival_ns: int) -> None:
        """A depth image came; where its colour image went out alone, it may have been in time."""
        self._unused += 1
        if self._newest is not None:
            self._gaps.append(max(stamp_ns - self._newest, 0))
        self._newest = stamp_ns
        late = [a for s, a in self._alone if abs(s - stamp_ns) <= self._tolerance_ns]
        self._late_ns = arrival_ns - late[-1] if late else None
        if self._late_ns is not None and self._late_ns <= self._wait_ns:
            self._misses = self._unused = 0

    def leaves_out(self, stamp_ns: int) -> bool:
        """Whether a colour image falls between two depth images, at the rate at which they come.

        So it may only where depth images find the colour images that are theirs.
        """
        if self._newest is None or len(self._gaps) < GAPS or self._unused > MISSES:
            return False
        period = min(self._gaps)
        # Where the depth image before the newest was lost, its colour image is a period older.
        jitter = min(self._tolerance_ns // 2, period // 4)
        after = self._newest - period + jitter
        return after < stamp_ns < self._newest + period - self._tolerance_ns


class Intake:
    """Pairs the messages of the two image streams.

    Args:
        statistics: where to count.
        tolerance_s: of stamps within a pair.
        depth_wait_s: how long colour waits for depth.
        camera_info_wait_s: how long the first colour waits for intrinsics.
        patient: every pair counts (recordings, lock-step): wait longer rather than miss a partner.
        queue_size: pairs that may wait for their turn where every pair counts.

    Attributes:
        fit: whether depth finds its colour image.
    """

    def __init__(
        self,
        statistics: Statistics,
        *,
        tolerance_s: float,
        depth_wait_s: float,
        camera_info_wait_s: float,
        patient: bool,
        queue_size: int = NodeParameters.queue_size,
    ) -> None:
        self._statistics = statistics
        # As recordings are paired where every pair counts: stamps alone decide, not the rate.
        self._pairer: StampPairer[Any, Any] = (
            patient_pairer(tolerance_s, PATIENT_DEPTHS) if patient else StampPairer(tolerance_s)
        )
        self._wait_ns = round(depth_wait_s * 1e9)
        self._first_wait_ns = max(self._wait_ns, PATIENT_WAIT_NS) if patient else self._wait_ns
        self.fit = DepthFit(self._pairer.tolerance_ns, self._first_wait_ns)
        self._info_wait_ns = round(camera_info_wait_s * 1e9)
        self._patient = patient
        standing: dict[int, int] = {}
        self._repair_color, self._repair_depth = StampRepair(standing), StampRepair(standing)
        self._counted: Counter[str] = Counter()
        self._arrivals: dict[int, int] = {}
        self._held: deque[Capture] = deque()
        # With one more they fill the queue: more would push all of each other out of it at once.
        self._most_held = queue_size - 1 if patient else HELD
        self._hold_from: int | None = None
        self._holding = True
        self._camera: Camera | None = None
        self.info_expected = True
        self.depth_expected = True

    @property
    def idle(self) -> bool:
        """Whether nothing waits, so that :meth:`poll` has nothing to do."""
        return not self._arrivals and not self._held

    @property
    def camera_known(self) -> bool:
        """Whether the camera has said anything of itself."""
        return self._camera is not None

    def camera_info(self, camera: Camera, arrival_ns: int) -> list[Capture]:
        """Take in what the camera says of itself; returns what waited for it."""
        self._camera = camera
        return self._release_held(arrival_ns)

    def color(self, message: Any, arrival_ns: int) -> list[Capture]:
        """Take in a colour message; returns the pairs that are now complete."""
        self._statistics.image_came()
        header_stamp = stamp_of(message)
        stamp = self._repair_color(header_stamp, arrival_ns, message.data)
        if stamp is None:
            self._statistics.count('duplicates')
            return []
        self._arrivals[stamp] = arrival_ns
        captures = self._captures(self._pairer.add_color(stamp, message), arrival_ns)
        return captures + self._left_out(arrival_ns) + self.poll(arrival_ns)

    def depth(self, message: Any, arrival_ns: int) -> list[Capture]:
        """Take in a depth message; returns the pairs that are now complete."""
        self._statistics.depth_came()
        header_stamp = stamp_of(message)
        stamp = self._repair_depth(header_stamp, arrival_ns, message.data)
        if stamp is None:
            self._statistics.count('duplicates')
            return []
        self.fit.came(stamp, arrival_ns)
        captures = self._captures(self._pairer.add_depth(stamp, message), arrival_ns)
        return captures + self._left_out(arrival_ns)

    def poll(self, now_ns: int) -> list[Capture]:
        """What has waited long enough; to be called every few hundredths of a second."""
        wait = self._present_wait_ns()
        overdue = [s for s, arrival in self._arrivals.items() if now_ns - arrival >= wait]
        captures: list[Capture] = []
        if overdue:
            captures = self._captures(self._pairer.release(max(overdue)), now_ns)
        if self._held and self._waited_for_info(now_ns):
            captures = self._release_held(now_ns) + captures
        return captures

    def _present_wait_ns(self) -> int:
        if not self.depth_expected:
            return 0
        if self.fit.hopeless:
            return self._wait_ns if self._patient else 0
        return self._first_wait_ns

    def _left_out(self, now_ns: int) -> list[Capture]:
        """Colour images that need not wait: depth comes at a lower rate, and has none for them."""
        left = [] if self._patient else [s for s in self._arrivals if self.fit.leaves_out(s)]
        return self._captures(self._pairer.release(max(left)), now_ns) if left else []

    def _captures(self, pairs: list[Pair[Any, Any]], now_ns: int) -> list[Capture]:
        captures = []
        for pair in pairs:
            arrival = self._arrivals.pop(pair.stamp_ns, now_ns)
            if pair.depth is not None:
                self.fit.paired()
            elif self.fit.leaves_out(pair.stamp_ns):
                self._statistics.count('color_between_depth')
            else:
                self.fit.missed(pair.stamp_ns, arrival)
                self._statistics.count('color_without_depth')
            captures.append(Capture(pair.color, pair.depth, self._camera, now_ns))
        self._forget_lost()
        counts = self._pairer.counts
        for name, number in (
            ('late', counts.late),
            ('repeated', counts.duplicates),
            ('depth_without_color', counts.depth_alone),
        ):
            # The pairer counts from this activation on, the statistics all of them.
            self._statistics.count(name, number - self._counted[name])
            self._counted[name] = number
        if pairs:
            self._statistics.count('pairs', len(pairs))
        return self._hold(captures, now_ns) if self._holding else captures

    def _forget_lost(self) -> None:
        """Drop the arrivals of messages that the pairer did not keep (late, repeated)."""
        if len(self._arrivals) > self._pairer.waiting[0]:
            known = self._pairer.waiting_colors
            self._arrivals = {s: a for s, a in self._arrivals.items() if s in known}

    def _hold(self, captures: list[Capture], now_ns: int) -> list[Capture]:
        """Keep the first captures until there are intrinsics, as long as that is worth it."""
        if not captures:
            return captures
        if self._camera is not None or not (self.info_expected or self._patient):
            return self._release_held(now_ns) + captures
        if self._hold_from is None:
            self._hold_from = now_ns
        self._held.extend(captures)
        if self._waited_for_info(now_ns) or len(self._held) > self._most_held:
            return self._release_held(now_ns)
        return []

    def _waited_for_info(self, now_ns: int) -> bool:
        return self._hold_from is not None and now_ns - self._hold_from >= self._info_wait_ns

    def _release_held(self, now_ns: int) -> list[Capture]:
        self._holding = False
        held = [Capture(c.color, c.depth, self._camera, now_ns) for c in self._held]
        self._held.clear()
        return held
