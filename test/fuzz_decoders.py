# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Coverage-guided fuzzing of every image decoder and bag format with atheris.

``python test/fuzz_decoders.py -max_total_time=600`` (after ``pip install atheris``). Anything but a
sound image or one of the package's own errors stops it and leaves the input in ``crash-*``.
"""

from __future__ import annotations

import os
import struct
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import atheris  # type: ignore[import-not-found]
import numpy as np

with atheris.instrument_imports(include=['rgbd_kcf_tracker.recordings']):
    from rgbd_kcf_tracker.errors import ImageError, RgbdKcfError
    from rgbd_kcf_tracker.recordings import encoding, images, open_recording

FORMATS = ('', '16UC1; compressedDepth rvl', '32FC1; compressedDepth png', '32FC1', 'bgr8; jpeg')
ENCODINGS = (*images.COLOR_ENCODINGS, *images.DEPTH_ENCODINGS, 'bayer_rggb8')


def one_input(data: bytes) -> None:
    """Decode what the first byte asks for."""
    if len(data) < 2:
        return
    choice, body = data[0], data[1:]
    if choice < 128:
        message = SimpleNamespace(format=FORMATS[choice % len(FORMATS)], data=body)
        with suppress(ImageError):
            color = images.decode_compressed_color(message)
            assert color.dtype == np.uint8
            assert color.shape[2] == 3
        with suppress(ImageError):
            assert images.decode_compressed_depth(message).dtype == np.float32
    elif choice < 192 and len(body) > 12:
        height, width, step = struct.unpack_from('<iii', body)
        raw = SimpleNamespace(
            height=height,
            width=width,
            step=step,
            encoding=ENCODINGS[choice % len(ENCODINGS)],
            is_bigendian=choice & 1,
            data=body[12:],
        )
        for decode in (images.decode_color, images.decode_depth):
            with suppress(ImageError):
                assert decode(raw).shape[:2] == (height, width)
    else:
        path = SCRATCH / 'fuzz.bag'
        path.write_bytes(body)
        with suppress(RgbdKcfError), open_recording(path) as recording:
            for frame in recording.frames():
                frame.color.sum()


def seeds(folder: Path) -> None:
    """Good images and bags to begin with."""
    from bag_rig import camera_messages, make_frames, write_mcap, write_ros1

    frames = make_frames(2, (16, 12))
    color, depth = frames[0].color, frames[0].depth
    assert depth is not None
    packed = [encoding.encode_compressed_color(color, codec) for codec in ('jpeg', 'png')]
    packed += [encoding.encode_bare_depth(depth, codec) for codec in ('png', 'tiff')]
    packed += [
        encoding.encode_compressed_depth(depth, kind, codec)
        for kind in ('16UC1', '32FC1')
        for codec in ('png', 'rvl')
    ]
    bodies = [bytes([choice]) + p.data.tobytes() for p in packed for choice in range(len(FORMATS))]
    raw = encoding.encode_depth(depth)
    head = struct.pack('<iii', raw.height, raw.width, raw.step)
    bodies += [bytes([128 + n]) + head + raw.data.tobytes() for n in range(len(ENCODINGS))]
    sent = camera_messages(frames)
    for compression in ('none', 'lz4', 'zstd'):
        path = write_mcap(SCRATCH / f'{compression}.mcap', sent, compression)
        bodies.append(b'\xff' + path.read_bytes())
    bodies.append(b'\xff' + write_ros1(SCRATCH / 'a.bag', sent).read_bytes())
    for number, body in enumerate(bodies):
        (folder / f'seed{number}').write_bytes(body)


if __name__ == '__main__':
    with tempfile.TemporaryDirectory() as name:
        SCRATCH = Path(name)
        corpus = SCRATCH / 'corpus'
        corpus.mkdir()
        seeds(corpus)
        # The decoders' own complaints about damaged files.
        os.environ['OPENCV_LOG_LEVEL'] = 'OFF'
        atheris.Setup([*sys.argv, '-max_len=20000', '-rss_limit_mb=1500', str(corpus)], one_input)
        atheris.Fuzz()
