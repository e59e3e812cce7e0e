# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The pictures show what the trackers compute: held against trackers that are run here."""

from __future__ import annotations

import importlib
import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from mpl_toolkits.mplot3d import Axes3D

from rgbd_kcf_tracker import Frame, Track, TrackState, create_tracker
from rgbd_kcf_tracker.cli.main import main
from rgbd_kcf_tracker.errors import ParameterError
from rgbd_kcf_tracker.evaluation import plot_style
from rgbd_kcf_tracker.insight import Insight
from rgbd_kcf_tracker.metric.decide import evidence
from rgbd_kcf_tracker.simulation import simulate
from rgbd_kcf_tracker.thesis.correlation import linear_correlation, spectrum
from rgbd_kcf_tracker.thesis.depth_patch import DepthPatch
from rgbd_kcf_tracker.thesis.kcf import KcfModel
from rgbd_kcf_tracker.view.explain import depth_pictures, metric_pictures
from rgbd_kcf_tracker.view.explain.book import explain
from rgbd_kcf_tracker.view.explain.circulant import block_circulant, circulant, permutation
from rgbd_kcf_tracker.view.explain.moments import explain_depth
from rgbd_kcf_tracker.view.explain.page import Chapter, equation, write_page
from rgbd_kcf_tracker.view.explain.picture import Picture, show_mesh
from rgbd_kcf_tracker.view.sources import SimulatedRecording, first_box
from rgbd_kcf_tracker.view.watch import Call

ASKED = 8
SIZE = (480, 270)


@lru_cache(maxsize=1)
def recording() -> SimulatedRecording:
    """Rendered once: every chapter goes through it."""
    scene = SimulatedRecording('occlusion', 3, 15.0, SIZE)
    rendered = list(scene.frames())
    scene.frames = lambda start=0, end=None: iter(rendered[start:end])  # type: ignore[method-assign]
    return scene


@lru_cache(maxsize=1)
def chapters() -> dict[str, Chapter]:
    start, box = first_box(recording(), None)
    return {c.key: c for c in explain(recording(), start, box, ASKED)}


def shown(chapter: str, name: str) -> Picture:
    return next(p for p in chapters()[chapter].pictures if p.name == name)


@lru_cache(maxsize=1)
def frames() -> list[Frame]:
    return list(recording().frames(0, ASKED + 1))


def before(variant: str) -> tuple[object, Frame]:
    """A tracker that has seen all frames before the one asked for, and that frame."""
    _, box = first_box(recording(), None)
    tracker = create_tracker(variant)
    tracker.start(frames()[0], box)
    for frame in frames()[1:-1]:
        tracker.update(frame)
    return tracker, frames()[-1]


def test_every_figure_of_the_thesis_is_there() -> None:
    numbers = {
        n.strip()
        for chapter in chapters().values()
        for p in chapter.pictures
        for n in p.figure.split(',')
    }
    asked = '2.1 2.2 2.3 2.4 2.5 2.9 2.10 2.11 2.12 2.13 2.14 2.15 2.16 4.2 4.3 4.4 4.5 4.8 4.9'
    assert numbers >= {*asked.split(), '4.10', '4.11', '5.1', '5.2', 'D.1'}
    assert {p.name for p in chapters()['metric'].pictures} == {
        'surfaces', 'candidates', 'gallery', 'particles_above',
    }  # fmt: skip


def test_each_says_two_sentences_and_names_functions_that_exist() -> None:
    for chapter in chapters().values():
        for picture in chapter.pictures:
            sentences = re.findall(r'[.!?](?= [A-Z0-9]|$)', picture.words)
            assert len(sentences) == 2, (picture.name, picture.words)
            assert picture.functions, picture.name
            for name in picture.functions:
                module, _, path = name.partition(':')
                found = importlib.import_module(f'rgbd_kcf_tracker.{module}')
                for part in path.split('.'):
                    found = getattr(found, part)
                assert callable(found)


