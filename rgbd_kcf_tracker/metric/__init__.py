# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The tracker ``metric``: what a frame shows, what is remembered of one, and what follows."""
