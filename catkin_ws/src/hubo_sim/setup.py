from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

CONCEPTS = ("commands", "control", "ground_truth", "ros", "sensors", "worlds", "worlds.kinds")

setup(
    **generate_distutils_setup(
        packages=["hubo_sim", *(f"hubo_sim.{concept}" for concept in CONCEPTS)], package_dir={"": "src"}
    )
)
