# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Recorded frames in, results out: bags, sequence folders, image codecs, CSV, video."""
