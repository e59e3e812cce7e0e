# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The files that are made from the parameters' dataclasses: YAML for the node, tables for people.

    python -m rgbd_kcf_tracker.bench.generated            # write them
    python -m rgbd_kcf_tracker.bench.generated --check    # say whether they are up to date

Needs no ROS.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Callable, Iterable
from pathlib import Path

from rgbd_kcf_tracker.live.following import FollowParameters
from rgbd_kcf_tracker.live.replay_settings import ReplayParameters
from rgbd_kcf_tracker.live.settings import READ_ONLY, NodeParameters
from rgbd_kcf_tracker.parameters import ParameterInfo, Scalar, describe
from rgbd_kcf_tracker.variants import DEFAULT_VARIANT, VARIANTS
from rgbd_kcf_tracker.view.live_page import ViewerParameters

COMMAND = 'python -m rgbd_kcf_tracker.bench.generated'
_WIDTH = 100


def yaml_value(value: Scalar) -> str:
    """A value as both PyYAML and ROS's parser read it with its type."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        # PyYAML takes 1e-05 for a string, so small numbers are written out.
        text = repr(value)
        return f'{value:.20f}'.rstrip('0') if 'e' in text else text
    return f"'{value}'" if isinstance(value, str) else str(value)


def range_text(info: ParameterInfo) -> str:
    """What values a parameter takes, in a few characters."""
    if info.choices:
        return ', '.join(info.choices)
    low = '' if info.minimum is None else f'{info.minimum:g}'
    high = '' if info.maximum is None else f'{info.maximum:g}'
    return f'{low} to {high}'.strip() if low or high else ''


def tracker_yaml() -> str:
    """``config/tracker.yaml``: every parameter of the tracker node with its default."""
    lines = [
        '# All parameters of the tracker node with their defaults. Made from the code by',
        f'#     {COMMAND}',
        '# Copy it, keep the lines you change, and start the node with',
        '#     ros2 run rgbd_kcf_tracker tracker --ros-args --params-file FILE',
        '/**:',
        '  ros__parameters:',
    ]
    lines += _yaml_entries(describe(NodeParameters), 4)
    for name, variant in VARIANTS.items():
        lines += ['', *_comment(f'{name}: {variant.summary}', 4), f'    {name}:']
        infos = describe(variant.parameters)
        lines += _yaml_entries(infos, 6) if infos else ['      {}']
    return '\n'.join(lines) + '\n'


def _yaml_entries(infos: Iterable[ParameterInfo], indent: int) -> list[str]:
    lines = []
    for info in infos:
        lines += _comment(_sentence(info), indent)
        lines.append(f'{" " * indent}{info.name}: {yaml_value(info.default)}')
    return lines


def _sentence(info: ParameterInfo) -> str:
    notes = [part for part in (info.unit, range_text(info)) if part]
    if info.name in READ_ONLY:
        notes.append('read-only')
    return info.description + (f' [{"; ".join(notes)}]' if notes else '')


def _comment(text: str, indent: int) -> list[str]:
    start = f'{" " * indent}# '
    return textwrap.wrap(text, _WIDTH, initial_indent=start, subsequent_indent=start)


def parameters_markdown() -> str:
    """``docs/parameters.md``: the same as tables."""
    lines = [
        '# Parameters of the tracker node',
        '',
        f'Made from the code by `{COMMAND}`; change the dataclasses, not this page.',
        '',
        'A parameter is set on the command line (`--ros-args -p NAME:=VALUE`), in a file '
        '(`--params-file`; `config/tracker.yaml` has all of them) or, unless it is marked '
        'read-only, while the node runs (`ros2 param set /tracker NAME VALUE`). An integer is '
        'taken for a double. With an unknown name or a value out of range the node does not start '
        "and says why (`unknown parameter 'variatn': did you mean 'variant'?`); while running it "
        'is refused with the reason.',
        '',
        'A change of `variant` or of a parameter of the variant at work makes a new tracker on the '
        'boxes of the next frame that shows all who were chosen or added, so that a hidden target '
        'is not lost by it. For the chosen one, and the last one that is left (of several who were '
        'added and are all hidden the one who was seen last), it waits however long; who '
        'was added and is hidden for ten seconds more is dropped, which the log and '
        '`/diagnostics` say. Whoever else is in view with `follow_everyone` keeps his id; who is '
        'hidden in that frame has another when he is seen again. A value that is what it was, or '
        'of another variant, changes nothing. '
        '`pair_tolerance`, `depth_wait` and `camera_info_wait` count from the next activation, '
        'read-only ones from the next start.',
        '',
        '## The node',
        '',
        *_table('', describe(NodeParameters)),
    ]
    for name, variant in VARIANTS.items():
        default = ' (the default variant)' if name == DEFAULT_VARIANT else ''
        lines += ['', f'## `{name}`{default}', '', f'{variant.summary}.', '']
        lines += _table(f'{name}.', describe(variant.parameters))
    lines += [
        '',
        '# Parameters of the replay node',
        '',
        'All are read when it starts; a value that it cannot use ends it with a message.',
        '',
        *_table('', describe(ReplayParameters)),
        '',
        '# Parameters of the viewer node',
        '',
        'All are read when it starts; see [the page in the browser](view.md).',
        '',
        *_table('', describe(ViewerParameters)),
        '',
        '# Parameters of the follow node',
        '',
        'All are read when it starts; see [following a person](follow.md).',
        '',
        *_table('', describe(FollowParameters)),
    ]
    return '\n'.join(lines) + '\n'


def _table(prefix: str, infos: Iterable[ParameterInfo]) -> list[str]:
    rows = ['| name | default | unit | values | meaning | source |', '|---|---|---|---|---|---|']
    for info in infos:
        meaning = info.description + (' Read-only.' if info.name in READ_ONLY else '')
        cells = (
            f'`{prefix}{info.name}`',
            f'`{yaml_value(info.default)}`',
            info.unit,
            range_text(info),
            meaning,
            info.source,
        )
        rows.append('| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |')
    return rows


FILES: dict[str, Callable[[], str]] = {
    'config/tracker.yaml': tracker_yaml,
    'docs/parameters.md': parameters_markdown,
}


def outdated(root: Path) -> list[str]:
    """The generated files under ``root`` that are missing or differ from the code."""
    return [
        name
        for name, make in FILES.items()
        if not (root / name).is_file() or (root / name).read_text(encoding='utf-8') != make()
    ]


def main(args: list[str] | None = None) -> int:
    """Write the files, or check them."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--check', action='store_true', help='write nothing; fail if out of date')
    parser.add_argument('--root', type=Path, default=Path(), help='the checkout (here)')
    options = parser.parse_args(args)
    stale = outdated(options.root)
    for name in stale:
        if not options.check:
            (options.root / name).parent.mkdir(parents=True, exist_ok=True)
            (options.root / name).write_text(FILES[name](), encoding='utf-8')
        print(f'{name} {"is out of date: run " + COMMAND if options.check else "written"}')
    return 1 if stale and options.check else 0


if __name__ == '__main__':
    sys.exit(main())
