# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Every encoding there and back, and images that lie."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tracemalloc
import zlib
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rgbd_kcf_tracker import Frame
from rgbd_kcf_tracker.errors import ImageError
from rgbd_kcf_tracker.recordings import rvl
from rgbd_kcf_tracker.recordings.containers import MAX_PIXELS, inspect
from rgbd_kcf_tracker.recordings.encoding import (
    encode_bare_depth,
    encode_color,
    encode_compressed_color,
    encode_compressed_depth,
    encode_depth,
)
from rgbd_kcf_tracker.recordings.images import (
    decode_color,
    decode_compressed_color,
    decode_compressed_depth,
    decode_depth,
    defer_depth,
    metres_from_float,
    metres_from_mm,
)

FUZZ = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def picture(height: int = 37, width: int = 54) -> Any:
    return np.random.default_rng(5).integers(0, 256, (height, width, 3), np.uint8)


def smooth_picture() -> Any:
    """One that JPEG keeps."""
    y, x = np.mgrid[:64, :96]
    return np.stack([x * 2, y * 3, 255 - x - y], axis=2).astype(np.uint8)


def depth_image(height: int = 37, width: int = 54) -> Any:
    rng = np.random.default_rng(6)
    millimetres = rng.integers(300, 9000, (height, width)).astype(np.uint16)
    millimetres[rng.random((height, width)) < 0.3] = 0
    return metres_from_mm(millimetres)


def message(**fields: Any) -> SimpleNamespace:
    return SimpleNamespace(**fields)


def assert_same_depth(found: Any, expected: Any, tolerance: float = 0.0) -> None:
    assert found.dtype == np.float32
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    good = ~np.isnan(expected)
    assert np.abs(found[good] - expected[good]).max(initial=0) <= tolerance


# -- raw ---------------------------------------------------------------------------------------


@pytest.mark.parametrize('padding', [0, 5])
@pytest.mark.parametrize('encoding', ['bgr8', '8UC3', 'rgb8', 'bgra8', 'rgba8'])
def test_color_comes_back(encoding: str, padding: int) -> None:
    color = picture()
    assert np.array_equal(decode_color(encode_color(color, encoding, padding)), color)


@pytest.mark.parametrize('padding', [0, 3])
def test_mono_comes_back_grey(padding: int) -> None:
    grey = np.repeat(picture()[:, :, :1], 3, axis=2)
    found = decode_color(encode_color(grey, 'mono8', padding))
    assert np.array_equal(found, grey)


@pytest.mark.parametrize('encoding', ['yuv422', 'uyvy', 'yuyv', 'yuv422_yuy2'])
def test_yuv_grey_comes_back(encoding: str) -> None:
    luma = np.full((4, 6), 120, np.uint8)
    pixels = np.full((4, 6, 2), 128, np.uint8)
    pixels[:, :, 0 if encoding.startswith('yuyv') or encoding.endswith('yuy2') else 1] = luma
    msg = message(
        height=4, width=6, encoding=encoding, step=12, is_bigendian=0, data=pixels.tobytes()
    )
    found = decode_color(msg)
    assert found.shape == (4, 6, 3)
    assert np.ptp(found) == 0


@pytest.mark.parametrize('padding', [0, 2, 3])
@pytest.mark.parametrize('bigendian', [False, True])
@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
def test_depth_comes_back(encoding: str, bigendian: bool, padding: int) -> None:
    depth = depth_image()
    assert_same_depth(decode_depth(encode_depth(depth, encoding, bigendian, padding)), depth)


@pytest.mark.parametrize('kind', [bytes, bytearray, memoryview, list])
def test_any_kind_of_bytes_is_taken(kind: Any) -> None:
    packed = encode_depth(depth_image())
    raw = message(
        height=packed.height,
        width=packed.width,
        encoding='16UC1',
        step=packed.step,
        is_bigendian=0,
        data=kind(packed.data.tobytes()),
    )
    assert_same_depth(decode_depth(raw), depth_image())


