# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What a Kinect V2 makes of a scene: colour noise and softness, and depth with its many flaws.

The depth camera has 512 x 424 pixels and a focal length of about 365 pixels: it is coarser than the
colour image it is registered to. Its noise grows with the square of the distance (about 2 mm at
1 m, 20 mm at 4 m), pixels at edges mix two surfaces or fall out, what is black returns too little
light, and the background that the depth camera cannot see past a nearer body, because it sits 52 mm
beside the colour camera, has no reading.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rgbd_kcf_tracker.arrays import Floats
from rgbd_kcf_tracker.geometry import Intrinsics

DEPTH_FOCAL = 365.0
BASELINE = 0.052
HALF_ANGLE = np.radians(35.3)
_NEAREST = cv2.INTER_NEAREST_EXACT  # INTER_NEAREST would move depth by a pixel or two


@dataclass(frozen=True)
class SensorOptions:
    """What is wrong with this camera.

    Attributes:
        color_noise: standard deviation in grey levels.
        softness: standard deviation of the blur in pixels at qhd.
        depth_noise: factor on the depth noise.
        holes: share of pixels in random holes.
        shift: registration error in pixels of the colour image, right and down.
        delay_s: how much later the depth is taken than the colour.
        narrow: the depth camera's field of view leaves strips without depth at the sides.
        has_depth: False for a camera without depth.
        no_target_depth: seconds ``(from, to)`` in which the target gives no reading.
        exposure_s: of the colour image.
    """

    color_noise: float = 3.0
    softness: float = 0.6
    depth_noise: float = 1.0
    holes: float = 0.004
    shift: tuple[int, int] = (0, 0)
    delay_s: float = 0.0
    narrow: bool = False
    has_depth: bool = True
    no_target_depth: tuple[tuple[float, float], ...] = ()
    exposure_s: float = 0.012


