# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What somebody is known by, to look at: the tracker's views, with the pictures they are of."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import cv2

from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.insight import KnownView
from rgbd_kcf_tracker.recordings.evidence_messages import hex_color

HEIGHT = 96
QUALITY = 80


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A view and the picture that it was taken from.

    Attributes:
        view: the tracker's own; None of a tracker that keeps none, for the first sight.
        picture: JPEG; empty where the image that the view is of, or the target's place in it, was
            not known.
    """

    view: KnownView | None
    picture: bytes

    @property
    def colors(self) -> tuple[str, ...]:
        """Of the view's slices from head to feet as '#rrggbb', '' where nothing shows."""
        return () if self.view is None else tuple(map(hex_color, self.view.colors))


def known_by(
    gallery: Sequence[KnownView],
    before: Sequence[Known],
    frame: Frame,
    box: Box | None,
    older: Collection[KnownView] = (),
) -> tuple[Known, ...]:
    """The views of a gallery with their pictures; those that are new show the box in the frame.

    Args:
        gallery: the views after the frame; empty of a tracker that keeps none.
        before: what was known after the frame before.
        frame: the frame.
        box: where the target is in it; None where it is not seen.
        older: views that are new to us, but not of this frame: they get no picture.
    """
    pictures = {known.view: known for known in before}
    if not gallery:
        first = () if before else (_taken(None, frame, box),)
        return tuple(known for known in (*before, *first) if known.picture)
    return tuple(
        pictures.get(view) or _taken(view, frame, None if view in older else box)
        for view in gallery
    )


def _taken(view: KnownView | None, frame: Frame, box: Box | None) -> Known:
    inside = None if box is None else box.clipped(frame.width, frame.height)
    if inside is None or inside.width < 2 or inside.height < 2:
        return Known(view, b'')
    left, top = int(inside.x), int(inside.y)
    part = frame.color[top : int(inside.bottom), left : int(inside.right)]
    width = max(1, round(part.shape[1] * HEIGHT / part.shape[0]))
    size = (min(width, 2 * HEIGHT), HEIGHT)
    small = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    data = cv2.imencode('.jpg', small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
    return Known(view, data)