def test_padding_may_be_missing_after_the_last_row() -> None:
    packed = encode_color(picture(), padding=5)
    short = message(
        height=packed.height,
        width=packed.width,
        encoding='bgr8',
        step=packed.step,
        is_bigendian=0,
        data=packed.data[:-5],
    )
    assert np.array_equal(decode_color(short), picture())


def test_no_reading_is_nan_and_every_millimetre_is_itself() -> None:
    values = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    metres = metres_from_mm(values)
    assert np.isnan(metres[0, 0])
    assert np.count_nonzero(np.isnan(metres)) == 1
    expected = values.astype(np.float32) * np.float32(0.001)
    assert np.array_equal(metres.reshape(-1)[1:], expected.reshape(-1)[1:])


def test_useless_floats_are_nan() -> None:
    values = np.array([[0, -1, np.inf, -np.inf, np.nan, 1e-3, 2.5, -0.0]], np.float32)
    found = metres_from_float(values)
    assert np.array_equal(np.isnan(found[0]), [1, 1, 1, 1, 1, 0, 0, 1])
    assert found[0, 5] == np.float32(1e-3)
    assert found[0, 6] == 2.5
    assert values[0, 0] == 0


def test_floats_that_millimetres_cannot_say_are_no_reading_and_counted() -> None:
    ends = metres_from_mm(np.array([[1, 65535]], np.uint16))
    values = np.array([[3e38, 1e12, 65.6, 1e-4, 1e-38, np.nan, 0, np.inf, -3, 2.5]], np.float32)
    counts: list[int] = []
    assert np.array_equal(metres_from_float(ends, counts.append), ends)
    assert np.isfinite(metres_from_float(values, counts.append)).tolist() == [9 * [False] + [True]]
    assert counts == [5]


@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_floats_of_every_origin_are_bounded() -> None:
    huge = np.full(depth_image().shape, 3e38, np.float32)
    tiff = cv2.imencode('.tiff', huge)[1].reshape(-1)
    body = encode_compressed_depth(depth_image(), '32FC1').data.tobytes()[12:]
    header = struct.pack('<iff', 1, 3e38, 0.5)
    counts: list[int] = []
    for depth in (
        decode_depth(encode_depth(huge, '32FC1'), refused=counts.append),
        decode_depth(encode_depth(huge, '32FC1', bigendian=True), refused=counts.append),
        decode_compressed_depth(message(format='', data=tiff), refused=counts.append),
        decode_compressed_depth(
            message(format='32FC1; compressedDepth png', data=header + body), refused=counts.append
        ),
    ):
        assert np.isnan(depth).all()
    assert len(counts) == 4
    assert counts[:3] == 3 * [huge.size]


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'encoding': 'bayer_rggb8'}, "unknown colour encoding 'bayer_rggb8'.*bgr8"),
        ({'height': 0}, 'no pixels'),
        ({'width': -4}, 'no pixels'),
        ({'width': 1 << 40}, 'claims'),
        ({'height': 60000, 'width': 60000, 'step': 180000}, 'claims'),
        ({'step': 10}, 'step 10: a row needs at least 162'),
        ({'step': 0}, 'step 0'),
        ({'height': 38}, 'cut off'),
        ({'data': b''}, 'cut off'),
    ],
)
def test_lying_colour_is_refused(change: dict[str, Any], words: str) -> None:
    packed = encode_color(picture())
    fields = {
        name: getattr(packed, name)
        for name in ('height', 'width', 'encoding', 'is_bigendian', 'step', 'data')
    }
    with pytest.raises(ImageError, match=words):
        decode_color(message(**(fields | change)))


def test_unknown_depth_encoding_says_what_is_known() -> None:
    packed = encode_color(picture())
    with pytest.raises(ImageError, match=r"unknown depth encoding 'bgr8'.*16UC1.*32FC1"):
        decode_depth(packed)


# -- compressed --------------------------------------------------------------------------------


