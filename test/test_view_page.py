# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The page in a real headless Chromium, with software WebGL."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('aiohttp', reason="the page needs aiohttp: pip install '.[view]'")

import browser as browsers
from browser import Browser, Page

from rgbd_kcf_tracker import Box
from rgbd_kcf_tracker.variants import default_parameters
from rgbd_kcf_tracker.view.export import export
from rgbd_kcf_tracker.view.player import Player
from rgbd_kcf_tracker.view.server import Server
from rgbd_kcf_tracker.view.sources import SimulatedRecording, first_box

pytestmark = [
    pytest.mark.skipif(
        browsers.chromium() is None,
        reason='no Chromium: apt-get install chromium (Debian), or name one in RGBD_KCF_CHROMIUM',
    ),
    pytest.mark.timeout(180),
]
SIZE = (320, 180)
TARGET_1 = (86, 180, 233)  # the first of the page's colours


@lru_cache(maxsize=1)
def recording() -> SimulatedRecording:
    return SimulatedRecording('occlusion', 3, 15.0, SIZE, 3.0)


@lru_cache(maxsize=1)
def crowd() -> SimulatedRecording:
    return SimulatedRecording('crowd', 3, 15.0, SIZE, 3.0)


@pytest.fixture(scope='module')
def chromium() -> Iterator[Browser]:
    with browsers.browser() as opened:
        yield opened


class Served:
    """A player and its server, which can be ended and started again."""

    def __init__(
        self, box: bool = True, token: str = '', scene: SimulatedRecording | None = None
    ) -> None:
        scene = recording() if scene is None else scene
        start, first = first_box(scene, None)
        self.truth = first
        self.player = Player(scene, 'metric', start=start, box=first if box else None)
        self.token = token
        self.server = Server(self.player, port=0, token=token)
        self.server.start()
        self.player.start()
        self.url = self.server.url

    def restart(self) -> None:
        port = int(self.url.rsplit(':', 1)[1].strip('/'))
        self.server = Server(self.player, port=port, token=self.token)
        self.server.start()

    def close(self) -> None:
        self.player.stop()
        self.server.stop()


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    made.close()


@pytest.fixture
def untracked() -> Iterator[Served]:
    made = Served(box=False)
    yield made
    made.close()


def opened(chromium: Browser, served: Served, **size: Any) -> Page:
    page = chromium.page()
    page.size(size.pop('width', 1400), size.pop('height', 1000), **size)
    page.open(served.url)
    page.until('typeof page !== "undefined" && page.drawn > 0')
    return page


def on_screen(page: Page, x: float, y: float) -> tuple[float, float]:
    """Where a pixel of the image is on the screen."""
    left, top, width, height = page.value(
        "(() => { document.getElementById('picture').scrollIntoView({block: 'center'}); "
        "const b = document.getElementById('picture').getBoundingClientRect(); "
        'return [b.x, b.y, b.width, b.height]; })()'
    )
    return left + x * width / SIZE[0], top + y * height / SIZE[1]


def pixel(page: Page, x: float, y: float) -> tuple[int, ...]:
    """What is drawn at a pixel of the image."""
    return tuple(
        page.value(
            f"[...document.getElementById('picture').getContext('2d')"
            f'.getImageData({round(x)}, {round(y)}, 1, 1).data].slice(0, 3)'
        )
    )


def near(color: tuple[int, ...], other: tuple[int, ...], most: int) -> bool:
    return max(abs(a - b) for a, b in zip(color, other, strict=True)) <= most


def test_page_loads_and_shows_everything(chromium: Browser, served: Served) -> None:
    page = opened(chromium, served)
    assert page.value("document.getElementById('title').textContent") == 'occlusion_3'
    assert page.value("document.getElementById('state').textContent") == 'tracking'
    assert page.value('page.points.count') > 1000
    assert page.value("document.getElementById('targets').children.length") == 1
    assert page.value("document.querySelectorAll('.candidate').length") >= 0
    # The room is drawn: not one colour all over.
    assert (
        page.value(
            '(() => { const gl = room.gl, n = room.canvas.width * room.canvas.height; '
            'const data = new Uint8Array(4 * n); '
            'gl.readPixels(0, 0, room.canvas.width, room.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, '
            'data); return new Set(new Uint32Array(data.buffer)).size; })()'
        )
        > 20
    )
    assert page.errors == []


