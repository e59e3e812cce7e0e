# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Where in a room one can stand, and the shortest way between two places around the furniture."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Footprint:
    """What stands on the floor, as an upright rectangle in metres: x to the right, z forward."""

    x0: float
    z0: float
    x1: float
    z1: float

    def grown(self, by: float) -> Footprint:
        """Larger by a margin on each side."""
        return Footprint(self.x0 - by, self.z0 - by, self.x1 + by, self.z1 + by)

    def holds(self, x: float, z: float) -> bool:
        """Whether a point lies inside."""
        return self.x0 < x < self.x1 and self.z0 < z < self.z1

    def meets(self, other: Footprint) -> bool:
        """Whether two rectangles overlap."""
        return (self.x0 < other.x1 and other.x0 < self.x1
                and self.z0 < other.z1 and other.z0 < self.z1)  # fmt: skip

    def cut_by(self, a: Point, b: Point) -> bool:
        """Whether a straight way leads through the inside."""
        enter, leave = 0.0, 1.0
        for start, way, low, high in (
            (a[0], b[0] - a[0], self.x0, self.x1), (a[1], b[1] - a[1], self.z0, self.z1),
        ):  # fmt: skip
            if abs(way) < 1e-12:
                if not low < start < high:
                    return False
                continue
            first, last = sorted(((low - start) / way, (high - start) / way))
            enter, leave = max(enter, first), min(leave, last)
        return leave - enter > 1e-9

    def pushed_out(self, x: float, z: float) -> Point:
        """The nearest point on the border, for a point inside."""
        gaps = (x - self.x0, self.x1 - x, z - self.z0, self.z1 - z)
        nearest = gaps.index(min(gaps))
        return ((self.x0, z), (self.x1, z), (x, self.z0), (x, self.z1))[nearest]


@dataclass
class FloorPlan:
    """The footprints that nobody walks through.

    Attributes:
        footprints: of walls and furniture.
        reach: how far a walker's middle stays from them, metres.
    """

    footprints: list[Footprint] = field(default_factory=list)
    reach: float = 0.3

    def free(self, x: float, z: float, margin: float | None = None) -> bool:
        """Whether somebody can stand there."""
        margin = self.reach if margin is None else margin
        return not any(f.grown(margin).holds(x, z) for f in self.footprints)

    def way(self, start: Point, end: Point) -> list[Point]:
        """The corners of the shortest way, ``end`` included; straight where there is none."""
        walls = [f.grown(self.reach) for f in self.footprints]

        def open_between(a: Point, b: Point) -> bool:
            return not any(w.cut_by(a, b) for w in walls if not (w.holds(*a) or w.holds(*b)))

        if open_between(start, end):
            return [end]
        nodes = [start, end]
        for f in self.footprints:
            f = f.grown(self.reach + 0.05)
            corners = ((f.x0, f.z0), (f.x0, f.z1), (f.x1, f.z0), (f.x1, f.z1))
            nodes += [c for c in corners if not any(w.holds(*c) for w in walls)]
        return _shortest(nodes, open_between) or [end]


def _shortest(nodes: list[Point], open_between: Callable[[Point, Point], bool]) -> list[Point]:
    """The way from the first node to the second, without the first; empty where there is none."""
    best: dict[int, float] = {0: 0.0}
    before: dict[int, int] = {}
    heap = [(0.0, 0)]
    done: set[int] = set()
    while heap:
        length, i = heapq.heappop(heap)
        if i in done:
            continue
        done.add(i)
        if i == 1:
            way = [1]
            while way[-1] in before:
                way.append(before[way[-1]])
            return [nodes[k] for k in way[-2::-1]]
        for j, node in enumerate(nodes):
            if j in done:
                continue
            total = length + math.dist(nodes[i], node)
            if total < best.get(j, math.inf) and open_between(nodes[i], node):
                best[j], before[j] = total, i
                heapq.heappush(heap, (total, j))
    return []


def footprint(points: Iterable[Point]) -> Footprint:
    """The rectangle around points."""
    xs, zs = zip(*points, strict=True)
    return Footprint(min(xs), min(zs), max(xs), max(zs))