def test_jpeg_comes_back_nearly() -> None:
    color = smooth_picture()
    found = decode_compressed_color(encode_compressed_color(color, 'jpeg', 95))
    assert np.abs(found.astype(int) - color).mean() < 4


def test_png_comes_back() -> None:
    assert np.array_equal(
        decode_compressed_color(encode_compressed_color(picture(), 'png')), picture()
    )


def test_grey_jpeg_and_png_become_three_channels() -> None:
    for suffix in ('.jpg', '.png'):
        data = cv2.imencode(suffix, smooth_picture()[:, :, 0])[1].reshape(-1)
        found = decode_compressed_color(message(format='mono8', data=data))
        assert found.shape == (64, 96, 3)


@pytest.mark.parametrize('codec', ['png', 'rvl'])
def test_compressed_depth_in_millimetres_comes_back(codec: str) -> None:
    packed = encode_compressed_depth(depth_image(), '16UC1', codec)
    assert packed.format == f'16UC1; compressedDepth {codec}'
    assert_same_depth(decode_compressed_depth(packed), depth_image())


@pytest.mark.parametrize('codec', ['png', 'rvl'])
def test_compressed_depth_in_floats_comes_back_to_its_resolution(codec: str) -> None:
    depth = depth_image()
    found = decode_compressed_depth(encode_compressed_depth(depth, '32FC1', codec))
    # One step of the inverse is z^2 / A metres: 8 mm at 9 m.
    assert_same_depth(found, depth, tolerance=0.005)


@pytest.mark.parametrize('text', ['16UC1; compressedDepth', '16UC1; compressedDepth png', ''])
def test_old_formats_without_a_codec_are_png(text: str) -> None:
    packed = encode_compressed_depth(depth_image())
    assert_same_depth(
        decode_compressed_depth(message(format=text, data=packed.data)), depth_image()
    )


@pytest.mark.parametrize('codec', ['png', 'tiff'])
@pytest.mark.parametrize('text', [None, '16UC1', ''])
def test_bare_depth_of_kinect2_bridge_comes_back(codec: str, text: str | None) -> None:
    packed = encode_bare_depth(depth_image(), codec)
    text = packed.format if text is None else text
    assert_same_depth(
        decode_compressed_depth(message(format=text, data=packed.data)), depth_image()
    )


def test_float_tiff_comes_back() -> None:
    depth = depth_image()
    data = cv2.imencode('.tiff', depth)[1].reshape(-1)
    assert_same_depth(decode_compressed_depth(message(format='32FC1; tiff', data=data)), depth)


def test_depth_as_jpeg_or_8_bit_is_refused() -> None:
    with pytest.raises(ImageError, match='JPEG, which spoils it'):
        decode_compressed_depth(encode_compressed_color(smooth_picture()))
    with pytest.raises(ImageError, match='3 channels of 8 bits'):
        decode_compressed_depth(encode_compressed_color(smooth_picture(), 'png'))
    with pytest.raises(ImageError, match='16 bits per channel'):
        decode_compressed_color(encode_bare_depth(depth_image(), 'png'))