def test_the_box_is_drawn_at_its_pixels(chromium: Browser, served: Served) -> None:
    # As narrow as the image: a line is wider than a pixel there and covers what lies under it.
    page = opened(chromium, served, width=360)
    assert page.value("document.getElementById('picture').clientWidth") < SIZE[0]
    x, y, width, height = page.value('page.shown.targets[0].box')
    assert Box(x, y, width, height).iou(served.truth) > 0.99
    for row in (0.3, 0.6, 0.9):
        assert near(pixel(page, x, y + row * height), TARGET_1, 5)
        assert near(pixel(page, x + width, y + row * height), TARGET_1, 5)
        assert not near(pixel(page, x - 6, y + row * height), TARGET_1, 40)


def test_a_box_dragged_at_known_pixels_starts_the_tracker_on_it(
    chromium: Browser, untracked: Served
) -> None:
    page = opened(chromium, untracked)
    box = untracked.truth
    page.drag(on_screen(page, box.x, box.y), on_screen(page, box.right, box.bottom))
    page.until('page.shown.targets.length === 1')
    started = Box(*page.value('page.shown.targets[0].box'))
    assert started.x == pytest.approx(box.x, abs=1)
    assert started.y == pytest.approx(box.y, abs=1)
    assert started.right == pytest.approx(box.right, abs=1)
    assert started.bottom == pytest.approx(box.bottom, abs=1)
    page.value("send({do: 'seek', frame: 6})")
    page.until('page.shown.frame === 6')
    track = Box(*page.value('page.shown.targets[0].box'))
    truth = recording().groundtruth
    assert truth is not None
    assert truth[6] is not None
    assert track.iou(truth[6]) > 0.6
    assert page.errors == []


def test_a_click_on_a_person_in_the_picture_and_in_the_room(
    chromium: Browser, untracked: Served
) -> None:
    page = opened(chromium, untracked)
    box = untracked.truth
    page.click(*on_screen(page, box.cx, box.cy))
    page.until('page.shown.targets.length === 1')
    assert Box(*page.value('page.shown.targets[0].box')).iou(box) > 0.5
    page.press('#targets button')
    page.until('page.shown.targets.length === 0')
    # The same person in the room: the point of its middle, projected by the page itself.
    x, y = page.value(
        '(() => { room.canvas.scrollIntoView({block: "center"}); '
        'const b = room.canvas.getBoundingClientRect(), [fx, fy, cx, cy] = page.shown.camera; '
        f'const u = {box.cx}, v = {box.cy}; let best = null, least = 1e9; '
        'for (let i = 0; i < page.points.count; i++) { '
        'const p = [0, 1, 2].map(k => page.points.places[3 * i + k] / 1000); '
        'const d = Math.hypot(fx * p[0] / p[2] + cx - u, fy * p[1] / p[2] + cy - v); '
        'if (d < least) { least = d; best = p; } } '
        'const at = room.project(room.matrix(b.width, b.height), best, b.width, b.height); '
        'return [b.x + at[0], b.y + at[1]]; })()'
    )
    page.click(x, y)
    page.until('page.shown.targets.length === 1')
    assert Box(*page.value('page.shown.targets[0].box')).iou(box) > 0.3


