# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What people look at: the page in the browser, and the pictures that explain the trackers."""

TOKEN_VARIABLE = 'RGBD_KCF_TOKEN'
"""Environment variable that holds the page's token."""
