# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Many independent jobs on any executor: one process, a pool of them, shards, or a cluster.

A job is sent as a small description (paths, seeds, parameters; never images) and comes back with
the files that it made. The process that hands out jobs is the only one that writes results.
"""