def test_every_sign_of_an_equation_is_explained() -> None:
    """A reader needs nothing but the page: no letter of an equation is left without a meaning."""
    for chapter in chapters().values():
        for picture in chapter.pictures:
            assert bool(picture.equation) == bool(picture.signs), picture.name
            explained = set().union(*(letters(sign) for sign, _ in picture.signs))
            assert letters(picture.equation) <= explained, picture.name
            assert all(words for _, words in picture.signs)


def letters(mathtext: str) -> set[str]:
    """Latin and Greek letters and accents of an equation; words and functions mean themselves."""
    known = r'mathrm\{[^}]*\}|(?:frac|sqrt|sum|exp|cos|min|max|left|right|ldots|quad|leq|cdot|vert'
    rest = re.sub(rf'\\(?:{known}|Vert|pi|[,; ])(?![a-z]))', ' ', mathtext)
    greek = set(re.findall(r'\\[A-Za-z]+', rest))
    return greek | set(re.findall(r'[A-Za-z]', re.sub(r'\\[A-Za-z]+', ' ', rest)))


def test_every_cue_of_the_verdict_is_explained() -> None:
    names = {name for name, _ in evidence.CUES}
    of_the_likeliest = {evidence.OTHER_PLACES, evidence.SOMEBODY_NEW, evidence.KNOWN_BEFORE}
    of_things = {evidence.WHERE_IT_STOOD}
    assert evidence.CUE_WORDS.keys() == names | of_things | of_the_likeliest


