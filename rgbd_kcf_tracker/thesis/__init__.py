# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The trackers of the thesis, ``kcf``, ``rgbd`` and ``rgbd_pf``, a file per idea of it."""
