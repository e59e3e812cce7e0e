# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The JSON file into which a measurement writes its figures."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from rgbd_kcf_tracker.cli.common import add_overwrite_option
from rgbd_kcf_tracker.recordings.outputs import check_outputs, write_file


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Declare ``--output`` and ``--overwrite``."""
    parser.add_argument('--output', type=Path, help='JSON file for the figures')
    add_overwrite_option(parser, 'the file if it is there')


def check_output(options: argparse.Namespace) -> None:
    """Refuse, before anything is measured, a file that cannot be written.

    Raises:
        RecordingError: where it is there already, or its folder is not.
    """
    if options.output is not None:
        check_outputs({'--output': options.output}, overwrite=options.overwrite)


def write_output(options: argparse.Namespace, figures: Any) -> None:
    """Write the figures, where that was asked for.

    Raises:
        RecordingError: where the file cannot be written.
    """
    if options.output is not None:
        text = json.dumps(figures, indent=1)
        write_file(options.output, text.encode(), options.overwrite)