def test_a_surface_in_perspective_keeps_its_peak(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many cells the highest of some neighbours is drawn, never one that leaves out the top."""
    values = np.zeros((201, 37))
    values[131, 17] = 1
    drawn = []
    monkeypatch.setattr(Axes3D, 'plot_surface', lambda _, x, y, z, **options: drawn.append(z))
    show_mesh(plot_style.figure(3, 3), (1, 1, 1), values, '', '')
    assert drawn[0].shape[0] <= 101
    assert drawn[0].max() == 1


def test_features_and_response_are_those_of_the_tracker() -> None:
    tracker, frame = before('kcf')
    model: KcfModel = tracker._model  # type: ignore[attr-defined]
    box = tracker._box  # type: ignore[attr-defined]
    sample = model.sample(frame, box.cx, box.cy)
    response = model.filter.respond(sample)
    track: Track = tracker.update(frame)  # type: ignore[attr-defined]

    picture = shown('kcf', 'new_features')
    np.testing.assert_array_equal(spectrum(picture.values['features']), sample.spectrum)
    np.testing.assert_array_equal(
        picture.values['features'], picture.values['hog'] * picture.values['taper']
    )
    np.testing.assert_array_equal(shown('kcf', 'response').values['response'], response)
    assert shown('kcf', 'response').values['peak'] == response.max()
    assert track.box is not None
    assert shown('kcf', 'found').values['box'] == track.box.as_tuple()


def test_training_is_that_of_the_tracker() -> None:
    _, box = first_box(recording(), None)
    tracker = create_tracker('kcf')
    tracker.start(frames()[0], box)
    learned = tracker._model.first  # type: ignore[attr-defined]
    np.testing.assert_array_equal(shown('kcf', 'training').values['alpha'], learned._alpha)
    labels = shown('kcf', 'labels').values['labels']
    np.testing.assert_array_equal(spectrum(labels), learned._labels)
    assert labels[0, 0] == 1


def test_depth_patches_and_their_difference_are_those_of_the_tracker(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tracker, frame = before('rgbd')
    compared = []
    original = DepthPatch.diff_at_centre

    def spying(self: DepthPatch, patch: np.ndarray, interval: float) -> object:
        result = original(self, patch, interval)
        compared.append((self._patch.copy(), patch.copy(), result))
        return result

    monkeypatch.setattr(DepthPatch, 'diff_at_centre', spying)
    tracker.update(frame)  # type: ignore[attr-defined]
    remembered, patch, result = compared[-1]
    values = shown('rgbd', 'difference_without').values
    np.testing.assert_array_equal(values['remembered'], remembered)
    np.testing.assert_array_equal(values['patch'], patch)
    assert values['D_diff'] == result.value
    assert shown('rgbd', 'difference_with').values['D_diff'] > 0.15


def test_hidden_responds_less_than_partly_hidden_and_that_less_than_visible() -> None:
    values = shown('rgbd', 'responses').values
    peaks = [values[f'response_{w}'].max() for w in ('visible', 'partly_hidden', 'hidden')]
    assert peaks == sorted(peaks, reverse=True)
    spans = {k: v for k, v in shown('rgbd', 'search_space').values.items() if 'span' in k}
    assert len(spans) == 2
    assert list(spans.values()) == sorted(spans.values())


def test_particles_are_those_of_the_tracker() -> None:
    _, box = first_box(recording(), None)
    tracker = create_tracker('rgbd_pf')
    tracker.start(frames()[0], box)
    np.testing.assert_array_equal(
        shown('rgbd_pf', 'particles_first').values['states'],
        tracker._particles.states,  # type: ignore[attr-defined]
    )
    target = tracker._target_colors  # type: ignore[attr-defined]
    np.testing.assert_array_equal(shown('rgbd_pf', 'histogram').values['target'], target)
    steps = shown('rgbd_pf', 'particles_steps').values
    assert steps['weights'].sum() == pytest.approx(1)
    mean = steps['weights'] @ steps['spread']
    np.testing.assert_allclose(steps['estimate'], mean[[0, 1, 4, 5]])


def test_odds_of_metric_add_up_to_its_probability() -> None:
    tracker, frame = before('metric')
    track = tracker.update(frame)  # type: ignore[attr-defined]
    values = shown('metric', 'candidates').values
    assert values['probability'][0] == track.score
    odds = sum(values['cues_1'])
    assert 1 / (1 + np.exp(-odds)) == pytest.approx(track.score)


def test_circulants_are_made_of_shifts() -> None:
    signal = np.array([3, 1, 4, 1, 5])
    matrix = circulant(signal)
    for shift, row in enumerate(matrix):
        np.testing.assert_array_equal(row, np.linalg.matrix_power(permutation(5), shift) @ signal)
    rng = np.random.default_rng(0)
    patch = rng.normal(size=(4, 3))
    other = rng.normal(size=(4, 3))
    blocks = block_circulant(patch)
    np.testing.assert_array_equal(blocks[1 * 3 + 2], np.roll(patch, (1, 2), (0, 1)).ravel())
    # The filter's correlation is the product with the matrix that it never builds.
    by_filter = linear_correlation(patch[None], other[None]).ravel()
    np.testing.assert_allclose(blocks @ other.ravel() / 12, by_filter, atol=1e-12)


def test_what_a_recording_does_not_show_is_said() -> None:
    quiet = SimulatedRecording('occlusion', 3, 15.0, SIZE, 0.6)
    start, box = first_box(quiet, None)
    (chapter,) = explain(quiet, start, box, start + 3, ('rgbd',))
    assert 'never hidden' in chapter.missing
    assert not any(p.figure == '4.5' for p in chapter.pictures)


def test_what_is_said_of_a_difference_is_what_the_numbers_say() -> None:
    start, box = first_box(recording(), None)
    seen = explain_depth(enumerate(recording().frames(start), start), box, ASKED).seen
    call = depth_pictures._compared(seen)
    assert seen is not None
    assert call is not None
    for value, nearer, farther, words in (
        (0.108, 0.056, 0.2, 'What is left is flat'),
        (0.323, 0.016, 0.6, 'lies farther away'),
        (0.4, 0.2, 0.1, 'the response says'),
        (0.4, 0.01, 0.8, 'the response says'),
    ):
        measured = replace(call.value, value=value, nearer=nearer, farther=farther)
        picture = depth_pictures._difference(seen, replace(call, value=measured), '4.4', 'without')
        assert words in picture.words
        assert ('flat' in picture.words) == (value < 0.15)


def test_hills_are_said_to_sink_only_where_they_do() -> None:
    assert 'the lower the hill' in depth_pictures._of_the_hills([0.9, 0.5, 0.2])
    assert 'the lower the hill' not in depth_pictures._of_the_hills([0.34, 0.32, 0.41])
    assert 'the lower the hill' not in depth_pictures._of_the_hills([0.34, 0.34])
    assert depth_pictures._of_the_hills([0.34]) == ''


def test_a_frame_without_candidates_has_no_empty_axes(
    monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    drawn = []
    monkeypatch.setattr(plot_style, 'png', lambda figure: drawn.append(figure) or b'')
    hidden = (ASKED, frames()[-1], Track(None, TrackState.OCCLUDED), Insight())
    picture = metric_pictures._candidates(hidden)
    assert 'Every silhouette of this frame is surely' in picture.words
    assert not picture.equation
    assert len(drawn[0].axes) == 1
    assert not recwarn.list


def test_frame_before_the_target_is_refused() -> None:
    start, box = first_box(recording(), None)
    with pytest.raises(ParameterError, match='--frame 0'):
        explain(recording(), start, box, 0)


def test_page_is_one_file_without_outside_hosts(tmp_path: Path) -> None:
    folder = tmp_path / 'out'
    write_page(folder, 'A <title>', 'rgbd-kcf explain', [chapters()['kcf']])
    page = (folder / 'index.html').read_text(encoding='utf-8')
    assert 'A &lt;title&gt;' in page
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert 'http' not in re.sub(r'http://www\.w3\.org/\S+', '', page)
    assert page.count('<img') == len(chapters()['kcf'].pictures)
    stored = np.load(folder / 'values.npz')
    np.testing.assert_array_equal(
        stored['kcf_response/response'], shown('kcf', 'response').values['response']
    )


def test_equations_take_the_colour_of_the_page() -> None:
    svg = equation(r'\hat{\alpha} = \frac{1}{2}')
    assert svg.startswith('<svg')
    assert 'currentColor' in svg
    assert '#ffffff' not in svg


def test_a_sign_that_leans_out_of_its_sheet_is_not_cut() -> None:
    """Matplotlib gives P 7 points, of which it needs 7.5: cut there, it reads as F."""
    assert 'overflow="visible"' in equation('P').partition('>')[0]


def test_command_explains_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from rgbd_kcf_tracker.recordings import SequenceWriter

    scene = simulate('occlusion', 3, 15.0, 0.5, SIZE)
    with SequenceWriter(tmp_path / 'walk') as writer:
        for moment in scene:
            writer.write(moment.frame, moment.visible)
    out = tmp_path / 'out'
    command = ['explain', str(tmp_path / 'walk'), '--frame', '4', '--output', str(out)]
    assert main([*command, '--variants', 'kcf']) == 0
    assert 'frame 4' in capsys.readouterr().out
    assert (out / 'kcf_response.png').read_bytes().startswith(b'\x89PNG')
    assert main([*command, '--variants', 'kcf']) == 2
    assert '--overwrite' in capsys.readouterr().err
    assert main([*command, '--variants', 'mosse', '--overwrite']) == 2
    assert 'mosse' in capsys.readouterr().err
    assert main([*command, '--variants', ',', '--overwrite']) == 2
    assert 'no trackers: give --variants' in capsys.readouterr().err
    assert main([*command, '--seed', '0', '--overwrite']) == 2
    assert '--seed means nothing with a SOURCE' in capsys.readouterr().err
    (out / 'holiday.png').write_bytes(b'years of work')
    assert main([*command, '--variants', 'kcf', '--overwrite']) == 2
    assert 'holds holiday.png, which we did not write' in capsys.readouterr().err
    assert (out / 'holiday.png').exists()


def test_the_patch_that_is_drawn_is_the_one_that_was_compared() -> None:
    """In a frame in which the target was looked for twice the box of the first was drawn."""
    images = [np.full((2, 2), value, np.float32) for value in (1.0, np.nan, 3.0, np.nan)]
    calls = [Call('cut', {'n': n}, {}, image) for n, image in enumerate(images)]
    assert [depth_pictures.that_gave(calls, image).given['n'] for image in images] == [0, 3, 2, 3]
    assert depth_pictures.that_gave(calls, np.zeros((2, 2))).given['n'] == 0
