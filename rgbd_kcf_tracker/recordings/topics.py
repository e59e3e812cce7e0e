# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Which topics of a bag are the camera: known cameras by their names, others by what they hold."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.recording import NO_DEPTH

_TRANSPORTS = ('/compressedDepth', '/compressed', '/theora', '/ffmpeg', '/zstd')

# Names of one camera's colour and depth under a common prefix, best first: kinect2_bridge,
# RealSense, Orbbec and this package, Azure Kinect, OpenNI and its kin, one image pair.
_LAYOUTS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (('/image_color_rect', '/image_color'), ('/image_depth_rect', '/image_depth')),
    (
        ('/color/image_raw', '/color/image_rect_raw', '/color/image_rect', '/color/image'),
        (
            '/aligned_depth_to_color/image_raw',
            '/aligned_depth_to_color/image',
            '/depth_to_color/image_raw',
            '/depth_registered/image_raw',
            '/depth/image_raw',
            '/depth/image_rect_raw',
            '/depth/image_rect',
            '/depth/image',
        ),
    ),
    (
        (
            '/rgb/image_rect_color',
            '/rgb/image_rect',
            '/rgb/image_color',
            '/rgb/image_raw',
            '/rgb/image',
        ),
        (
            '/depth_to_rgb/image_raw',
            '/depth_to_rgb/hw_registered/image_rect',
            '/depth_registered/hw_registered/image_rect_raw',
            '/depth_registered/hw_registered/image_rect',
            '/depth_registered/image_rect',
            '/depth_registered/image_raw',
            '/depth_registered/image',
            '/depth_registered/sw_registered/image_rect_raw',
            '/depth/image_rect_raw',
            '/depth/image_rect',
            '/depth/image_raw',
            '/depth/image',
        ),
    ),
)
_ASIDE = re.compile(
    r'(^|[/_])(ir|infra\d*|infrared|mono|mask|label|confidence|annotated|image_annotated|debug|'
    r'disparity|heatmap)([/_]|$)'
)


@dataclass(frozen=True, slots=True)
class ImageTopic:
    """A topic of images, as far as its first message tells.

    Attributes:
        name: of the topic.
        role: 'color' or 'depth' by what the message holds, or by name where that is not known;
            '' where it is of no use.
        size: ``(width, height)`` where known.
        encoding: for people.
    """

    name: str
    role: str
    size: tuple[int, int] | None = None
    encoding: str = ''

    @property
    def base(self) -> str:
        """Name without the transport."""
        return base_name(self.name)


class SameTopicError(RecordingError):
    """One topic would be both colour and depth."""


@dataclass(frozen=True, slots=True)
class ChosenTopics:
    """Names of the topics to read; ``depth`` None for colour alone, ``info`` None where none is."""

    color: str
    depth: str | None
    info: str | None


def base_name(topic: str) -> str:
    """``topic`` without the suffix that its transport adds."""
    for suffix in _TRANSPORTS:
        if topic.endswith(suffix):
            return topic[: -len(suffix)]
    return topic


def choose_topics(
    images: Sequence[ImageTopic],
    infos: Sequence[str],
    described: Mapping[str, str],
    where: str,
    color: str | None = None,
    depth: str | None = None,
    info: str | None = None,
) -> ChosenTopics:
    """Find the camera's topics, or check those that are named.

    Args:
        images: all image topics with messages.
        infos: all CameraInfo topics with messages.
        described: every topic of the bag with a few words, for errors.
        where: the bag, for errors.
        color: name of the colour topic, None to find it.
        depth: name of the depth topic, None to find it, 'none' for colour alone; None is that, too,
            where nothing was recorded that may be depth.
        info: name of the CameraInfo topic, None to find it.

    Raises:
        RecordingError: where a named topic is not there, nothing fits, or more than one thing does,
            or one topic would be both.
    """
    finder = _Finder(images, described, where)
    if depth == NO_DEPTH or (depth is None and finder.has_no_depth()):
        chosen_color = finder.named(color, 'color') if color else finder.only_color()
        chosen_depth = None
    else:
        colors = [finder.named(color, 'color')] if color else finder.candidates('color')
        depths = [finder.named(depth, 'depth')] if depth else finder.candidates('depth')
        chosen_color, chosen_depth = finder.pair(colors, depths)
        if chosen_color == chosen_depth:
            raise SameTopicError(
                f'{where}: {chosen_color} cannot be both colour and depth: give another as '
                f'--color-topic or as --depth-topic. {finder.listing()}'
            )
    return ChosenTopics(chosen_color, chosen_depth, finder.info(info, infos, chosen_color))


