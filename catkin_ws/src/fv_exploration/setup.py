"""Catkin's Python set-up of this package."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "fv_exploration",
            "fv_exploration.recordings",
            "fv_exploration.ros",
            "fv_exploration.strategy",
        ],
        package_dir={"": "src"},
    )
)
