from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["hubo_sim", "hubo_sim.ground_truth"], package_dir={"": "src"}))
