# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The ROS 2 nodes and message adapters: what a robot runs, and a thin layer over the rest."""