class Sensor:
    """Turns ideal pictures into recorded ones.

    Args:
        options: its flaws.
        camera: of the colour image.
        size: ``width, height`` of the colour image.
        rng: makes the noise fields, from which each frame cuts another piece.
    """

    _SPARE = 97

    def __init__(
        self, options: SensorOptions, camera: Intrinsics, size: tuple[int, int],
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self.options, self.camera = options, camera
        self.width, self.height = size
        scale = min(1.0, DEPTH_FOCAL / camera.fx)
        self.small = (max(8, round(size[0] * scale)), max(8, round(size[1] * scale)))
        spare = self._SPARE
        grain = rng.standard_normal((self.height + spare, self.width + spare, 3), dtype=np.float32)
        grain[..., :] += 0.5 * rng.standard_normal(grain.shape[:2], dtype=np.float32)[..., None]
        grain *= options.color_noise / 1.12
        self._brighter = np.clip(grain + 0.5, 0, 255).astype(np.uint8)
        self._darker = np.clip(0.5 - grain, 0, 255).astype(np.uint8)
        w, h = self.small
        self._gauss = rng.standard_normal((h + spare, w + spare), dtype=np.float32)
        self._chance = rng.uniform(0, 1, (h + spare, w + spare)).astype(np.float32)
        blobs = cv2.GaussianBlur(rng.standard_normal((h + spare, w + spare), dtype=np.float32),
                                 (0, 0), 1.6)  # fmt: skip
        level = np.quantile(blobs, 1 - min(options.holes, 0.5)) if options.holes > 0 else np.inf
        self._holes = blobs > level
        half = camera.fx * np.tan(HALF_ANGLE)
        cols = (np.arange(w) + 0.5) * self.width / w
        self._outside = np.abs(cols - camera.cx) > half
        self._columns = np.arange(w, dtype=np.float32)

    def _cut(self, rng: np.random.Generator) -> tuple[slice, slice]:
        r, c = rng.integers(0, self._SPARE, 2)
        return slice(r, r + self.small[1]), slice(c, c + self.small[0])

    def color(
        self, image: npt.NDArray[np.uint8], gain: tuple[float, float, float],
        rng: np.random.Generator,
    ) -> npt.NDArray[np.uint8]:  # fmt: skip
        """The recorded colour image of an ideal one under a light's gain per channel (BGR)."""
        if any(abs(g - 1) > 1e-3 for g in gain):
            ramp = np.arange(256, dtype=np.float32)[:, None] * np.array(gain, np.float32)
            image = cv2.LUT(image, np.clip(ramp, 0, 255).astype(np.uint8)[None])
        sigma = self.options.softness * self.width / 960
        out: npt.NDArray[np.uint8] = image
        if sigma > 0.25:
            size = 3 if sigma < 0.9 else 5
            out = np.asarray(cv2.GaussianBlur(image, (size, size), sigma), np.uint8)
        if self.options.color_noise > 0:
            r, c = rng.integers(0, self._SPARE, 2)
            window = np.s_[r : r + self.height, c : c + self.width]
            out = cv2.subtract(cv2.add(out, self._brighter[window]), self._darker[window])
        return out

    def depth(
        self,
        ideal: Floats,
        color: npt.NDArray[np.uint8],
        target: npt.NDArray[np.bool_] | None,
        rng: np.random.Generator,
    ) -> Floats:
        """The recorded depth of an ideal one.

        Args:
            ideal: ``(H, W)`` metres, inf where nothing is.
            color: ``(H, W, 3)`` ideal colour image: what is dark returns little light.
            target: pixels that give no reading, or None.
            rng: of this frame.

        Returns:
            ``(H, W)`` float32 metres, NaN where there is no reading.
        """
        z = np.asarray(cv2.resize(ideal, self.small, interpolation=_NEAREST), np.float32)
        z = np.minimum(z, np.float32(12.0))
        high, low = cv2.dilate(z, None), cv2.erode(z, None)
        spread = high - low
        spread /= z
        chance = self._chance[self._cut(rng)]
        edge = spread > 0.045
        bad = edge & (chance < 0.6)
        # the rest of the edge pixels mix near and far
        mixed = low + (high - low) * (chance - np.float32(0.6)) * np.float32(1.2)
        noise = self._gauss[self._cut(rng)] * np.float32(self.options.depth_noise)
        sigma = np.float32(0.0012) + np.float32(0.0011) * z * z
        sigma *= 1 + np.float32(25) * np.minimum(spread, np.float32(0.1))
        noise *= sigma
        shadow = (
            self._columns - np.float32(BASELINE * self.camera.fx * self.small[0] / self.width) / z
        )
        first = np.minimum.accumulate(shadow[:, ::-1], axis=1)[:, ::-1]
        bad |= shadow > first + np.float32(0.75)
        bad |= self._holes[self._cut(rng)]
        small = cv2.resize(color, self.small, interpolation=_NEAREST)
        # black hair and cloth fall out in part, the more the farther
        dark = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY) < 26
        bad |= dark & (chance < np.float32(0.05) * z)
        # beyond 4.5 m readings fall out more and more, beyond 8 m there are none
        bad |= (z - np.float32(4.5)) > np.float32(3.5) * np.sqrt(np.sqrt(chance))
        if self.options.narrow:
            bad[:, self._outside] = True
        np.copyto(z, mixed, where=edge)
        z += noise
        bad |= (z < np.float32(0.5)) | (z > np.float32(8.5))
        z *= 1000
        np.rint(z, out=z)
        z *= np.float32(0.001)
        if target is not None:
            mask = cv2.resize(target.view(np.uint8), self.small, interpolation=_NEAREST)
            bad |= cv2.dilate(mask, None) > 0
        z[bad] = np.nan
        full = cv2.resize(z, (self.width, self.height), interpolation=_NEAREST)
        if self.options.shift != (0, 0):
            right, down = self.options.shift
            moved = np.array([[1, 0, right], [0, 1, down]], np.float64)
            full = cv2.warpAffine(
                full, moved, (self.width, self.height), flags=cv2.INTER_NEAREST, borderValue=np.nan
            )
        return np.ascontiguousarray(full, np.float32)
