# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Messages by the names of their types: what is said of a track does not depend on whose they are.

Those of bags are in :mod:`~rgbd_kcf_tracker.recordings.bag_types`, rclpy's in
:mod:`rgbd_kcf_tracker.ros.messages`.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt


class MessageTypes(Protocol):
    """Makes messages. Fields that are not given are empty or zero."""

    def make(self, kind: str, /, **fields: Any) -> Any:
        """A message of the type ``package/msg/Name``."""
        ...

    def octets(self, data: npt.NDArray[np.uint8]) -> Any:
        """Bytes as a field ``uint8[]`` takes them; may share the memory of ``(n,)`` data."""
        ...