def hostile_png(width: int, height: int, bits: int = 8, color: int = 2) -> bytes:
    """A well-formed PNG of under a hundred bytes that claims a size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
        )

    head = struct.pack('>IIBBBBB', width, height, bits, color, 0, 0, 0)
    return (
        b'\x89PNG\r\n\x1a\n'
        + chunk(b'IHDR', head)
        + chunk(b'IDAT', zlib.compress(b'\0' * 100))
        + chunk(b'IEND', b'')
    )


def hostile_jpeg(width: int, height: int) -> bytes:
    data = bytearray(cv2.imencode('.jpg', smooth_picture())[1].tobytes())
    at = data.index(b'\xff\xc0')
    data[at + 5 : at + 9] = struct.pack('>HH', height, width)
    return bytes(data)


def hostile_tiff(width: int, height: int, **tags: int) -> bytes:
    entries = {256: width, 257: height, 258: 16, 259: 1, 262: 1, 273: 8, 277: 1, 278: height}
    entries |= {int(k[1:]): v for k, v in tags.items()}
    body = b''.join(struct.pack('<HHII', tag, 4, 1, v) for tag, v in sorted(entries.items()))
    return b'II*\0' + struct.pack('<IH', 8, len(entries)) + body + b'\0\0\0\0'


@pytest.mark.parametrize('size', [(60000, 60000), (20000, 3000), (8000, 8000), (0, 5)])
def test_a_small_file_that_claims_a_large_image_takes_no_memory(size: tuple[int, int]) -> None:
    rvl_head = struct.pack('<iffII', 1, 0, 0, *size)
    cases = [
        (decode_compressed_color, 'jpeg', hostile_png(*size)),
        (decode_compressed_color, 'jpeg', hostile_jpeg(*size)),
        (decode_compressed_color, '', hostile_tiff(*size)),
        (decode_compressed_depth, '16UC1', hostile_png(*size, bits=16, color=0)),
        (decode_compressed_depth, '16UC1', hostile_tiff(*size)),
        (decode_compressed_depth, '16UC1; compressedDepth png', b'\0' * 12 + hostile_png(*size)),
    ]
    if size[0] * size[1] > MAX_PIXELS:
        cases.append((decode_compressed_depth, '16UC1; compressedDepth rvl', rvl_head))
    for decode, text, data in cases:
        tracemalloc.start()
        with pytest.raises(ImageError):
            decode(message(format=text, data=data))
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 4 << 20


def test_a_tiff_with_huge_tiles_is_refused() -> None:
    for tags in ({'t322': 1 << 30, 't323': 1 << 30}, {'t322': 60000, 't323': 60000}):
        with pytest.raises(ImageError):
            inspect(memoryview(hostile_tiff(64, 64, **tags)))


def test_a_jpeg_of_many_scans_is_refused() -> None:
    """Each scan of a progressive one goes through all of it: a second for some hundred bytes."""
    image = np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)
    options = [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]
    data = cv2.imencode('.jpg', image, options)[1].tobytes()
    assert decode_compressed_color(message(format='jpeg', data=data)).shape == image.shape
    scan = data[data.rindex(b'\xff\xda') : -2]
    with pytest.raises(ImageError, match='more than 100 scans'):
        inspect(memoryview(data[:-2] + 100 * scan + data[-2:]))


def test_a_png_with_a_huge_chunk_is_refused() -> None:
    """Found by fuzzing: OpenCV 5 allocates what the length of a chunk claims."""
    data = bytearray(encode_bare_depth(depth_image(), 'png').data.tobytes())
    at = data.index(b'IDAT')
    data[at - 4] = 0xFF
    with pytest.raises(ImageError, match='cut off'):
        decode_compressed_depth(message(format='16UC1; png compressed', data=bytes(data)))
    with pytest.raises(ImageError, match='cut off'):
        decode_compressed_color(message(format='png', data=bytes(data)))


def test_cut_off_images_are_refused() -> None:
    for packed, decode in (
        (encode_compressed_color(picture()), decode_compressed_color),
        (encode_compressed_color(picture(), 'png'), decode_compressed_color),
        (encode_bare_depth(depth_image(), 'png'), decode_compressed_depth),
        (encode_bare_depth(depth_image(), 'tiff'), decode_compressed_depth),
        (encode_compressed_depth(depth_image(), codec='png'), decode_compressed_depth),
        (encode_compressed_depth(depth_image(), codec='rvl'), decode_compressed_depth),
    ):
        for part in (0, 3, 11, 20, len(packed.data) // 2, len(packed.data) - 12):
            with pytest.raises(ImageError):
                decode(message(format=packed.format, data=packed.data[:part]))


def test_inverse_depth_with_impossible_parameters_is_refused() -> None:
    body = encode_compressed_depth(depth_image(), '32FC1').data.tobytes()[12:]
    for a, b in ((0, 0), (-1, 1), (float('nan'), 1), (1, float('inf'))):
        data = struct.pack('<iff', 1, a, b) + body
        with pytest.raises(ImageError, match='A='):
            decode_compressed_depth(message(format='32FC1; compressedDepth png', data=data))


# -- RVL ---------------------------------------------------------------------------------------


def slow_rvl_decode(data: bytes) -> Any:
    """The codec as its paper words it, number by number."""
    width, height = struct.unpack_from('<II', data)
    words = struct.unpack_from(f'<{(len(data) - 8) // 4}I', data, 8)
    nibbles = [(word >> shift) & 15 for word in words for shift in range(28, -1, -4)]
    at = 0

    def number() -> int:
        nonlocal at
        value = shift = 0
        while True:
            nibble = nibbles[at]
            at += 1
            value |= (nibble & 7) << shift
            shift += 3
            if not nibble & 8:
                return value

    out: list[int] = []
    previous = 0
    while len(out) < width * height:
        out += [0] * number()
        for _ in range(number() if at < len(nibbles) else 0):
            coded = number()
            previous += (coded >> 1) ^ -(coded & 1)
            out.append(previous)
    return np.array(out, np.uint16).reshape(height, width)


@FUZZ
@given(
    st.integers(1, 12),
    st.integers(1, 12),
    st.integers(0, 2**32 - 1),
    st.floats(0, 1),
    st.booleans(),
)
def test_rvl_is_lossless(height: int, width: int, seed: int, holes: float, far: bool) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 65536 if far else 3000, (height, width)).astype(np.uint16)
    image[rng.random(image.shape) < holes] = 0
    data = rvl.encode(image)
    assert np.array_equal(rvl.decode(memoryview(data)), image)
    assert np.array_equal(slow_rvl_decode(data), image)


@pytest.mark.timeout(20)
def test_rvl_that_makes_no_progress_ends() -> None:
    data = struct.pack('<II', 4000, 4000) + b'\0' * 4_000_000
    with pytest.raises(ImageError, match='damaged'):
        rvl.decode(memoryview(data))


# -- fuzz --------------------------------------------------------------------------------------

SEEDS = [
    encode_compressed_color(smooth_picture()).data.tobytes(),
    encode_compressed_color(picture(), 'png').data.tobytes(),
    encode_bare_depth(depth_image(), 'png').data.tobytes(),
    encode_bare_depth(depth_image(), 'tiff').data.tobytes(),
    encode_compressed_depth(depth_image(), '16UC1', 'png').data.tobytes(),
    encode_compressed_depth(depth_image(), '32FC1', 'rvl').data.tobytes(),
    hostile_png(64, 64),
    hostile_tiff(64, 64),
]
FORMATS = st.sampled_from(
    ['', '16UC1', '32FC1; compressedDepth png', '16UC1; compressedDepth rvl', 'bgr8; jpeg', '💥;;']
)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Bytes at random, or a good image with some bytes changed, taken out or cut off."""
    if draw(st.integers(0, 4)) == 0:
        return draw(st.binary(max_size=200))
    data = bytearray(draw(st.sampled_from(SEEDS)))
    for _ in range(draw(st.integers(0, 6))):
        # Most that matters stands in the first bytes.
        at = draw(st.integers(0, min(len(data), 200) - 1 if draw(st.booleans()) else len(data) - 1))
        data[at] = draw(st.integers(0, 255))
    if draw(st.booleans()):
        del data[draw(st.integers(0, len(data))) :]
    return bytes(data)