def test_a_recording_is_sought_stepped_and_played(chromium: Browser, served: Served) -> None:
    page = opened(chromium, served)
    page.value(
        "(() => { const s = document.getElementById('seek'); s.value = 10; "
        "s.dispatchEvent(new Event('change')); })()"
    )
    page.until('page.shown.frame === 10')
    assert page.value('page.entries.length') == 11
    page.press('#forward')
    page.until('page.shown.frame === 11')
    page.press('#back')
    page.until('page.shown.frame === 10')
    page.press('#play')
    page.until('page.shown.frame > 14')
    page.press('#play')
    page.until('!page.shown.playing')
    # A click into the last minute goes there.
    page.value(
        '(() => { const c = document.getElementById("time"), b = c.getBoundingClientRect(); '
        'const t = page.entries[3].t; let u = 0; while (page.timeAxis.time(u) < t) u += 0.5; '
        'c.dispatchEvent(new MouseEvent("click", {clientX: b.x + u, clientY: b.y + 20})); })()'
    )
    page.until('page.shown.frame === 3')
    assert page.errors == []


def test_the_last_minute_has_an_end_whatever_its_times(chromium: Browser, served: Served) -> None:
    page = opened(chromium, served)
    page.value(
        'page.entries = Array.from({length: 7000}, () => ({t: 0, targets: []})); '
        "page.drawn = 0; send({do: 'step', by: 1})"
    )
    page.until('page.drawn > 0 && page.shown.frame > 0')
    assert page.value('page.entries.length') == 6000
    assert page.value('page.entries.at(-1).frame') == page.value('page.shown.frame')


def test_parameters_have_their_ranges_and_are_sent(chromium: Browser, served: Served) -> None:
    page = opened(chromium, served)
    page.value("document.querySelector('details').open = true")
    change = (
        "(v => {{ const i = document.getElementById('parameter-acceptance'); i.value = v; "
        "i.dispatchEvent(new Event('change')); return [i.min, i.max, i.checkValidity()]; }})({})"
    )
    assert page.value(change.format('"0.6"')) == ['0.01', '0.99', True]
    page.until('page.shown.values.acceptance === 0.6')
    assert page.value(change.format('"7"'))[2] is False
    page.value(
        "(() => { const v = document.getElementById('variant'); v.value = 'kcf'; "
        "v.dispatchEvent(new Event('change')); })()"
    )
    page.until("page.shown.variant === 'kcf' && document.getElementById('parameter-padding')")
    assert page.value("fetch('parameters.yaml').then(r => r.text())").startswith('/**:')
    assert page.value("fetch('boxes.csv').then(r => r.text())").startswith('id,frame,stamp_ns')


@pytest.fixture
def crowded() -> Iterator[Served]:
    made = Served(scene=crowd())
    yield made
    made.close()


def test_everyone_is_shown_followed_renamed_and_let_go(chromium: Browser, crowded: Served) -> None:
    page = opened(chromium, crowded)
    page.value("send({do: 'seek', frame: 30})")
    page.until('page.shown.frame === 30')
    assert page.value("document.getElementById('others').children.length") == 0
    page.press('#everyone')
    # Frames on the way to this one are shown too, while everyone is looked for in them.
    page.until('page.shown.everyone && page.shown.frame === 30 && !page.shown.busy')
    page.until("document.querySelectorAll('#others li').length === page.shown.targets.length - 1")
    # Each has a caption in the colour of its own above its box, higher where another's is, and its
    # place in the room.
    apart = page.value('page.shown.targets.find(t => !t.chosen && t.box && t.box[0] > 200)')
    x, y = apart['box'][:2]
    color = page.value(f'rgb(colorOf({apart["id"]})).map(v => 255 * v)')
    assert any(near(pixel(page, x + 1, y - up), color, 30) for up in range(2, 24))
    other = page.value('page.shown.targets.find(t => !t.chosen && t.box && t.box[1] > 20)')
    assert other['position'] is not None
    assert page.value("document.querySelectorAll('#others .views img').length") > 0

    page.value(
        "[...document.querySelectorAll('#others li')].find(li => "
        f"li.dataset.id === '{other['id']}').querySelector('button').click()"
    )
    page.until("document.querySelectorAll('#targets li').length === 2")
    page.value(
        f'(() => {{ const i = document.querySelector(\'#targets li[data-id="{other["id"]}"] '
        "input'); i.value = 'Anna'; i.dispatchEvent(new Event('change')); })()"
    )
    page.until("page.shown.targets.some(t => t.name === 'Anna' && t.chosen)")
    page.value("send({do: 'seek', frame: 36})")
    page.until('page.shown.frame === 36 && page.trails.get(1).length > 20')
    # The last of a trail is where the target is.
    seen = 'page.shown.targets.find(t => t.position)'
    place, trail = page.value(f'[{seen}.position, page.trails.get({seen}.id).pop()]')
    assert trail == pytest.approx(place, abs=0.01)
    names = page.value("[...document.getElementById('why-of').options].map(o => o.textContent)")
    assert 'Anna' in names
    page.press('#targets li:last-child button')
    page.until("document.querySelectorAll('#targets li').length === 1")
    page.press('#everyone')
    page.until('!page.shown.everyone && page.shown.targets.length === 1')
    assert page.errors == []


