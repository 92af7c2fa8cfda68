"""Installs the Python package through catkin."""

from distutils.core import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(packages=["fv_viz", "fv_viz.offscreen"], package_dir={"": "src"}))
