# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The thesis's pictures from a recording: what each step of the trackers makes of one frame."""