def test_names_are_shown_as_they_are(chromium: Browser, served: Served) -> None:
    """A name is words: whoever sets one runs nothing in the browsers of the others."""
    page = opened(chromium, served)
    page.value("send({do: 'rename', id: 1, name: '<img src=x onerror=alert(1)>'})")
    page.until("document.querySelector('#targets input').value.startsWith('<img')")
    assert page.value("document.querySelectorAll('#targets img[src=x]').length") == 0


def test_two_browsers_see_the_same(chromium: Browser, served: Served) -> None:
    one, two = opened(chromium, served), opened(chromium, served)
    one.value("send({do: 'seek', frame: 9})")
    one.until('page.shown.frame === 9')
    two.until('page.shown.frame === 9')
    assert two.value('page.shown.targets') == one.value('page.shown.targets')


def test_a_lost_connection_is_said_and_found_again(chromium: Browser, served: Served) -> None:
    page = opened(chromium, served)
    served.server.stop()
    page.until("document.getElementById('banner').textContent.startsWith('Connection lost')")
    assert page.value("!document.getElementById('banner').hidden")
    # A box that is being drawn must not slip away under the hand.
    canvas = "document.getElementById('picture').getBoundingClientRect().top"
    tops = f"""(banner => {{ const tops = [{canvas}]; banner.hidden = true; tops.push({canvas});
        banner.hidden = false; return tops; }})(document.getElementById('banner'))"""
    shown, hidden = page.value(tops)
    assert shown == hidden
    served.restart()
    page.until("document.getElementById('banner').hidden && page.socket.readyState === 1", 40)
    drawn = page.value('page.drawn')
    page.value("send({do: 'seek', frame: 7})")
    page.until(f'page.shown.frame === 7 && page.drawn > {drawn}')


def test_the_token_is_asked_for_first(chromium: Browser) -> None:
    served = Served(token='correct horse')
    try:
        page = chromium.page()
        page.open(served.url)
        page.until("document.getElementById('token')")
        assert page.value("document.querySelector('canvas')") is None
        enter = (
            "(w => {{ document.getElementById('token').value = w; "
            "document.querySelector('form').submit(); }})({!r})"
        )
        page.value(enter.format('wrong horse'))
        page.until("document.body.innerText.includes('That is not the token')")
        page.value(enter.format('correct horse'))
        page.until('typeof page !== "undefined" && page.drawn > 0')
        page.call('Network.clearBrowserCookies')
    finally:
        served.close()


def test_a_page_elsewhere_cannot_reach_the_socket(chromium: Browser, served: Served) -> None:
    page = chromium.page('data:text/html,<title>elsewhere</title>')
    state = page.value(
        f"new Promise(done => {{ const s = new WebSocket('{served.url.replace('http', 'ws')}"
        "socket'); "
        "s.onopen = () => done('open'); s.onerror = () => done('refused'); })"
    )
    assert state == 'refused'