@FUZZ
@given(damaged(), FORMATS)
def test_compressed_decoders_give_an_image_or_say_why_not(data: bytes, text: str) -> None:
    msg = message(format=text, data=data)
    with suppress(ImageError):
        color = decode_compressed_color(msg)
        assert color.dtype == np.uint8
        assert color.ndim == 3
        assert color.shape[2] == 3
    with suppress(ImageError):
        depth = decode_compressed_depth(msg)
        assert depth.dtype == np.float32
        assert depth.ndim == 2
        assert not np.any(depth <= 0)


SIZES = st.one_of(
    st.integers(-3, 40), st.sampled_from([1 << 16, 1 << 31, (1 << 32) - 1, -(1 << 31)])
)


@FUZZ
@given(
    SIZES,
    SIZES,
    SIZES,
    st.sampled_from(
        ['bgr8', 'rgba8', 'mono8', 'yuv422', '16UC1', '32FC1', 'mono16', 'bayer', '', '\0']
    ),
    st.integers(0, 255),
    st.binary(max_size=4000),
)
def test_raw_decoders_give_an_image_or_say_why_not(
    height: int, width: int, step: int, encoding: str, bigendian: int, data: bytes
) -> None:
    msg = message(
        height=height, width=width, step=step, encoding=encoding, is_bigendian=bigendian, data=data
    )
    for decode, channels in ((decode_color, (3,)), (decode_depth, ())):
        with suppress(ImageError):
            image = decode(msg)
            assert image.shape == (height, width, *channels)
            image.sum()  # reads every byte: a view past the end would crash


