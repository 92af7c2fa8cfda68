from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

AREAS = ("capability", "exploration", "planning", "simulation", "viz")

setup(
    **generate_distutils_setup(
        packages=["fv_bench", *(f"fv_bench.{area}" for area in AREAS)], package_dir={"": "src"}
    )
)
