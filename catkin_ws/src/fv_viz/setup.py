"""Installs the Python package through catkin."""

from distutils.core import setup

from catkin_pkg.python_setup import generate_distutils_setup

PACKAGES = ["fv_viz", "fv_viz.drawing", "fv_viz.offscreen", "fv_viz.report"]

setup(
    **generate_distutils_setup(
        packages=PACKAGES, package_dir={"": "src"}, package_data={"fv_viz.report": ["page.css", "scene3d.js"]}
    )
)
