# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The suite over the corners of what is supported: Python, NumPy and OpenCV, oldest and newest.

``make matrix`` (or ``nox``) runs all corners whose interpreter is installed and skips the others;
``nox -s 'suite(py3.12-numpy1.26-opencv4.6)'`` runs one. Arguments after ``--`` go to pytest.
"""

from __future__ import annotations

import nox

nox.options.default_venv_backend = 'venv'
nox.options.error_on_missing_interpreters = False
nox.options.reuse_existing_virtualenvs = True

NUMPY = {'1.26': 'numpy==1.26.*', '2.x': 'numpy>=2'}
OPENCV = {'4.6': 'opencv-python-headless==4.6.*', '5': 'opencv-python-headless>=5'}
# Which corners exist as wheels. OpenCV 4.6 was built for NumPy 1 alone, and NumPy 1.26 has no
# wheels beyond Python 3.12.
CORNERS = [
    ('3.10', '1.26', '4.6'),
    ('3.10', '2.x', '5'),
    ('3.11', '1.26', '4.6'),
    ('3.11', '2.x', '5'),
    ('3.12', '1.26', '4.6'),
    ('3.12', '2.x', '5'),
    ('3.13', '2.x', '5'),
]


@nox.session
@nox.parametrize(
    ('python', 'numpy', 'opencv'),
    CORNERS,
    ids=[f'py{python}-numpy{numpy}-opencv{opencv}' for python, numpy, opencv in CORNERS],
)
def suite(session: nox.Session, numpy: str, opencv: str) -> None:
    """The whole suite in one corner."""
    # The ROS wheels lead the interpreter to their libraries by these; another environment's
    # would win.
    for name in ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONPATH'):
        session.env[name] = ''
    session.install('--editable', '.[ros,test]', NUMPY[numpy], OPENCV[opencv])
    session.run(
        'python',
        '-c',
        'import sys, numpy, cv2; print(sys.version.split()[0], numpy.__version__, cv2.__version__)',
    )
    session.run('python', '-m', 'pytest', *session.posargs)
