# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``rgbd-kcf``: finds the subcommand, and turns errors into messages.

As little as can be is imported before :func:`main` takes care of Ctrl-C.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # typing, too, takes its time
if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence
    from typing import Protocol
else:
    Protocol = object

PROGRAM = 'rgbd-kcf'
SUBCOMMANDS = (
    'track', 'evaluate', 'sweep', 'convert', 'info', 'simulate', 'view', 'explain', 'bench',
)  # fmt: skip

EXIT_USAGE = 2


class Subcommand(Protocol):
    """What the module of a subcommand offers. It imports what is heavy only in ``run``."""

    NAME: str
    HELP: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the options."""
        ...

    def run(self, args: argparse.Namespace) -> int:
        """Do it; returns the exit code."""
        ...


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code.

    Errors that a user can mend are one message on standard error and exit code 2, Ctrl-C is 130.
    """
    try:
        _open_closed_streams()
        return _run(list(sys.argv[1:] if argv is None else argv))
    except KeyboardInterrupt:
        print(f'{PROGRAM}: interrupted', file=sys.stderr)
        return 130
    finally:
        _drop_unwritable()


def _run(arguments: list[str]) -> int:
    from rgbd_kcf_tracker.cli.interrupts import interrupts
    from rgbd_kcf_tracker.errors import RgbdKcfError

    try:
        with interrupts.handled():
            _prepare_messages()
            _refuse_empty(arguments)
            arguments = _joined(arguments)
            args = _parser(arguments).parse_args(arguments)
            code = int(args.run(args))
            sys.stdout.flush()
            return code
    except RgbdKcfError as error:
        from rgbd_kcf_tracker.cli.common import escaped

        print(f'{PROGRAM}: error: {escaped(str(error))}', file=sys.stderr)
        return EXIT_USAGE
    except ModuleNotFoundError as error:
        from rgbd_kcf_tracker.recordings import BAG_LIBRARIES, HOW_TO_GET_THEM

        if error.name not in BAG_LIBRARIES:
            raise
        print(f'{PROGRAM}: error: {error.name} is missing: {HOW_TO_GET_THEM}', file=sys.stderr)
        return EXIT_USAGE
    except BrokenPipeError:
        return 1  # the reader of our output is gone (``| head``): nothing is left to say
    except OSError as error:
        from rgbd_kcf_tracker.cli.common import escaped

        name = f'{error.filename}: ' if error.filename else _unnamed(error.errno)
        print(f'{PROGRAM}: error: {escaped(name)}{error.strerror or error}', file=sys.stderr)
        return EXIT_USAGE
    except MemoryError:
        print(f'{PROGRAM}: error: there is not enough memory', file=sys.stderr)
        return EXIT_USAGE


def _open_closed_streams() -> None:
    """Standard streams that were closed lead nowhere: the next file would be one of them."""
    for number, name in enumerate(('stdin', 'stdout', 'stderr')):
        if getattr(sys, name) is not None:
            continue
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
        stream = open(os.devnull, 'w' if number else 'r', encoding='utf-8')  # noqa: SIM115
        setattr(sys, name, stream)


def _drop_unwritable() -> None:
    """What standard output did not take was told: Python would try again, and end with 120."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.stdout.flush()


def _unnamed(number: int | None) -> str:
    """What an error is about that names no file; ours do."""
    import errno

    if number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
        return 'standard output, or a temporary file, cannot be written: '
    try:
        os.getcwd()
    except OSError:
        return 'the folder that this was started in is gone, change to another: '
    return ''


def _prepare_messages() -> None:
    """Whatever a name holds can be printed, in any encoding; warnings look as ours."""
    import codecs
    import io
    import logging

    if isinstance(sys.stdout, io.TextIOWrapper):
        utf_8 = codecs.lookup(sys.stdout.encoding).name == 'utf-8'
        sys.stdout.reconfigure(errors='surrogateescape' if utf_8 else 'backslashreplace')
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(logging.Formatter('warning: %(message)s'))


def _refuse_empty(arguments: list[str]) -> None:
    """As of a variable of the shell that is not set: it would be the current folder, or nothing."""
    from rgbd_kcf_tracker.errors import ParameterError

    for before, word in zip([PROGRAM, *arguments], arguments, strict=False):
        of_word = word.startswith('--') and word.find('=') == len(word) - 1
        if not word or of_word:
            raise ParameterError(
                f'what follows {word[:-1] or before} is empty: give a value, or leave it out'
            )


def _joined(arguments: list[str]) -> list[str]:
    """``--init -10,100,50,50`` as ``--init=-10,100,50,50``: a number is no option."""
    joined: list[str] = []
    for word in arguments:
        number = word[:1] == '-' and word[1:2] in tuple('.0123456789')
        if (
            number
            and joined
            and '--' not in joined  # behind which nothing is an option
            and joined[-1].startswith('--')
            and '=' not in joined[-1]
        ):
            joined[-1] += f'={word}'
        else:
            joined.append(word)
    return joined


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    import argparse
    import importlib
    from typing import Any, cast

    class Parser(argparse.ArgumentParser):
        def _print_message(self, message: str, file: Any = None) -> None:
            """As argparse does, which does not mind where what ``--help`` says gets lost."""
            if file is not sys.stdout:
                super()._print_message(message, file)
                return
            file.write(message)
            file.flush()

    parser = Parser(
        prog=PROGRAM,
        description='Follow one target in colour and depth, in recordings and benchmarks. '
        'The live nodes are started with ros2 run or ros2 launch.',
        allow_abbrev=False,
    )
    parser.add_argument('--version', action='version', version=_version())
    commands = parser.add_subparsers(title='commands', metavar='COMMAND', required=True)
    # With a command named, only its module is imported, which keeps the start quick.
    named = [name for name in SUBCOMMANDS if name in arguments[:1]]
    for name in named or SUBCOMMANDS:
        module = cast(Subcommand, importlib.import_module(f'rgbd_kcf_tracker.cli.{name}'))
        sub = commands.add_parser(
            module.NAME, help=module.HELP, description=module.HELP, allow_abbrev=False
        )
        module.add_arguments(sub)
        sub.set_defaults(run=module.run)
    return parser


def _version() -> str:
    from rgbd_kcf_tracker import __version__

    return f'{PROGRAM} {__version__}'


if __name__ == '__main__':
    sys.exit(main())