class _Finder:
    def __init__(
        self, images: Sequence[ImageTopic], described: Mapping[str, str], where: str
    ) -> None:
        self.images = {i.name: i for i in images}
        self.described = described
        self.where = where

    def named(self, name: str, role: str) -> str:
        name = name if name.startswith('/') or name in self.images else '/' + name
        for candidate in (name, *(name + suffix for suffix in _TRANSPORTS)):
            if candidate in self.images:
                return candidate
        option = f'--{role}-topic'
        if name in self.described:
            raise RecordingError(
                f'{self.where}: {name} ({self.described[name]}) holds no images: '
                f'give another topic as {option}. {self.listing()}'
            )
        raise RecordingError(
            f'{self.where} has no topic {name}: give another as {option}. {self.listing()}'
        )

    def candidates(self, role: str) -> list[str]:
        """Topics of a role, one transport each; those on the side only if there is no other."""
        best: dict[str, str] = {}
        for name, image in self.images.items():
            if image.role != role:
                continue
            other = best.get(image.base)
            if other is None or _transport_rank(name) < _transport_rank(other):
                best[image.base] = name
        found = list(best.values())
        straight = [n for n in found if not _ASIDE.search(base_name(n))]
        found = straight or found
        if found:
            return found
        word, option = ('colour', 'color') if role == 'color' else ('depth', 'depth')
        extra = ', or --depth-topic none to read colour alone' if role == 'depth' else ''
        raise RecordingError(
            f'{self.where} has no {word} topic (a sensor_msgs/Image or CompressedImage with '
            f'messages): name one with --{option}-topic{extra}. {self.listing()}'
        )

    def has_no_depth(self) -> bool:
        """Whether no topic holds depth, or is called so and holds nothing or what is not read."""
        return all(i.role != 'depth' for i in self.images.values()) and not any(
            'depth' in name.lower() for name in self.described
        )

    def only_color(self) -> str:
        colors = self.candidates('color')
        if len(colors) == 1:
            return colors[0]
        laid_out = {n: rank for n in colors if (rank := _color_rank(n)) is not None}
        prefixes = {prefix for prefix, _ in laid_out.values()}
        if len(prefixes) == 1:
            return min(laid_out, key=lambda n: laid_out[n][1])
        raise self.ambiguous('colour', colors)

    def pair(self, colors: list[str], depths: list[str]) -> tuple[str, str]:
        if len(colors) == 1 and len(depths) == 1:
            return colors[0], depths[0]
        cameras: dict[str, tuple[int, str, str]] = {}
        for color in colors:
            for depth in depths:
                match = _layout_match(base_name(color), base_name(depth))
                if match is None:
                    continue
                prefix, rank = match
                if prefix not in cameras or rank < cameras[prefix][0]:
                    cameras[prefix] = (rank, color, depth)
        if len(cameras) == 1:
            _, color, depth = next(iter(cameras.values()))
            return color, depth
        if cameras:
            pairs = [(color, depth) for _, color, depth in cameras.values()]
            raise self.several_cameras(pairs)
        sized = [
            (c, d)
            for c in colors
            for d in depths
            if self.images[c].size is not None and self.images[c].size == self.images[d].size
        ]
        if len(sized) == 1:
            return sized[0]
        if len(colors) > 1:
            raise self.ambiguous('colour', colors)
        raise self.ambiguous('depth', depths)

    def info(self, named: str | None, infos: Sequence[str], color: str) -> str | None:
        if named is not None:
            name = named if named.startswith('/') or named in infos else '/' + named
            if name not in infos:
                raise RecordingError(
                    f'{self.where} has no CameraInfo topic {name} with messages: '
                    f'give another as --info-topic. {self.listing()}'
                )
            return name
        beside = base_name(color).rpartition('/')[0] + '/camera_info'
        if beside in infos:
            return beside
        near = [i for i in infos if 'depth' not in i and not _ASIDE.search(i)]
        return near[0] if len(near) == 1 else None

    def ambiguous(self, word: str, names: list[str]) -> RecordingError:
        option = 'color' if word == 'colour' else 'depth'
        return RecordingError(
            f'{self.where} has {len(names)} {word} topics that fit: {", ".join(names)}. '
            f'Choose one, for instance --{option}-topic {names[0]}'
        )

    def several_cameras(self, pairs: list[tuple[str, str]]) -> RecordingError:
        text = '; '.join(f'{c} with {d}' for c, d in pairs)
        color, depth = pairs[0]
        return RecordingError(
            f'{self.where} holds {len(pairs)} cameras: {text}. '
            f'Choose one, for instance --color-topic {color} --depth-topic {depth}'
        )

    def listing(self) -> str:
        if not self.described:
            return 'It has no topics at all'
        return 'Its topics: ' + ', '.join(f'{n} ({text})' for n, text in self.described.items())


def _transport_rank(name: str) -> int:
    order = {'': 0, '/compressedDepth': 1, '/compressed': 2}
    return order.get(name[len(base_name(name)) :], 3)


def _layout_match(color: str, depth: str) -> tuple[str, int] | None:
    """Common prefix and rank (small is good) where the two are one camera's names."""
    best: tuple[str, int] | None = None
    for colors, depths in _LAYOUTS:
        for i, color_suffix in enumerate(colors):
            if not color.endswith(color_suffix):
                continue
            prefix = color[: -len(color_suffix)]
            for j, depth_suffix in enumerate(depths):
                rank = i * 100 + j
                if depth == prefix + depth_suffix and (best is None or rank < best[1]):
                    best = prefix, rank
    return best


def _color_rank(color: str) -> tuple[str, int] | None:
    for colors, _ in _LAYOUTS:
        for i, suffix in enumerate(colors):
            if base_name(color).endswith(suffix):
                return base_name(color)[: -len(suffix)], i
    return None
