# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The errors a user can cause and mend.

Every message names the file, topic, frame or parameter and says what to do. The command line prints
it alone, without a traceback; the nodes log and count it. Anything else that is raised is a bug.
"""


class RgbdKcfError(Exception):
    """Base of all errors that the package raises on bad input."""


class ParameterError(RgbdKcfError, ValueError):
    """A parameter is unknown, of the wrong type, or out of its range."""


class BoxError(RgbdKcfError, ValueError):
    """A box has no size, is not finite, or lies outside the image."""


class ImageError(RgbdKcfError, ValueError):
    """An image, or the message that carries one, cannot be used."""


class RecordingError(RgbdKcfError):
    """A recording cannot be opened, read or written."""


class DatasetError(RgbdKcfError):
    """A data set or a file of results does not have the form it should."""


class MissingExtraError(RgbdKcfError):
    """A library that only some commands need is not installed."""


class WorkersError(RgbdKcfError):
    """The processes or machines that jobs are to run on cannot be had, or not be relied on."""