def test_coverage_guided_fuzzing(tmp_path: Path) -> None:
    """A short run; ``python test/fuzz_decoders.py`` runs for as long as one likes."""
    pytest.importorskip('atheris', reason='pip install atheris to fuzz with coverage')
    script = Path(__file__).with_name('fuzz_decoders.py')
    done = subprocess.run(
        [sys.executable, str(script), '-max_total_time=5', '-seed=1'],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {'PYTHONPATH': os.pathsep.join([str(script.parent), *sys.path])},
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
@pytest.mark.parametrize('big', [False, True])
def test_deferred_depth_is_the_same_wherever_it_is_looked_at(encoding: str, big: bool) -> None:
    rng = np.random.default_rng(3)
    values = rng.integers(0, 4, (30, 44)) * rng.integers(0, 2000, (30, 44))
    kind = ('>' if big else '<') + {'16UC1': 'u2', '32FC1': 'f4'}[encoding]
    padded = np.zeros((30, 50), kind)
    padded[:, :44] = values if encoding == '16UC1' else values / 1000
    msg = message(
        height=30, width=44, encoding=encoding, step=padded.strides[0], is_bigendian=big,
        data=padded.tobytes(),
    )  # fmt: skip
    whole = decode_depth(msg)
    assert type(whole) is np.ndarray
    assert whole.dtype == np.float32
    deferred = defer_depth(msg)
    assert not isinstance(deferred, np.ndarray)
    assert (deferred.shape, deferred.ndim, deferred.dtype, len(deferred)) == (
        (30, 44), 2, np.float32, 30
    )  # fmt: skip
    rows, cols = rng.integers(0, 30, (5, 1)), rng.integers(0, 44, 6)
    keys = (slice(4, None, 8), slice(4, None, 8)), (rows, cols), (slice(3, 9), slice(None)), (7, 8)
    for key in keys:
        np.testing.assert_array_equal(deferred[key], whole[key])
    part = deferred[2:4, 2:4]
    part[:] = 9  # memory of its own
    np.testing.assert_array_equal(np.asarray(deferred), whole)
    np.testing.assert_array_equal(np.asarray(deferred, np.float64), whole.astype(np.float64))
    np.testing.assert_array_equal(deferred > 1, whole > 1)
    np.testing.assert_array_equal(2 * deferred, 2 * whole)
    np.testing.assert_array_equal(np.isfinite(deferred), np.isfinite(whole))
    assert np.nanmean(deferred) == np.nanmean(whole)
    Frame(np.zeros((30, 44, 3), np.uint8), deferred)
    with pytest.raises(ImageError, match='register'):
        Frame(np.zeros((30, 45, 3), np.uint8), deferred)
