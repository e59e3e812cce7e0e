# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Frames from image files: numbered pictures in a folder, and depth of the same names beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rgbd_kcf_tracker.errors import ImageError, RecordingError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Intrinsics
from rgbd_kcf_tracker.recordings.containers import (
    MAX_PIXELS,
    MAX_SIDE,
    PNG,
    Container,
    inspect,
    sniff,
)
from rgbd_kcf_tracker.recordings.files import MAX_IMAGE, listing, read_file
from rgbd_kcf_tracker.recordings.images import (
    COMPRESSED_DEPTH_HEADER,
    DepthImage,
    EncodingError,
    Refused,
    decode_color_bytes,
    decode_depth_bytes,
)
from rgbd_kcf_tracker.recordings.recording import WITHOUT_DEPTH
from rgbd_kcf_tracker.recordings.refused import RefusedReadings
from rgbd_kcf_tracker.recordings.textfiles import natural_key

IMAGE_SUFFIXES = frozenset({'.png', '.jpg', '.jpeg', '.tif', '.tiff'})


def image_files(folder: Path) -> tuple[Path, ...]:
    """The images in a folder in the order of their numbers, without hidden files.

    Raises:
        RecordingError: where the folder cannot be read or holds no image.
    """
    found = [p for p in listing(folder) if p.suffix.lower() in IMAGE_SUFFIXES]
    if not found:
        raise RecordingError(f'{folder} holds no images (PNG, JPEG or TIFF)')
    return tuple(sorted(found, key=lambda p: natural_key(p.name)))


def head_of(image: Path) -> Container:
    """What an image file states in its head, whatever its size.

    Raises:
        ImageError: where it is no image.
    """
    return inspect(memoryview(read_file(image, MAX_IMAGE)), MAX_SIDE**2)


def size_of(image: Path) -> tuple[int, int] | None:
    """Width and height that an image file states in its head; None where it is none."""
    try:
        head = head_of(image)
    except ImageError:
        return None
    return head.width, head.height


def missing_number(images: Sequence[Path], lines: int) -> Path | None:
    """The first file that the images' numbering leaves out; None where that cannot be told.

    Args:
        images: in the order of their numbers.
        lines: of a text file with a line for each that there should be.
    """
    if not images or not all(p.stem.isdecimal() for p in images):
        return None
    numbers = [int(p.stem) for p in images]
    first = images[0]
    if 1 < numbers[0] == lines - len(images) + 1:  # what is missing is the beginning
        return first.with_name(f'{1:0{len(first.stem)}d}{first.suffix}')
    for path, before, after in zip(images, numbers, numbers[1:], strict=False):
        if after != before + 1:
            return path.with_name(f'{before + 1:0{len(path.stem)}d}{path.suffix}')
    return None


def unnumbered(images: Sequence[Path]) -> str:
    """Which file has no number in its name where others have one, so that its place is unknown.

    In words, '' where none is such.
    """
    lost = [p for p in images if not any(c.isdecimal() for c in p.stem)]
    if 0 < len(lost) < len(images):
        return f'{lost[0]} has no number in its name, as other images there have'
    return ''


def depths_beside(colors: Iterable[Path], folder: Path) -> tuple[Path | None, ...]:
    """The depth image of each colour image, which has its name but for the suffix; None: none.

    Raises:
        RecordingError: as :func:`image_files`.
    """
    by_stem = {path.stem: path for path in image_files(folder)}
    return tuple(by_stem.get(path.stem) for path in colors)


def even_stamps(count: int, fps: float) -> tuple[int, ...]:
    """Stamps in nanoseconds of ``count`` frames at ``fps``, from 0."""
    return tuple(round(i * 1e9 / fps) for i in range(count))


def metres(data: memoryview, max_pixels: int, refused: Refused | None = None) -> DepthImage:
    """The depth in an image file as we write it.

    Args:
        data: all bytes of the file.
        max_pixels: of the largest image that is read.
        refused: is told how many numbers in it are no readings, if any are.

    Returns:
        ``(H, W)`` float32 metres, NaN where there is no reading.

    Raises:
        ImageError: where it is no image, or one of a kind that is not depth.
    """
    if not sniff(data) and sniff(data[COMPRESSED_DEPTH_HEADER.size :]) != PNG:
        inspect(data, max_pixels)  # no file: else damage would be read as RVL, which has no mark
    return decode_depth_bytes(data, max_pixels=max_pixels, refused=refused)


@dataclass(frozen=True, slots=True)
class ImageFrames:
    """Frames from image files.

    Attributes:
        colors: one file per frame.
        depths: the same, None where a frame has no depth; empty where none has.
        stamps_ns: one per frame.
        intrinsics: of the colour camera.
        max_pixels: of the largest image that is read.
        read_depth: makes metres of a depth file's bytes; see :func:`metres`.
    """

    colors: tuple[Path, ...]
    depths: tuple[Path | None, ...]
    stamps_ns: tuple[int, ...]
    intrinsics: Intrinsics | None = None
    max_pixels: int = MAX_PIXELS
    read_depth: Callable[[memoryview, int, Refused | None], DepthImage] = metres

    def __len__(self) -> int:
        return len(self.colors)

    def frame(
        self,
        index: int,
        broken: Callable[[str], None] | None = None,
        odd: RefusedReadings | None = None,
    ) -> Frame:
        """Frame ``index``.

        Args:
            index: from 0.
            broken: is told of a depth file that cannot be decoded, and the frame comes without;
                None: that is an error too.
            odd: counts what depth files hold that is no reading.

        Raises:
            RecordingError: for a file that cannot be read.
            ImageError: for one that is no image or does not fit, naming it.
        """
        color_path = self.colors[index]
        depth_path = self.depths[index] if self.depths else None
        color_data = memoryview(read_file(color_path, MAX_IMAGE))
        try:
            color = decode_color_bytes(color_data, self.max_pixels)
        except ImageError as error:
            raise ImageError(f'{color_path}: {error}') from None
        depth: DepthImage | None = None
        try:
            if depth_path is not None:
                depth = self._depth(depth_path, broken, odd)
            return Frame(color, depth, self.stamps_ns[index], self.intrinsics)
        except ImageError as error:
            raise ImageError(f'{depth_path or color_path}: {error}') from None

    def _depth(
        self, path: Path, broken: Callable[[str], None] | None, odd: RefusedReadings | None
    ) -> DepthImage | None:
        data = memoryview(read_file(path, MAX_IMAGE))
        try:
            refused = None if odd is None else odd.of(str(path))
            return self.read_depth(data, self.max_pixels, refused)
        except EncodingError:
            raise
        except ImageError as error:
            if broken is None:
                raise
            broken(f'{path}: {error}; the frame is {WITHOUT_DEPTH}')
            return None
