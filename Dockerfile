# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

# ROS 2 Jazzy with the package built in a workspace, and what reads bags:
#
#     docker build -t rgbd_kcf_tracker .
#     docker run --rm -it --net=host --ipc=host rgbd_kcf_tracker \
#         ros2 launch rgbd_kcf_tracker tracker.launch.py camera:=kinect2_qhd auto_init:=true
#
# --ipc=host shares /dev/shm with a camera driver outside; between containers, --shm-size=512m and
# --ipc=container:NAME. The nodes fit their segments to what /dev/shm has.
FROM ros:jazzy

WORKDIR /rgbd
COPY package.xml src/rgbd_kcf_tracker/
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-pip \
    && rosdep update --rosdistro "$ROS_DISTRO" \
    && rosdep install --from-paths src --ignore-src -y --dependency-types exec \
    && rm -rf /var/lib/apt/lists/*
# Not in apt; nothing else of this image's Python depends on them.
RUN python3 -m pip install --no-cache-dir --break-system-packages \
    rosbags mcap mcap-ros2-support

COPY setup.py setup.cfg pyproject.toml README.md LICENSE src/rgbd_kcf_tracker/
COPY rgbd_kcf_tracker src/rgbd_kcf_tracker/rgbd_kcf_tracker
COPY config src/rgbd_kcf_tracker/config
COPY launch src/rgbd_kcf_tracker/launch
COPY resource src/rgbd_kcf_tracker/resource
RUN . "/opt/ros/$ROS_DISTRO/setup.sh" \
    && colcon build --merge-install \
    && rm -rf build log \
    && sed -i '/^exec/i source /rgbd/install/setup.bash --' /ros_entrypoint.sh

CMD ["ros2", "run", "rgbd_kcf_tracker", "tracker"]
