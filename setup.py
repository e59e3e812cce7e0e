# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""How the package is installed, by pip and by colcon alike.

Metadata and entry points stay here and out of pyproject.toml: colcon loses scripts that are written
there when it builds with ``--symlink-install``.
"""

import re
import sys
from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).resolve().parent
NAME = 'rgbd_kcf_tracker'

# Where apt or colcon already brought ROS 2, nothing of this extra is needed. The versions belong
# together: without them pip mixes in another distribution of ROS.
ROS = [
    'ros-rclpy[fastrtps]==7.1.6',
    'ros-sensor-msgs==5.3.6',
    'ros-std-msgs==5.3.6',
    'ros-geometry-msgs==5.3.6',
    'ros-std-srvs==5.3.6',
    'ros-diagnostic-msgs==5.3.6',
    'ros-visualization-msgs==5.3.6',
    'ros-lifecycle-msgs==2.0.3',
    'ros-rosgraph-msgs==2.0.3',
]
# What a robot does without; extras.py tells which command needs which.
BATCH = ['threadpoolctl']
REPORT = ['matplotlib>=3.7', 'jinja2', 'threadpoolctl']
VIDEO = ['imageio-ffmpeg']
VIEW = ['aiohttp>=3.8']
TOOLS = [*REPORT, *VIDEO, 'tqdm', 'psutil']
CLUSTER = ['distributed>=2022.12', 'threadpoolctl']
# pyarrow 26 refuses NumPy 1.26, which Ubuntu has; later Pythons have no NumPy 1.
PARQUET = ['pyarrow<26; python_version < "3.13"', 'pyarrow; python_version >= "3.13"']
TEST = [
    'pytest>=8',
    'pytest-timeout',
    'pytest-xdist',
    'hypothesis',
    'colcon-common-extensions',
    'setuptools>=70.1,<80',  # builds wheels by itself; colcon refuses later ones
]
# The site of docs/.
DOCS = ['sphinx>=7', 'myst-parser>=3', 'furo']
LINT = [
    'ruff==0.17.5',
    'mypy==2.4.1',
    'types-PyYAML',
]


def version() -> str:
    """The version as the package states it."""
    text = (HERE / NAME / '__init__.py').read_text(encoding='utf-8')
    match = re.search(r"^__version__ = '([^']+)'$", text, re.MULTILINE)
    if match is None:
        raise RuntimeError(f'{NAME}/__init__.py states no __version__')
    return match.group(1)


def shared(folder: str, *patterns: str) -> tuple[str, list[str]]:
    """The files of a folder that belong under share/, by setup.py's rules as relative paths."""
    files = sorted(p for pattern in patterns for p in (HERE / folder).glob(pattern))
    return f'share/{NAME}/{folder}', [str(p.relative_to(HERE)) for p in files]


# colcon puts the executables there by itself (setup.cfg); pip puts them into bin alone.
FOR_ROS2_RUN = (
    [
        (
            f'lib/{NAME}',
            [
                f'resource/lib/{name}'
                for name in ('tracker', 'replay', 'viewer', 'follow', 'rgbd-kcf')
            ],
        )
    ]
    if 'bdist_wheel' in sys.argv
    else []
)

setup(
    name=NAME,
    version=version(),
    description='RGB-D single-target tracking for ROS 2: boxes at camera rate, and the truth '
    'about when the target is hidden',
    long_description=(HERE / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    author='The rgbd_kcf_tracker authors',
    maintainer='The rgbd_kcf_tracker authors',
    license='Apache-2.0',
    license_files=['LICENSE'],
    keywords=['ROS', 'tracking', 'RGB-D', 'Kinect', 'correlation filter', 'occlusion'],
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Science/Research',
        'License :: OSI Approved :: Apache Software License',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3',
        'Topic :: Scientific/Engineering :: Image Recognition',
        'Typing :: Typed',
    ],
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed', '**/*.html', '**/*.j2', '**/*.css', '**/*.js']},
    data_files=[
        *FOR_ROS2_RUN,
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        shared('config', '*.yaml', '*.xml', '*.rviz', '*.json'),
        shared('launch', '*.py', '*.yaml', '*.xml'),
    ],
    python_requires='>=3.10',
    install_requires=[
        'numpy>=1.26',
        'scipy>=1.10',
        'opencv-python-headless>=4.6',
        'rosbags>=0.11',
        'mcap>=1.6',  # Writer.flush
        'mcap-ros2-support>=0.5',
        'lz4',
        'zstandard',
        'PyYAML',
        *BATCH,  # small, and many recordings at once need it; colcon leaves it out
    ],
    extras_require={
        'batch': BATCH,
        'report': REPORT,
        'video': VIDEO,
        'view': VIEW,
        'tools': TOOLS,
        'cluster': CLUSTER,
        'parquet': PARQUET,
        'ros': ROS,
        'test': [*TOOLS, *VIEW, *CLUSTER, *PARQUET, *TEST],
        'lint': LINT,
        'docs': DOCS,
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'rgbd-kcf = rgbd_kcf_tracker.cli.main:main',
            'tracker = rgbd_kcf_tracker.ros.tracker_main:main',
            'replay = rgbd_kcf_tracker.ros.replay_main:main',
            'viewer = rgbd_kcf_tracker.ros.viewer_main:main',
            'follow = rgbd_kcf_tracker.ros.follow_main:main',
        ],
    },
)
