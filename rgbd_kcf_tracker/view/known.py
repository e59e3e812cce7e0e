# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What somebody is known by, to look at: the tracker's views, with the pictures they are of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.metric.identity.gallery import View
from rgbd_kcf_tracker.view.insight import colors_of

HEIGHT = 96
QUALITY = 80


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A view and the picture that it was taken from.

    Attributes:
        view: the tracker's own; None of a tracker that keeps none, for the first sight.
        picture: JPEG; empty where the target's place in the image was not known.
        colors: mean colours of the slices from head to feet as '#rrggbb', '' where nothing shows.
    """

    view: View | None
    picture: bytes
    colors: tuple[str, ...] = ()


def known_by(
    gallery: Sequence[View], before: Sequence[Known], frame: Frame, box: Box | None
) -> tuple[Known, ...]:
    """The views of a gallery with their pictures; those that are new show the box in the frame.

    Args:
        gallery: the views after the frame; empty of a tracker that keeps none.
        before: what was known after the frame before.
        frame: the frame.
        box: where the target is in it; None where it is not seen.
    """
    pictures = {id(known.view): known for known in before}
    if not gallery:
        first = () if before else (_taken(None, frame, box),)
        return tuple(known for known in (*before, *first) if known.picture)
    return tuple(pictures.get(id(view)) or _taken(view, frame, box) for view in gallery)


def _taken(view: View | None, frame: Frame, box: Box | None) -> Known:
    colors = () if view is None else tuple(_named(color) for color in colors_of(view))
    inside = None if box is None else box.clipped(frame.width, frame.height)
    if inside is None or inside.width < 2 or inside.height < 2:
        return Known(view, b'', colors)
    left, top = int(inside.x), int(inside.y)
    part = frame.color[top : int(inside.bottom), left : int(inside.right)]
    width = max(1, round(part.shape[1] * HEIGHT / part.shape[0]))
    size = (min(width, 2 * HEIGHT), HEIGHT)
    small = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    data = cv2.imencode('.jpg', small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
    return Known(view, data, colors)


def _named(color: np.ndarray) -> str:
    if np.isnan(color).any():
        return ''
    return '#' + ''.join(f'{round(255 * float(v)):02x}' for v in color)
