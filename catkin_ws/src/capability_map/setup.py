from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

CONCEPTS = ("building", "drawing", "ros")

setup(
    **generate_distutils_setup(
        packages=["capability_map", *(f"capability_map.{concept}" for concept in CONCEPTS)],
        package_dir={"": "src"},
    )
)
