# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The whole explanation of one frame of a recording, chapter by chapter."""

from __future__ import annotations

from collections.abc import Iterator

from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.frame import Frame
from rgbd_kcf_tracker.geometry import Box
from rgbd_kcf_tracker.recordings import Recording
from rgbd_kcf_tracker.thesis.rgbd import RgbdParameters
from rgbd_kcf_tracker.thesis.rgbd_pf import RgbdPfParameters
from rgbd_kcf_tracker.view.explain.depth_pictures import depth_pictures
from rgbd_kcf_tracker.view.explain.filter_pictures import filter_pictures
from rgbd_kcf_tracker.view.explain.metric_pictures import metric_chapter
from rgbd_kcf_tracker.view.explain.moments import (
    DepthMoments,
    explain_depth,
    explain_filter,
    explain_particles,
)
from rgbd_kcf_tracker.view.explain.page import Chapter
from rgbd_kcf_tracker.view.explain.particle_pictures import particle_pictures

_RGBD = RgbdParameters()
_RGBD_PF = RgbdPfParameters()
VARIANTS = ('kcf', 'rgbd', 'rgbd_pf', 'metric')


def explain(
    recording: Recording, start: int, box: Box, asked: int, variants: tuple[str, ...] = VARIANTS
) -> list[Chapter]:
    """Run trackers over a recording and picture what they computed.

    Args:
        recording: of frames.
        start: the frame of the box.
        box: the target in it, pixels.
        asked: the frame to explain.
        variants: the trackers to explain, in this order.

    Raises:
        ParameterError: where the frame does not lie behind the first.
        BoxError: where the box lies outside the image.
    """
    if start == len(recording) - 1:
        raise ParameterError(
            f'the target is given in frame {start}, which is the last: nothing after it to explain'
        )
    if not start < asked < len(recording):
        raise ParameterError(
            f'--frame {asked}: the target is given in frame {start}, so give a frame from '
            f'{start + 1} to {len(recording) - 1}'
        )

    def frames() -> Iterator[tuple[int, Frame]]:
        return enumerate(recording.frames(start), start=start)

    chapters = []
    if 'kcf' in variants:
        chapters.append(
            Chapter(
                'kcf', 'The correlation filter (kcf)',
                'The filter learns from the first window, in all its shifts, what the target looks '
                'like. In each later frame it looks where the target last was: the shift of that '
                'window with the highest response says how far the target has moved, and there '
                'the filter learns a little more. Chapter 2 of the thesis.',
                filter_pictures(explain_filter(frames(), box, asked)),
            )
        )  # fmt: skip
    if 'rgbd' in variants:
        moments = explain_depth(frames(), box, asked)
        chapters.append(
            Chapter(
                'rgbd', 'Depth says when it is hidden (rgbd)',
                'A low response alone does not say why: the target may have turned, or something '
                'may stand in front of it. The depth at its centre tells the two apart. In each '
                f'frame (Algorithm 1): the filter looks along the search space. A response above '
                f'{_RGBD.detect_threshold:g} is the target. Below that, it is still the target '
                'as long as the depth at its centre has not come nearer by '
                f'{_RGBD.depth_threshold:g} m on average, and not more than '
                f'{100 * _RGBD.gone_share:g} % of it shows what is farther away; else it is '
                'hidden: no box is given, nothing is learned, and the search space grows. To be '
                'taken for the target again without such a response, '
                f'{(_RGBD.detect_threshold + _RGBD.hidden_response) / 2:g} '
                f'({_RGBD.hidden_response:g} at the place where it was last seen) and its own '
                'depth are needed, nearer or farther by less than the same '
                f'{_RGBD.depth_threshold:g} m. Chapter 4 of the thesis.',
                depth_pictures(moments), _missing(moments, recording),
            )
        )  # fmt: skip
    if 'rgbd_pf' in variants:
        chapters.append(
            Chapter(
                'rgbd_pf', 'Particles carry on where nothing is seen (rgbd_pf)',
                'A particle is one guess at where the target is, how it moves and how large it is. '
                'Many of them are kept or dropped by the colours that they find, and say where '
                'the filter should look next. Here the depth is asked before the response: where '
                'it says that the target is hidden there is no box and nothing is learned, and the '
                'particles go on with the velocity that they had. The filter then looks at their '
                'mean, at the heaviest of them, and where the target was last seen; a response of '
                f'{_RGBD_PF.reacquire_threshold:g} with its own depth is the target again, and one '
                f'of {_RGBD_PF.accept_threshold:g} at about its distance. After '
                f'{_RGBD_PF.lost_after:g} s it counts as lost, and in each frame a part of the '
                'particles is thrown anywhere in the image. Chapter 5 of the thesis, Algorithm 2.',
                particle_pictures(explain_particles(frames(), box, asked)),
            )
        )  # fmt: skip
    if 'metric' in variants:
        chapters.append(metric_chapter(frames(), box, asked))
    return chapters


def _missing(moments: DepthMoments, recording: Recording) -> str:
    """What the recording does not show, and where to see it."""
    if moments.readings and all(r[3] != r[3] for r in moments.readings):
        return (
            f'{recording.name} has no depth on the target, so the pictures of the depth patches '
            'are left out. See them on a simulated scene: rgbd-kcf explain --output DIR.'
        )
    if moments.hidden is None:
        last = moments.readings[-1][0] if moments.readings else 0
        return (
            f'Up to frame {last} of {recording.name} the target is never hidden, so the pictures '
            'of an occlusion are left out. See them on a simulated scene: '
            'rgbd-kcf explain --output DIR.'
        )
    return ''
