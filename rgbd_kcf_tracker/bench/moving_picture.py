# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The short moving picture of the README: an occlusion and the return, simulated.

python -m rgbd_kcf_tracker.bench.moving_picture docs/occlusion.gif --overwrite
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.cli.common import add_overwrite_option
from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import draw_track
from rgbd_kcf_tracker.recordings.outputs import check_outputs, write_file
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, create_tracker
from rgbd_kcf_tracker.view.showing import depth_picture
from rgbd_kcf_tracker.view.sources import SimulatedRecording, first_box

SCENARIO, SEED, RATE_HZ = 'occlusion', 3, 15.0
WIDTH = 320
"""Columns of each of the two pictures, colour and depth."""
EVERY = 3
"""Tracked at 15 Hz, shown at 5: a third of the bytes."""
COLORS = 64
LINE = 2
"""Pixels by which the box is drawn larger: in so small a picture the line would hide the target."""

Picture = npt.NDArray[np.uint8]


def pictures(first: int, last: int) -> Iterator[Picture]:
    """Colour with what the tracker says, beside depth, from one frame to another."""
    recording = SimulatedRecording(SCENARIO, SEED, RATE_HZ)
    start, box = first_box(recording, None)
    tracker = create_tracker(DEFAULT_VARIANT)
    for number, frame in enumerate(recording.frames(start, last), start=start):
        track = tracker.start(frame, box) if number == start else tracker.update(frame)
        if number < first or (number - first) % EVERY:
            continue
        assert frame.depth is not None
        height = round(WIDTH * frame.height / frame.width)
        small = cv2.resize(frame.color, (WIDTH, height), interpolation=cv2.INTER_AREA)
        scale = WIDTH / frame.width
        shown = track.box
        if shown is not None:
            x, y, width, tall = (side * scale for side in shown.as_tuple())
            shown = Box(x - LINE, y - LINE, width + 2 * LINE, tall + 2 * LINE)
        # The sensor's noise would be most of the bytes.
        small = cv2.medianBlur(small, 3)
        drawn = draw_track(small, type(track)(shown, track.state, track.score, track.depth))
        depth = cv2.medianBlur(depth_picture(frame.depth, WIDTH)[0], 3)
        yield np.hstack((drawn, depth[:height]))


def main(args: list[str] | None = None) -> int:
    """Write the file."""
    import imageio_ffmpeg

    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('dest', type=Path, help='the .gif file')
    parser.add_argument('--first', type=int, default=14, help='frame to begin with')
    parser.add_argument('--last', type=int, default=84, help='frame to stop before')
    add_overwrite_option(parser, 'the file if it is there')
    options = parser.parse_args(args)
    if not 0 <= options.first < options.last:
        parser.error('--first must be 0 or more, and --last above it')
    try:
        check_outputs({'dest': options.dest}, overwrite=options.overwrite)
    except RecordingError as error:
        parser.error(str(error))
    frames = list(pictures(options.first, options.last))
    if not frames:
        parser.error(f'the scene ends before --first {options.first}')
    height, width = frames[0].shape[:2]
    palette = (
        f'split[a][b];[a]palettegen=max_colors={COLORS}:stats_mode=diff[p];'
        '[b][p]paletteuse=dither=none:diff_mode=rectangle'
    )
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(), '-loglevel', 'error', '-f', 'rawvideo',
        '-pix_fmt', 'bgr24', '-s', f'{width}x{height}', '-r', str(RATE_HZ / EVERY), '-i', '-',
        '-filter_complex', palette, '-loop', '0', '-f', 'gif', '-',
    ]  # fmt: skip
    raw = b''.join(frame.tobytes() for frame in frames)
    result = subprocess.run(command, input=raw, stdout=subprocess.PIPE, check=False)
    if result.returncode == 0:
        try:
            write_file(options.dest, result.stdout, options.overwrite)
        except RecordingError as error:
            parser.error(str(error))
        print(f'{options.dest}: {len(frames)} pictures, {len(result.stdout) / 1000:.0f} kB')
    return result.returncode


if __name__ == '__main__':
    sys.exit(main())
