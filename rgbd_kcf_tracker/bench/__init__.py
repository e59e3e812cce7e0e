# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""What shows and measures the whole: demo, live benchmark, soak run, generated pages."""