@pytest.mark.parametrize('dark', [False, True])
@pytest.mark.parametrize(('width', 'height', 'phone'), [(1400, 900, False), (390, 844, True)])
def test_nothing_sticks_out_on_desktop_and_phone(
    chromium: Browser, served: Served, width: int, height: int, phone: bool, dark: bool
) -> None:
    page = opened(chromium, served, width=width, height=height, dark=dark, phone=phone)
    page.value("document.querySelector('details').open = true")
    assert page.value('document.documentElement.scrollWidth') <= width
    clipped = page.value(
        "[...document.querySelectorAll('button, .button, select, .hint, h2')].filter(e => "
        'e.offsetParent && e.scrollWidth > e.clientWidth + 1 && e.tagName !== "SELECT")'
        '.map(e => e.textContent)'
    )
    assert clipped == []
    back = page.value('getComputedStyle(document.body).backgroundColor')
    assert (back == 'rgb(17, 20, 23)') == dark


@pytest.mark.parametrize('dark', [False, True])
def test_words_on_buttons_can_be_read_under_the_mouse(
    chromium: Browser, served: Served, dark: bool
) -> None:
    page = opened(chromium, served, dark=dark)
    ratio = (
        "(() => {{ const e = document.querySelector('{}'), s = getComputedStyle(e); "
        'const light = c => c.match(/[0-9.]+/g).slice(0, 3).map(v => v / 255)'
        '.map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)'
        '.reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0.05); '
        'const a = light(s.color), b = light(s.backgroundColor); '
        'return Math.max(a, b) / Math.min(a, b); }})()'
    )
    for selector in ('#play', '#back', '#defaults', '#targets button'):
        x, y = page.value(
            f"(() => {{ const e = document.querySelector('{selector}'); "
            "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect(); "
            'return [b.x + b.width / 2, b.y + b.height / 2]; })()'
        )
        page.mouse('mouseMoved', x, y, 0)
        page.until(f"document.querySelector('{selector}').matches(':hover')")
        # The ratio of contrast that WCAG 2 asks for (1.4.3).
        assert page.value(ratio.format(selector)) > 4.5, selector


def test_a_finger_picks_only_when_told(chromium: Browser, untracked: Served) -> None:
    page = opened(chromium, untracked, width=390, height=844, phone=True)
    box = untracked.truth

    def swipe() -> None:
        start, stop = on_screen(page, box.x, box.y), on_screen(page, box.right, box.bottom)
        for kind, at in (('touchStart', start), ('touchMove', stop), ('touchEnd', None)):
            points = [] if at is None else [{'x': at[0], 'y': at[1]}]
            page.call('Input.dispatchTouchEvent', type=kind, touchPoints=points)

    swipe()
    time.sleep(0.5)
    assert page.value('page.shown.targets.length') == 0
    page.value("document.getElementById('pick').click()")
    swipe()
    page.until('page.shown.targets.length === 1')
    assert Box(*page.value('page.shown.targets[0].box')).iou(box) > 0.8


def test_an_exported_file_plays_by_itself(chromium: Browser, tmp_path: Path) -> None:
    start, box = first_box(recording(), None)
    path = tmp_path / 'run.html'
    export(recording(), path, 'metric', default_parameters('metric'), start, 15, box)
    page = chromium.page()
    page.size(1400, 1000)
    page.open(path.as_uri())
    page.until('typeof page !== "undefined" && page.drawn > 0')
    page.press('#forward')
    page.until('page.shown.frame === 1')
    page.press('#play')
    page.until('page.shown.frame === 14 && !page.shown.playing')
    assert page.value('page.entries.length') == 15
    page.value(
        "(() => { const s = document.getElementById('seek'); s.value = 4; "
        "s.dispatchEvent(new Event('change')); })()"
    )
    page.until('page.shown.frame === 4')
    page.size(900, 700)
    assert page.value("document.getElementById('seek').value") == '4'
    assert page.value("document.getElementById('frame').textContent") == 'frame 4'
    assert page.value("document.getElementById('yaml').offsetParent") is None
    assert page.errors == []
